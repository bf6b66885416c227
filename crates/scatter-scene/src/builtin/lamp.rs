//! `lamp`: a lamp in a pierced brass globe, hung in a small room; its light leaves in narrow beams to all sides.
//!
//! An OBJ scene. The globe is a grid of cells in height, angle and radius with holes cut out; the room and the
//! furniture are boxes.

use super::blocks::Blocks;
use super::mesh::Mesh;
use super::obj_writer::obj_text;
use super::random::sin_cos_turns;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "lamp",
    shows: "beams from a lamp in a pierced globe to all sides: a point light in view, cube shadow maps, \
            an inverse-square law, and transitions that crowd around the lamp",
    shot_text: r#"# A lamp in a pierced globe: beams to all sides.
mesh = "lamp.obj"

[camera]
eye = [-3.1, 1.5, 2.6]
target = [0.15, 1.75, -0.1]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [640, 480]
max_distance = 30.0

[light]
kind = "point"
position = [0.0, 2.0, 0.0]
intensity = [60.0, 46.0, 28.0]

[medium]
scattering = [0.1, 0.1, 0.1]
absorption = [0.02, 0.02, 0.02]
phase = "henyey-greenstein"
g = 0.2
"#,
    mesh_extension: "obj",
    mesh_bytes,
    others: &[],
};

/// Centre of the globe: the lamp's place in the shot file \[m\].
const CENTRE: DVec3 = DVec3::new(0.0, 2.0, 0.0);
/// Radius and thickness of the globe's shell \[m\].
const RADIUS: f64 = 0.3;
const SHELL: f64 = 0.015;
/// Cells around the globe and from pole to pole.
const AROUND: usize = 80;
const UP: usize = 48;

fn mesh_bytes() -> Vec<u8> {
    obj_text(
        "Scatter's built-in shot: a lamp in a pierced globe",
        &[("room", &room()), ("globe", &globe()), ("cord", &cord()), ("furniture", &furniture())],
    )
    .into_bytes()
}

/// Whether the globe has a hole at this cell: rows of holes between ribs, staggered, none at the poles.
fn is_hole(around: usize, up: usize) -> bool {
    let row = match up {
        7..=9 => 0,
        14..=16 => 1,
        22..=25 => 2,
        31..=33 => 3,
        38..=40 => 4,
        _ => return false,
    };
    // Ten holes a row, narrower than what is between them; every second row is shifted by half.
    (around + 4 * (row % 2)) % 8 < 3
}

/// The pierced globe: axes of its cells are angle, height, radius.
fn globe() -> Mesh {
    let position = |[around, up, outwards]: [usize; 3]| {
        let (sine, cosine) = sin_cos_turns(around as f64 / AROUND as f64);
        let (height, ring) = match up {
            // Exactly one vertex at each pole, whatever the angle.
            0 => (-1.0, 0.0),
            UP => (1.0, 0.0),
            _ => {
                let (ring, height) = sin_cos_turns(0.5 - 0.5 * up as f64 / UP as f64);
                (height, ring)
            }
        };
        let radius = RADIUS + SHELL * outwards as f64;
        CENTRE + radius * DVec3::new(ring * cosine, height, -ring * sine)
    };
    let mut mesh = Mesh::default();
    Blocks::new([AROUND, UP, 1]).wrapping(0).add_to(
        &mut mesh,
        |[around, up, _]| !is_hole(around, up),
        position,
    );
    mesh
}

/// A closed room, 8 m × 3.6 m × 6.5 m.
fn room() -> Mesh {
    let xs = [-4.2, -4.0, 4.0, 4.2];
    let ys = [-0.2, 0.0, 3.6, 3.8];
    let zs = [-3.2, -3.0, 3.5, 3.7];
    let mut mesh = Mesh::default();
    Blocks::new([3, 3, 3]).add_to(
        &mut mesh,
        |cell| cell != [1, 1, 1],
        |[i, j, k]| DVec3::new(xs[i], ys[j], zs[k]),
    );
    mesh
}

/// What the globe hangs from.
fn cord() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_lathe(DVec3::new(0.0, CENTRE.y + RADIUS, 0.0), &[(0.012, 0.0), (0.012, 1.4)], 8);
    mesh
}

/// A table with a jug and a bench: things that the beams fall on.
fn furniture() -> Mesh {
    let mut mesh = Mesh::default();
    for x in [-0.7, 0.65] {
        for z in [-0.45, 0.4] {
            mesh.add_box(DVec3::new(x, -0.05, z), DVec3::new(x + 0.06, 0.73, z + 0.06));
        }
    }
    mesh.add_box(DVec3::new(-0.8, 0.72, -0.55), DVec3::new(0.8, 0.77, 0.55));
    mesh.add_lathe(
        DVec3::new(0.35, 0.76, 0.1),
        &[(0.06, 0.0), (0.11, 0.08), (0.1, 0.16), (0.05, 0.24), (0.07, 0.3)],
        20,
    );
    mesh.add_box(DVec3::new(1.6, -0.05, -1.6), DVec3::new(1.75, 0.42, 0.9));
    mesh.add_box(DVec3::new(1.5, 0.41, -1.7), DVec3::new(1.9, 0.47, 1.0));
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn every_part_is_closed() {
        for mesh in [room(), globe(), cord(), furniture()] {
            assert_closed(&mesh);
            assert!(volume(&mesh) > 0.0, "inside out");
        }
    }

    #[test]
    fn the_globe_has_fifty_holes_with_solid_cells_between_them() {
        let holes = (0..UP).flat_map(|up| (0..AROUND).map(move |around| is_hole(around, up)));
        // Four rows of 3 × 3 cells and one of 4 × 3, ten holes each.
        assert_eq!(holes.filter(|&hole| hole).count(), 10 * 3 * (3 + 3 + 4 + 3 + 3));
    }
}
