//! `grove`: a clearing among trees; the sun comes through the leaves ahead.
//!
//! Five trees, each a mesh of wood and one of leaves, are planted many times, turned and scaled.

use super::glb_writer::{GlbScene, MeshId, Node, NodeId};
use super::mesh::Mesh;
use super::random::Random;
use super::shot::BuiltinShot;
use super::terrain::{sheet, smooth_noise};
use super::tree::{Foliage, Habit, Tree};
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "grove",
    shows: "sun through foliage: hundreds of thousands of leaves, silhouettes everywhere in depth and shadow \
            map, and dozens of short transitions a ray",
    shot_text: r#"# A clearing among trees, the sun through the leaves ahead.
mesh = "grove.glb"

[camera]
eye = [0.0, 1.7, 15.0]
target = [0.2, 3.6, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 58.0
resolution = [640, 480]
max_distance = 70.0

[light]
kind = "directional"
direction = [0.3, -0.68, 0.67]
irradiance = [10.0, 9.0, 7.5]

[medium]
scattering = [0.02, 0.02, 0.02]
absorption = [0.002, 0.002, 0.002]
phase = "henyey-greenstein"
g = 0.35
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Side of the ground, and the distance of its grid lines \[m\].
const GROUND: f64 = 120.0;
pub(super) const GROUND_CELLS: usize = 120;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("ground", ground(GROUND_CELLS));
    let species = Species::grow(&mut scene, Foliage::Leaves { count: 9000, length: 0.26 });
    plant_all(&mut scene, &species);
    scene.to_bytes()
}

/// Plants all trees of the clearing.
pub(super) fn plant_all(scene: &mut GlbScene, species: &Species) {
    let wood = scene.add_node(None, Node::new("trees"));
    let mut random = Random::new(2010);
    for spot in TREES {
        species.plant(scene, wood, &mut random, spot);
    }
}

/// Where trees stand (x, z), and how tall they are against their kind.
const TREES: &[(f64, f64, f64)] = &[
    (-4.6, 6.5, 1.05),
    (4.9, 7.5, 0.95),
    (-8.0, 9.5, 1.0),
    (8.6, 10.5, 1.05),
    (-2.6, 0.5, 1.1),
    (3.4, -0.5, 1.0),
    (-7.4, 1.5, 1.0),
    (7.9, 2.5, 1.1),
    (0.6, -6.0, 1.15),
    (-5.0, -6.5, 1.05),
    (5.8, -7.0, 1.1),
    (-10.5, -3.5, 1.1),
    (11.0, -3.0, 1.0),
    (-1.6, -12.5, 1.1),
    (4.0, -13.5, 1.15),
    (-8.4, -13.0, 1.2),
    (9.6, -13.0, 1.1),
    (-14.5, -9.0, 1.1),
    (15.0, -10.0, 1.2),
    (-12.5, 5.0, 1.1),
    (13.0, 5.5, 1.1),
    (1.5, -20.0, 1.2),
    (-5.5, -20.5, 1.1),
    (8.0, -21.0, 1.25),
    (-13.0, -18.5, 1.15),
    (15.0, -19.0, 1.1),
];

/// The kinds of trees of a wood, as meshes of a file.
pub(super) struct Species(Vec<(MeshId, MeshId)>);

impl Species {
    /// Grows five trees and puts their meshes into the scene.
    pub(super) fn grow(scene: &mut GlbScene, foliage: Foliage) -> Self {
        let kinds = (0..5_u64).map(|kind| {
            let habit = Habit {
                height: 10.5 + 0.6 * kind as f64,
                bare: 0.36,
                spread: 2.9,
                branches: 18,
                foliage,
                tuft: 0.55,
            };
            let tree = Tree::grow(100 + kind, &habit);
            let wood = scene.add_mesh(format!("wood {kind}"), tree.wood);
            let leaves = scene.add_mesh(format!("leaves {kind}"), tree.leaves);
            (wood, leaves)
        });
        Self(kinds.collect())
    }

    /// Plants one tree at (x, z), turned at random.
    pub(super) fn plant(
        &self,
        scene: &mut GlbScene,
        parent: NodeId,
        random: &mut Random,
        &(x, z, size): &(f64, f64, f64),
    ) {
        let (wood, leaves) = self.0[random.bits() as usize % self.0.len()];
        let place = DVec3::new(x, ground_height(x, z), z);
        // Quantised, so that the file shows short numbers.
        let turns = (random.unit() * 64.0).floor() / 64.0;
        let tree = Node::new(format!("tree {x} {z}")).at(place).turned(turns).scaled(DVec3::splat(size));
        let tree = scene.add_node(Some(parent), tree);
        scene.add_node(Some(tree), Node::new("wood").mesh(wood));
        scene.add_node(Some(tree), Node::new("leaves").mesh(leaves));
    }
}

/// Gently rolling ground, on a grid of 1/64 m.
pub(super) fn ground_height(x: f64, z: f64) -> f64 {
    let height = 0.6 * smooth_noise(x / 14.0, z / 14.0, 1) + 0.12 * smooth_noise(x / 3.0, z / 3.0, 2);
    (height * 64.0).round() / 64.0
}

/// The ground, of so many cells a side: a sheet, not a solid.
pub(super) fn ground(cells: usize) -> Mesh {
    let half = GROUND / 2.0;
    sheet([-half, -half], [half, half], [cells; 2], ground_height)
}
