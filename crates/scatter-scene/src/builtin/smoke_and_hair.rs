//! `smoke-and-hair`: the head of `hair` under a spot, with smoke that drifts between the two.
//!
//! A binary glTF file with attributes of its own: spheres whose densities differ by a factor of ten, and strands that are
//! thinner at their tips. Along one light ray smoke takes light slowly and hair takes it in steps.

use super::glb_writer::GlbScene;
use super::hair::{HEAD, add_bust, head_of_hair};
use super::occluder_mesh::OccluderMesh;
use super::random::Random;
use super::shot::BuiltinShot;
use super::smoke::column;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "smoke-and-hair",
    shows: "a spot through drifting smoke onto a head of hair: slow and sudden dimming on one light ray, in a perspective \
            map",
    shot_text: r#"# A spot through smoke onto a head of hair.
mesh = "smoke-and-hair.glb"

[camera]
eye = [-1.1, 1.5, 3.1]
target = [-0.1, 1.3, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 46.0
resolution = [640, 480]
max_distance = 14.0

[light]
kind = "spot"
position = [-2.2, 3.1, -1.6]
direction = [0.68, -0.55, 0.5]
intensity = [60.0, 54.0, 44.0]
inner_cone_degrees = 22.0
outer_cone_degrees = 30.0

[medium]
scattering = [0.18, 0.18, 0.18]
absorption = [0.02, 0.02, 0.02]
phase = "henyey-greenstein"
g = 0.3
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

fn mesh_bytes() -> Vec<u8> {
    let mut random = Random::new(90);
    let mut scene = GlbScene::default();
    add_bust(&mut scene);
    let hair = head_of_hair(5_000, 10, &mut random);
    scene.add_occluder_node("hair", OccluderMesh::strands(&hair, 0.0024, 0.6));
    // Drifts across the beam, half way between the lamp and the head.
    let foot = DVec3::new(-1.35, 0.9, -0.75);
    let smoke: Vec<(DVec3, f64, f64)> = column(foot, 90, 2.4, &mut random)
        .into_iter()
        .map(|(centre, radius, density)| (foot + (centre - foot) * 0.62, 0.45 * radius, 1.6 * density))
        .filter(|(centre, radius, _)| centre.distance(HEAD.0) > HEAD.1 + radius)
        .collect();
    scene.add_occluder_node("smoke", OccluderMesh::particles(&smoke));
    scene.to_bytes()
}
