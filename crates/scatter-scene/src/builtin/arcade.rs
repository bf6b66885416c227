//! `arcade`: a cloister walk; the sun falls between the columns of its open side in stripes.
//!
//! The walk is 32 m long (x), 4.4 m wide (z) and 4.6 m high; on its open side columns stand on a parapet and carry
//! round arches. Columns are instances of one mesh.

use super::blocks::Blocks;
use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "arcade",
    shows: "striped shafts between a row of columns, seen along the row: near and far stripes of very different \
            width in one picture, each a transition",
    shot_text: r#"# A cloister walk, the sun in stripes between its columns.
mesh = "arcade.glb"

[camera]
eye = [-15.0, 1.5, -1.3]
target = [0.0, 1.7, -0.9]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 44.0
resolution = [640, 480]
max_distance = 40.0

[light]
kind = "directional"
direction = [-0.72, -0.48, -0.58]
irradiance = [10.0, 9.0, 7.5]

[medium]
scattering = [0.05, 0.05, 0.05]
absorption = [0.005, 0.005, 0.005]
phase = "henyey-greenstein"
g = 0.4
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Bays of the open side, and their length \[m\].
const BAYS: usize = 16;
const BAY: f64 = 2.0;
const HALF_LENGTH: f64 = 16.0;
const HALF_WIDTH: f64 = 2.2;
const HEIGHT: f64 = 4.6;
const WALL: f64 = 0.5;
/// Parapet's top, springing of the arches, their span and rise \[m\].
const PARAPET: f64 = 0.8;
const SPRING: f64 = 2.7;
const SPAN: f64 = 0.9;
/// Cells across an arch and across the vault: enough that they look round.
const ARCH_CELLS: usize = 12;
const VAULT_CELLS: usize = 12;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("walk", walk());
    let column = scene.add_mesh("column", column());
    let row = scene
        .add_node(None, Node::new("columns").at(DVec3::new(-HALF_LENGTH, PARAPET, HALF_WIDTH + WALL / 2.0)));
    for index in 0..=BAYS {
        let x = BAY * index as f64;
        scene.add_node(
            Some(row),
            Node::new(format!("column {index}")).mesh(column).at(DVec3::new(x, 0.0, 0.0)),
        );
    }
    scene.to_bytes()
}

/// Floor, three walls, the vault, the parapet and the wall over the arches, in one closed solid.
fn walk() -> Mesh {
    let mut xs = vec![-HALF_LENGTH - WALL, -HALF_LENGTH];
    let mut arches = Vec::new();
    for bay in 0..BAYS {
        let left = BAY * (bay as f64 + 0.5) - HALF_LENGTH - SPAN / 2.0;
        arches.push(xs.len());
        xs.extend((0..=ARCH_CELLS).map(|i| left + SPAN * i as f64 / ARCH_CELLS as f64));
    }
    xs.extend([HALF_LENGTH, HALF_LENGTH + WALL]);
    let mut zs = vec![-HALF_WIDTH - WALL];
    zs.extend((0..=VAULT_CELLS).map(|i| HALF_WIDTH * (2.0 * i as f64 / VAULT_CELLS as f64 - 1.0)));
    zs.push(HALF_WIDTH + WALL);
    let (x_cells, z_cells) = (xs.len() - 1, zs.len() - 1);

    let vault = |z: f64| HEIGHT - 0.22 * (z.abs().min(HALF_WIDTH) / HALF_WIDTH).powi(2) * HALF_WIDTH;
    // Layers: slab, parapet, columns, arches, vault. Between the arches' feet the columns are free-standing.
    let solid = |[i, j, k]: [usize; 3]| {
        let at_end = i == 0 || i == x_cells - 1;
        let open_side = k == z_cells - 1;
        match j {
            0 | 5 => true,
            1 | 4 => at_end || k == 0 || open_side,
            3 => at_end || k == 0 || (open_side && !arches.iter().any(|&a| (a..a + ARCH_CELLS).contains(&i))),
            _ => at_end || k == 0,
        }
    };
    let position = |[i, j, k]: [usize; 3]| {
        let (x, z) = (xs[i], zs[k]);
        let arch = arches.iter().find(|&&a| (a..=a + ARCH_CELLS).contains(&i)).map_or(0.0, |&a| {
            let from_middle = x - xs[a] - SPAN / 2.0;
            (SPAN * SPAN / 4.0 - from_middle * from_middle).max(0.0).sqrt()
        });
        let y = match j {
            0 => -0.4,
            1 => 0.0,
            2 => PARAPET,
            3 => SPRING,
            4 => SPRING + 0.15 + arch,
            5 => vault(z),
            _ => HEIGHT + 0.4,
        };
        DVec3::new(x, y, z)
    };
    let mut mesh = Mesh::default();
    Blocks::new([x_cells, 6, z_cells]).add_to(&mut mesh, solid, position);
    mesh
}

/// A column between parapet and springing, sunk a little into both.
fn column() -> Mesh {
    let height = SPRING - PARAPET;
    let mut mesh = Mesh::default();
    let profile = [
        (0.46, -0.05),
        (0.46, 0.08),
        (0.4, 0.1),
        (0.43, 0.14),
        (0.36, 0.18),
        (0.33, height - 0.32),
        (0.37, height - 0.3),
        (0.36, height - 0.26),
        (0.47, height - 0.1),
        (0.5, height - 0.08),
        (0.5, height + 0.05),
    ];
    mesh.add_lathe(DVec3::ZERO, &profile, 20);
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn every_part_is_closed_and_faces_outwards() {
        for mesh in [walk(), column()] {
            assert_closed(&mesh);
            assert!(volume(&mesh) > 0.0, "inside out");
        }
    }
}
