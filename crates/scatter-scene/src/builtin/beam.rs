//! `beam`: a narrow beam of sunlight through a hole falls on a plane; nothing else is in the picture.
//!
//! After Baran et al. 2010, figure 13: with no depth edges in the image, interpolation along epipolar lines that
//! looks for them misses the beam. The plate with the hole is above the camera and outside of the picture.

use super::blocks::Blocks;
use super::glb_writer::{GlbScene, Node};
use super::mesh::Mesh;
use super::random::sin_cos_turns;
use super::shot::BuiltinShot;
use glam::DVec3;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "beam",
    shows: "a narrow beam over a plane without a single depth edge: what places its samples at depth edges blurs or \
            loses it (Baran 2010, figure 13)",
    shot_text: r#"# A narrow beam on a plane: no depth edge in the picture.
mesh = "beam.glb"

[camera]
eye = [0.0, 4.0, 5.0]
target = [0.0, 0.6, -1.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 42.0
resolution = [640, 480]
max_distance = 100.0

[light]
kind = "directional"
direction = [0.62, -1.0, -0.1]
irradiance = [10.0, 9.0, 7.5]

[medium]
scattering = [0.06, 0.06, 0.06]
absorption = [0.01, 0.01, 0.01]
phase = "henyey-greenstein"
g = 0.3
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// The plate: height of its lower face, thickness, radius of the hole and of the plate \[m\].
const PLATE_HEIGHT: f64 = 6.0;
const PLATE_THICKNESS: f64 = 0.05;
const HOLE: f64 = 0.3;
const PLATE: f64 = 120.0;
/// Where the hole is (x, z): the beam meets the ground in front of the camera.
const HOLE_AT: DVec3 = DVec3::new(-2.7, 0.0, 1.2);
/// Flat pieces around the hole.
const AROUND: usize = 64;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    let mut plane = Mesh::default();
    let half = 60.0;
    let corners = [(-half, half), (half, half), (half, -half), (-half, -half)];
    let corners = corners.map(|(x, z)| plane.vertex(DVec3::new(x, 0.0, z)));
    plane.quad(corners);
    scene.add_mesh_node("plane", plane);
    let plate = scene.add_mesh("plate", plate());
    scene.add_node(None, Node::new("plate").mesh(plate).at(HOLE_AT + DVec3::Y * PLATE_HEIGHT));
    scene.to_bytes()
}

/// The plate around a hole at the origin: axes of its cells are angle, height, radius.
fn plate() -> Mesh {
    let mut mesh = Mesh::default();
    Blocks::new([AROUND, 1, 1]).wrapping(0).add_to(
        &mut mesh,
        |_| true,
        |[around, up, outwards]| {
            let (sine, cosine) = sin_cos_turns(around as f64 / AROUND as f64);
            let radius = if outwards == 0 { HOLE } else { PLATE };
            DVec3::new(radius * cosine, PLATE_THICKNESS * up as f64, -radius * sine)
        },
    );
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, volume};
    use super::*;

    #[test]
    fn the_plate_is_closed_and_faces_outwards() {
        assert_closed(&plate());
        assert!(volume(&plate()) > 0.0);
    }
}
