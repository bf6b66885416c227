//! `stage`: a spot shines down through a grille onto a stage with a figure and steps.
//!
//! A closed house, 14 m × 7.5 m × 14 m. The grille is one closed lattice; columns and steps are instances.

use super::blocks::Blocks;
use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "stage",
    shows: "a spot through a grille: a perspective shadow map, a fan of thin shafts with smooth edges to the cone, and \
            an inverse-square law",
    shot_text: r#"# A spot through a grille over a stage.
mesh = "stage.glb"

[camera]
eye = [1.6, 1.9, 6.6]
target = [-0.2, 2.9, -1.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 52.0
resolution = [640, 480]
max_distance = 40.0

[light]
kind = "spot"
position = [-2.4, 6.9, 0.0]
direction = [0.42, -1.0, -0.18]
intensity = [220.0, 190.0, 150.0]
inner_cone_degrees = 24.0
outer_cone_degrees = 30.0

[medium]
scattering = [0.07, 0.07, 0.07]
absorption = [0.01, 0.01, 0.01]
phase = "henyey-greenstein"
g = 0.3
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// The grille: bars and gaps a side, their widths, height of the bars and of their lower faces \[m\].
const GRILLE_BARS: usize = 13;
const BAR: f64 = 0.06;
const GAP: f64 = 0.14;
const BAR_HEIGHT: f64 = 0.05;
const GRILLE_AT: DVec3 = DVec3::new(-1.9, 5.6, -0.22);

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.add_mesh_node("house", house());
    let grille = scene.add_mesh("grille", grille());
    scene.add_node(None, Node::new("grille").mesh(grille).at(GRILLE_AT));

    let stage = scene.add_node(None, Node::new("stage").at(DVec3::new(0.0, 0.0, -2.0)));
    let mut floor = Mesh::default();
    floor.add_box(DVec3::new(-6.0, -0.1, -4.0), DVec3::new(6.0, 0.7, 3.2));
    let floor = scene.add_mesh("floor", floor);
    scene.add_node(Some(stage), Node::new("floor").mesh(floor));

    let mut step = Mesh::default();
    step.add_box(DVec3::new(-1.4, -0.05, -1.4), DVec3::new(1.4, 0.22, 1.4));
    let step = scene.add_mesh("step", step);
    let steps = scene.add_node(Some(stage), Node::new("steps").at(DVec3::new(0.4, 0.7, 0.6)));
    for index in 0..3 {
        let size = 1.0 - 0.25 * f64::from(index);
        let node = Node::new(format!("step {index}"))
            .mesh(step)
            .at(DVec3::new(0.0, 0.22 * f64::from(index), 0.0))
            .turned(0.125)
            .scaled(DVec3::new(size, 1.0, size));
        scene.add_node(Some(steps), node);
    }
    let figure = scene.add_mesh("figure", figure());
    scene.add_node(Some(steps), Node::new("figure").mesh(figure).at(DVec3::new(0.0, 0.66, 0.0)));

    let column = scene.add_mesh("column", column());
    let columns = scene.add_node(Some(stage), Node::new("columns").at(DVec3::new(0.0, 0.7, -2.6)));
    for (index, x) in [-4.6, -2.8, 2.8, 4.6].into_iter().enumerate() {
        let node = Node::new(format!("column {index}")).mesh(column).at(DVec3::new(x, 0.0, 0.0));
        scene.add_node(Some(columns), node);
    }
    scene.to_bytes()
}

/// Walls, floor and ceiling around the inside, in one closed solid.
fn house() -> Mesh {
    let xs = [-7.3, -7.0, 7.0, 7.3];
    let ys = [-0.3, 0.0, 7.5, 7.8];
    let zs = [-6.3, -6.0, 8.0, 8.3];
    let mut mesh = Mesh::default();
    Blocks::new([3, 3, 3]).add_to(
        &mut mesh,
        |cell| cell != [1, 1, 1],
        |[i, j, k]| DVec3::new(xs[i], ys[j], zs[k]),
    );
    mesh
}

/// A lattice of bars about the origin: every second row and column of cells is a bar.
fn grille() -> Mesh {
    let line = |index: usize| {
        let (pairs, odd) = (index / 2, index % 2);
        let side = GRILLE_BARS as f64 * (BAR + GAP) - GAP;
        pairs as f64 * (BAR + GAP) + if odd == 1 { BAR } else { 0.0 } - side / 2.0
    };
    let cells = 2 * GRILLE_BARS - 1;
    let mut mesh = Mesh::default();
    Blocks::new([cells, 1, cells]).add_to(
        &mut mesh,
        |[i, _, k]| i % 2 == 0 || k % 2 == 0,
        |[i, j, k]| DVec3::new(line(i), BAR_HEIGHT * j as f64, line(k)),
    );
    mesh
}

/// A figure on the steps, as a turner would make it.
fn figure() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.42, -0.02),
        (0.36, 0.1),
        (0.24, 0.55),
        (0.17, 0.95),
        (0.25, 1.3),
        (0.27, 1.42),
        (0.09, 1.52),
        (0.08, 1.58),
        (0.14, 1.66),
        (0.16, 1.76),
        (0.13, 1.87),
        (0.04, 1.94),
    ];
    mesh.add_lathe(DVec3::ZERO, &profile, 28);
    mesh
}

/// A plain column behind the stage.
fn column() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_lathe(
        DVec3::ZERO,
        &[(0.4, -0.05), (0.4, 0.2), (0.3, 0.3), (0.27, 4.2), (0.42, 4.5), (0.42, 4.7)],
        24,
    );
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn every_part_is_closed_and_faces_outwards() {
        for mesh in [house(), grille(), figure(), column()] {
            assert_closed(&mesh);
            assert!(volume(&mesh) > 0.0, "inside out");
        }
    }
}
