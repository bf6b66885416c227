//! `haze`: rock towers over a plain, eight kilometres of clear air and haze between them.
//!
//! Four towers, planted many times, turned and stretched. The medium is a list: Rayleigh scattering of clear air at
//! sea level (5.8, 13.5, 33.1 per 1000 km for red, green, blue; Bruneton and Neyret 2008, table of section 4), and
//! haze that scatters forwards.

use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::random::{Random, sin_cos_turns};
use super::shot::BuiltinShot;
use super::terrain::{sheet, smooth_noise};
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "haze",
    shows: "blue air and golden haze over kilometres: two scattering components with different phase functions and a \
            coloured extinction, which a single grey channel cannot carry",
    shot_text: r#"# Clear air and haze over kilometres: two scattering components, coloured extinction.
mesh = "haze.glb"

[camera]
eye = [0.0, 380.0, 4200.0]
target = [-150.0, 480.0, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 45.0
resolution = [640, 480]
max_distance = 12000.0

[light]
kind = "directional"
direction = [0.5, -0.18, 0.75]
irradiance = [10.0, 9.0, 7.5]

[medium]
absorption = [0.000002, 0.000002, 0.000004]

[[medium.components]]
scattering = [0.0000058, 0.0000135, 0.0000331]
phase = "rayleigh"

[[medium.components]]
scattering = [0.00005, 0.00005, 0.00005]
phase = "henyey-greenstein"
g = 0.7
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Half the plain's side \[m\], and its cells a side.
const HALF_PLAIN: f64 = 9000.0;
const PLAIN_CELLS: usize = 240;
/// Rings of a tower from foot to top, and vertices around it.
const RINGS: usize = 40;
const AROUND: usize = 56;
/// Towers in all, and kinds of them.
const TOWERS: usize = 88;
const KINDS: usize = 4;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    let side = [HALF_PLAIN, HALF_PLAIN];
    let plain = sheet(side.map(|half| -half), side, [PLAIN_CELLS; 2], plain_height);
    scene.add_mesh_node("plain", plain);
    let kinds: Vec<_> =
        (0..KINDS).map(|kind| scene.add_mesh(format!("tower {kind}"), tower(kind as u64))).collect();
    let towers = scene.add_node(None, Node::new("towers"));
    let mut random = Random::new(2012);
    let mut count = 0;
    while count < TOWERS {
        let x = random.between(-4600.0, 4600.0).round();
        let z = random.between(-5200.0, 3000.0).round();
        let turns = (random.unit() * 64.0).floor() / 64.0;
        let height = (random.between(450.0, 1300.0) / 4.0).round() * 4.0;
        let width = (height * random.between(0.3, 0.5) / 4.0).round() * 4.0;
        // The middle of the view stays open towards the distance.
        if x.abs() < 420.0 {
            continue;
        }
        let node = Node::new(format!("tower {count}"))
            .mesh(kinds[count % KINDS])
            .at(DVec3::new(x, -20.0, z))
            .turned(turns)
            .scaled(DVec3::new(width, height, width));
        scene.add_node(Some(towers), node);
        count += 1;
    }
    scene.to_bytes()
}

/// A low, rolling plain \[m\].
fn plain_height(x: f64, z: f64) -> f64 {
    25.0 * smooth_noise(x / 1100.0, z / 1100.0, 3) + 6.0 * smooth_noise(x / 240.0, z / 240.0, 4)
}

/// A rock tower of height 1 and radius about 1/2, closed: steep sides, a round top, gullies all around.
fn tower(kind: u64) -> Mesh {
    let mut mesh = Mesh::default();
    let profile = |up: f64| 0.5 * (1.0 - up * up * up).max(0.0).sqrt() * (0.72 + 0.28 * (1.0 - up));
    let ring = |ring: usize| -> Vec<DVec3> {
        let up = ring as f64 / RINGS as f64;
        (0..AROUND)
            .map(|index| {
                let (sine, cosine) = sin_cos_turns(index as f64 / AROUND as f64);
                // Noise on a cylinder: two samples of the plane's noise, added.
                let rough = 0.6 * smooth_noise(3.0 * cosine + 9.0, 3.0 * sine + 4.0 * up, 50 + kind)
                    + 0.4 * smooth_noise(8.0 * cosine - 5.0 * up, 8.0 * sine + 17.0, 60 + kind);
                let radius = profile(up) * (1.0 + 0.28 * rough);
                DVec3::new(radius * sine, up, radius * cosine)
            })
            .collect()
    };
    let rings: Vec<Vec<DVec3>> = (0..=RINGS).map(ring).collect();
    mesh.add_rings(&rings);
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn towers_are_closed_and_face_outwards() {
        for kind in 0..KINDS as u64 {
            assert_closed(&tower(kind));
            assert!(volume(&tower(kind)) > 0.1);
        }
    }
}
