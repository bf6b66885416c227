//! `sunset`: looking straight into a low sun through the crowns of trees.
//!
//! The wood is that of `grove`, planted otherwise: an avenue with a tree in front of the sun.

use super::glb_writer::{GlbScene, Node};
use super::grove::{GROUND_CELLS, Species, ground};
use super::random::Random;
use super::shot::BuiltinShot;
use super::tree::Foliage;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "sunset",
    shows: "the epipole in the middle of the picture, behind foliage: shafts to all sides, and view rays nearly along \
            the light, where epipolar coordinates are at their worst",
    shot_text: r#"# Into a low sun through foliage: the epipole is in the middle of the picture.
mesh = "sunset.glb"

[camera]
eye = [0.0, 1.7, 20.0]
target = [0.0, 3.6, 10.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 55.0
resolution = [640, 480]
max_distance = 70.0

[light]
kind = "directional"
direction = [-0.03, -0.225, 1.0]
irradiance = [12.0, 8.0, 4.5]

[medium]
scattering = [0.025, 0.025, 0.025]
absorption = [0.003, 0.003, 0.003]
phase = "henyey-greenstein"
g = 0.6
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Where trees stand (x, z), and how tall they are against their kind.
const TREES: &[(f64, f64, f64)] = &[
    (2.4, 0.5, 1.0),
    (-4.6, 7.5, 0.85),
    (5.2, 6.0, 0.9),
    (-7.4, 1.0, 1.0),
    (8.2, 0.0, 1.0),
    (-3.2, -6.0, 1.0),
    (4.4, -7.5, 1.05),
    (-8.8, -7.0, 1.1),
    (10.0, -8.0, 1.1),
    (0.4, -14.0, 1.1),
    (-6.0, -15.0, 1.1),
    (6.8, -16.0, 1.15),
    (-13.0, -3.0, 1.1),
    (14.0, -4.0, 1.1),
    (-12.5, -14.0, 1.2),
    (13.5, -15.0, 1.2),
    (-9.5, 8.5, 0.9),
    (10.2, 8.0, 0.95),
    (-2.5, -24.0, 1.2),
    (4.0, -25.0, 1.2),
];

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("ground", ground(GROUND_CELLS));
    let species = Species::grow(&mut scene, Foliage::Leaves { count: 9000, length: 0.26 });
    let wood = scene.add_node(None, Node::new("trees"));
    let mut random = Random::new(2017);
    for spot in TREES {
        species.plant(&mut scene, wood, &mut random, spot);
    }
    scene.to_bytes()
}
