//! `nave`: a vaulted hall with two rows of columns; the sun comes in through tall windows on one side.
//!
//! The hall is 32 m long (x), 12 m wide (z) and 13 m high. Shell and arcade walls are warped grids of cells:
//! closed, with walls of finite thickness, so that no light leaks in. Columns and ribs are instances.

use super::blocks::Blocks;
use super::glass::{LANCET, MULLION, png_bytes};
use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "nave",
    shows: "shafts through tall coloured windows, cut by columns: a textured light, and an indoor picture most of \
            which is dark, with a few transitions a ray, where marching wastes nearly all its samples",
    shot_text: r#"# A vaulted hall: the sun through tall coloured windows, cut by two rows of columns.
mesh = "nave.glb"

[camera]
eye = [-15.0, 1.7, -2.2]
target = [0.0, 3.9, 0.9]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [640, 480]
max_distance = 100.0

[light]
kind = "directional"
direction = [-0.2, -0.58, -0.78]
irradiance = [14.0, 12.6, 10.5]

[light.texture]
image = "nave-glass.png"
center = [0.0, 5.0, 6.3]
half_extents = [15.0, 4.5]
up = [0.0, 1.0, 0.0]

[medium]
scattering = [0.03, 0.03, 0.03]
absorption = [0.0, 0.0, 0.0]
phase = "henyey-greenstein"
g = 0.4
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[("nave-glass.png", png_bytes)],
};

/// Bays along the hall, and their length \[m\].
const BAYS: usize = 8;
const BAY: f64 = 4.0;
/// Inner half length and half width of the hall, and its walls' thickness \[m\].
const HALF_LENGTH: f64 = 16.0;
const HALF_WIDTH: f64 = 6.0;
const WALL: f64 = 0.6;
/// Windows \[m\].
const SILL: f64 = 2.2;
const WINDOW_SPRING: f64 = 6.6;
/// The vault: a circular arc that springs at this height at the walls and rises by `VAULT_RISE` \[m\].
const VAULT_SPRING: f64 = 9.0;
const VAULT_RISE: f64 = 4.0;
/// The rows of columns: distance from the axis, height of the capitals' top \[m\].
const COLUMN_ROW: f64 = 3.7;
const COLUMN_HEIGHT: f64 = 6.0;
/// Cells across a lancet, an arch of the arcade, the vault: enough that their curves look round.
const LANCET_CELLS: usize = 8;
const ARCH_CELLS: usize = 16;
const VAULT_CELLS: usize = 24;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("shell", shell());

    let arcade = scene.add_mesh("arcade", arcade_wall());
    let column = scene.add_mesh("column", column());
    for (side, sign) in [("south", 1.0), ("north", -1.0)] {
        // The second row is the first one turned around, not mirrored: faces keep looking outwards.
        let turns = if sign > 0.0 { 0.0 } else { 0.5 };
        let row = scene.add_node(
            None,
            Node::new(format!("{side} row")).at(DVec3::new(0.0, 0.0, sign * COLUMN_ROW)).turned(turns),
        );
        scene.add_node(Some(row), Node::new(format!("{side} arcade")).mesh(arcade));
        for index in 1..BAYS {
            let x = BAY * index as f64 - HALF_LENGTH;
            let node = Node::new(format!("{side} column {index}"))
                .mesh(column)
                .at(DVec3::new(x, 0.0, 0.0))
                .scaled(DVec3::new(1.0, COLUMN_HEIGHT, 1.0));
            scene.add_node(Some(row), node);
        }
    }

    let rib = scene.add_mesh("rib", rib());
    let ribs = scene.add_node(None, Node::new("ribs"));
    for index in 1..BAYS {
        let x = BAY * index as f64 - HALF_LENGTH;
        scene.add_node(Some(ribs), Node::new(format!("rib {index}")).mesh(rib).at(DVec3::new(x, 0.0, 0.0)));
    }
    scene.to_bytes()
}

/// Height of the vault's inner face over `z`; beyond the walls it stays at the springing.
fn vault(z: f64) -> f64 {
    let radius = (HALF_WIDTH * HALF_WIDTH + VAULT_RISE * VAULT_RISE) / (2.0 * VAULT_RISE);
    let z = z.abs().min(HALF_WIDTH);
    VAULT_SPRING + VAULT_RISE - radius + (radius * radius - z * z).sqrt()
}

/// Height of a pointed (equilateral) arch of this span above its springing, `x` from its left foot.
fn pointed_arch(x: f64, span: f64) -> f64 {
    let from_far_foot = x.max(span - x).clamp(0.0, span);
    (span * span - from_far_foot * from_far_foot).max(0.0).sqrt()
}

/// Floor, walls, windows and vault in one closed solid.
fn shell() -> Mesh {
    // Grid lines along the hall; each lancet remembers its first line.
    let mut xs = vec![-HALF_LENGTH - WALL, -HALF_LENGTH];
    let mut lancets = Vec::new();
    for bay in 0..BAYS {
        let centre = BAY * (bay as f64 + 0.5) - HALF_LENGTH;
        for left in [centre - MULLION / 2.0 - LANCET, centre + MULLION / 2.0] {
            lancets.push(xs.len());
            xs.extend((0..=LANCET_CELLS).map(|i| left + LANCET * i as f64 / LANCET_CELLS as f64));
        }
    }
    xs.extend([HALF_LENGTH, HALF_LENGTH + WALL]);
    let mut zs = vec![-HALF_WIDTH - WALL];
    zs.extend((0..=VAULT_CELLS).map(|i| HALF_WIDTH * (2.0 * i as f64 / VAULT_CELLS as f64 - 1.0)));
    zs.push(HALF_WIDTH + WALL);

    let (x_cells, z_cells) = (xs.len() - 1, zs.len() - 1);
    // Layers upwards: floor slab, to the sill, the windows, to the vault, the vault's shell.
    let solid = |[i, j, k]: [usize; 3]| {
        let in_wall = i == 0 || i == x_cells - 1 || k == 0 || k == z_cells - 1;
        let in_lancet = lancets.iter().any(|&first| (first..first + LANCET_CELLS).contains(&i));
        let in_window = j == 2 && k == z_cells - 1 && in_lancet;
        j == 0 || j == 4 || (in_wall && !in_window)
    };
    let position = |[i, j, k]: [usize; 3]| {
        let (x, z) = (xs[i], zs[k]);
        let arch = lancets
            .iter()
            .find(|&&first| (first..=first + LANCET_CELLS).contains(&i))
            .map_or(0.0, |&first| pointed_arch(x - xs[first], LANCET));
        let y = match j {
            0 => -0.5,
            1 => 0.0,
            2 => SILL,
            3 => WINDOW_SPRING + arch,
            4 => vault(z),
            _ => vault(z) + 0.5,
        };
        DVec3::new(x, y, z)
    };
    let mut mesh = Mesh::default();
    Blocks::new([x_cells, 5, z_cells]).add_to(&mut mesh, solid, position);
    mesh
}

/// The wall over one row of columns, with an arch between each two; its ends stand in the end walls.
fn arcade_wall() -> Mesh {
    let pier = 0.9;
    let span = BAY - pier;
    let mut xs = vec![-HALF_LENGTH - WALL / 2.0];
    let mut arches = Vec::new();
    for bay in 0..BAYS {
        let left = BAY * bay as f64 - HALF_LENGTH + pier / 2.0;
        arches.push(xs.len());
        xs.extend((0..=ARCH_CELLS).map(|i| left + span * i as f64 / ARCH_CELLS as f64));
    }
    xs.push(HALF_LENGTH + WALL / 2.0);
    let top = vault(COLUMN_ROW) + 0.25;
    let solid = |[i, j, _]: [usize; 3]| j == 1 || !arches.iter().any(|&a| (a..a + ARCH_CELLS).contains(&i));
    let position = |[i, j, k]: [usize; 3]| {
        let x = xs[i];
        let y = match j {
            0 => COLUMN_HEIGHT - 0.1,
            1 => arches
                .iter()
                .find(|&&a| (a..=a + ARCH_CELLS).contains(&i))
                .map_or(COLUMN_HEIGHT, |&a| COLUMN_HEIGHT + 0.7 * pointed_arch(x - xs[a], span)),
            _ => top,
        };
        DVec3::new(x, y, if k == 0 { -0.3 } else { 0.3 })
    };
    let mut mesh = Mesh::default();
    Blocks::new([xs.len() - 1, 2, 1]).add_to(&mut mesh, solid, position);
    mesh
}

/// A column of height 1 (its node stretches it), sunk a little into the floor.
fn column() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.62, -0.02),
        (0.62, 0.03),
        (0.52, 0.04),
        (0.55, 0.055),
        (0.42, 0.075),
        (0.38, 0.86),
        (0.42, 0.875),
        (0.40, 0.89),
        (0.55, 0.95),
        (0.62, 0.96),
        (0.62, 1.0),
    ];
    mesh.add_lathe(DVec3::ZERO, &profile, 24);
    mesh
}

/// A transverse arch under the vault, across the hall; its feet stand in the walls.
fn rib() -> Mesh {
    let position = |[i, j, k]: [usize; 3]| {
        let reach = HALF_WIDTH + WALL / 2.0;
        let z = reach * (2.0 * k as f64 / VAULT_CELLS as f64 - 1.0);
        let y = vault(z) + if j == 0 { -0.35 } else { 0.1 };
        DVec3::new(if i == 0 { -0.25 } else { 0.25 }, y, z)
    };
    let mut mesh = Mesh::default();
    Blocks::new([1, 1, VAULT_CELLS]).add_to(&mut mesh, |_| true, position);
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn every_part_is_closed_and_faces_outwards() {
        for (name, mesh) in
            [("shell", shell()), ("arcade", arcade_wall()), ("column", column()), ("rib", rib())]
        {
            assert_closed(&mesh);
            assert!(volume(&mesh) > 0.0, "{name} is inside out");
        }
    }

    #[test]
    fn a_pointed_arch_is_as_high_as_an_equilateral_triangle() {
        assert_eq!((pointed_arch(0.0, 2.0), pointed_arch(2.0, 2.0)), (0.0, 0.0));
        assert!((pointed_arch(1.0, 2.0) - 3.0_f64.sqrt()).abs() < 1e-15);
    }
}
