//! `comb`: a long shed under a roof of thin slats; every view ray passes many sheets of light.
//!
//! 16 m long (x), 12 m wide (z), 5 m high. The slats lie across it, 60 mm thick every 250 mm. They are one mesh hung
//! up many times, in groups a metre long.

use super::blocks::Blocks;
use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::random::mix;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "comb",
    shows: "sheets of light between thin slats: dozens of transitions a ray, the worst case for what skips over \
            uniform pieces of a ray, and aliasing for what samples too coarsely",
    shot_text: r#"# A shed under a roof of thin slats: dozens of transitions a ray.
mesh = "comb.glb"

[camera]
eye = [1.5, 3.4, 5.7]
target = [-0.6, 0.3, -2.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [640, 480]
max_distance = 40.0

[light]
kind = "directional"
direction = [-0.6, -1.0, 0.3]
irradiance = [10.0, 9.0, 7.5]

[medium]
scattering = [0.05, 0.05, 0.05]
absorption = [0.01, 0.01, 0.01]
phase = "henyey-greenstein"
g = 0.3
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

const HALF_LENGTH: f64 = 8.0;
const HALF_WIDTH: f64 = 6.0;
const HEIGHT: f64 = 5.0;
const WALL: f64 = 0.25;
/// Slats: one each quarter of a metre, 60 mm thick and 250 mm high.
const SLATS_PER_METRE: usize = 4;
const SLAT_THICKNESS: f64 = 0.06;
const SLAT_HEIGHT: f64 = 0.25;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("shed", shed());
    let mut slat = Mesh::default();
    let half = DVec3::new(SLAT_THICKNESS, SLAT_HEIGHT, 2.0 * (HALF_WIDTH + WALL / 2.0)) / 2.0;
    slat.add_box(-half, half);
    let slat = scene.add_mesh("slat", slat);
    let roof = scene.add_node(None, Node::new("roof").at(DVec3::new(-HALF_LENGTH, HEIGHT, 0.0)));
    for metre in 0..2 * HALF_LENGTH as usize {
        let group = Node::new(format!("metre {metre}")).at(DVec3::new(metre as f64, 0.0, 0.0));
        let group = scene.add_node(Some(roof), group);
        for index in (0..SLATS_PER_METRE).filter(|index| !is_missing(SLATS_PER_METRE * metre + index)) {
            let x = (index as f64 + 0.5) / SLATS_PER_METRE as f64;
            let node = Node::new(format!("slat {metre}.{index}")).mesh(slat).at(DVec3::new(x, 0.0, 0.0));
            scene.add_node(Some(group), node);
        }
    }
    scene.to_bytes()
}

/// Whether a slat of the roof is lost: about one in six, at random, for wide sheets of light among the thin ones.
fn is_missing(slat: usize) -> bool {
    mix(slat as u64 + 6).is_multiple_of(6)
}

/// Floor and four walls; the slats' ends rest in the long ones.
fn shed() -> Mesh {
    let xs = [-HALF_LENGTH - WALL, -HALF_LENGTH, HALF_LENGTH, HALF_LENGTH + WALL];
    let ys = [-WALL, 0.0, HEIGHT + SLAT_HEIGHT];
    let zs = [-HALF_WIDTH - WALL, -HALF_WIDTH, HALF_WIDTH, HALF_WIDTH + WALL];
    let mut mesh = Mesh::default();
    Blocks::new([3, 2, 3]).add_to(
        &mut mesh,
        |cell| cell != [1, 1, 1],
        |[i, j, k]| DVec3::new(xs[i], ys[j], zs[k]),
    );
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::assert_closed;
    use super::*;

    #[test]
    fn the_shed_is_closed() {
        assert_closed(&shed());
    }
}
