//! `smoke`: three columns of smoke in a low sun, each in the shadow of the one before.
//!
//! The columns stand in a row along the light, so that the light which reaches the third one has passed the other two; they
//! rise from bowls and widen. Between them air is lit through a hundred spheres that overlap.

use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::occluder_mesh::OccluderMesh;
use super::random::{Random, sin_cos_turns};
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "smoke",
    shows: "three columns of smoke that shade each other and the air behind them: light that is dimmed on its way rather \
            than cut off",
    shot_text: r#"# Three columns of smoke in a low sun, each in the shadow of the one before.
mesh = "smoke.glb"

[camera]
eye = [1.5, 1.9, 10.5]
target = [0.2, 2.9, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 52.0
resolution = [640, 480]
max_distance = 60.0

[light]
kind = "directional"
direction = [0.92, -0.38, -0.12]
irradiance = [10.0, 8.5, 6.5]

[medium]
scattering = [0.05, 0.05, 0.05]
absorption = [0.008, 0.008, 0.008]
phase = "henyey-greenstein"
g = 0.3
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Spheres of a column.
const SPHERES: u32 = 110;
/// Where the columns stand.
const FEET: [DVec3; 3] =
    [DVec3::new(-3.9, 0.35, 0.5), DVec3::new(-0.6, 0.35, 0.1), DVec3::new(2.7, 0.35, -0.4)];

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    let mut ground = Mesh::default();
    ground.add_box(DVec3::new(-16.0, -0.4, -12.0), DVec3::new(16.0, 0.0, 14.0));
    scene.add_mesh_node("ground", ground);
    let mut bowl = Mesh::default();
    bowl.add_lathe(DVec3::ZERO, &[(0.18, -0.02), (0.34, 0.18), (0.42, 0.36), (0.3, 0.3)], 20);
    let bowl = scene.add_mesh("bowl", bowl);
    let mut random = Random::new(1811);
    for (index, foot) in FEET.into_iter().enumerate() {
        scene.add_node(None, Node::new(format!("bowl {index}")).mesh(bowl).at(foot - DVec3::Y * 0.35));
        let column = OccluderMesh::particles(&column(foot, SPHERES, 5.2, &mut random));
        scene.add_occluder_node(&format!("smoke {index}"), column);
    }
    scene.to_bytes()
}

/// Spheres of a column of smoke of this height: it winds about an axis that leans, widens, and thins out.
pub(super) fn column(foot: DVec3, count: u32, height: f64, random: &mut Random) -> Vec<(DVec3, f64, f64)> {
    let turns = random.unit();
    (0..count)
        .map(|index| {
            // More of them near the foot, where they are small.
            let share = (f64::from(index) + random.unit()) / f64::from(count);
            let up = share * (0.4 + 0.6 * share);
            let (sine, cosine) = sin_cos_turns(turns + 1.3 * up);
            let axis = DVec3::new(0.55 * up * cosine + 0.5 * up * up, height * up, 0.55 * up * sine);
            let spread = 0.1 + 0.55 * up;
            let radius = (0.14 + 0.5 * up) * random.between(0.7, 1.25);
            let density = random.between(0.7, 1.3) * 3.0 / (0.25 + 1.6 * up);
            (foot + axis + random.in_ball() * spread, radius, density)
        })
        .collect()
}
