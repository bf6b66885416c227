//! `valley`: mountains on both sides of a valley, two and a half kilometres of air, a low sun behind the ridge.
//!
//! One sheet of 1.1 million triangles with 32-bit indices; the cells are 3.5 m wide.

use super::glb_writer::GlbScene;
use super::shot::BuiltinShot;
use super::terrain::{ease, ridged_noise, sheet, smooth_noise};

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "valley",
    shows: "terrain of over a million triangles under a low sun: long rays with few transitions, shadows kilometres \
            long, and a shadow map that must cover a large range",
    shot_text: r#"# A mountain valley under a low sun, kilometres of air.
mesh = "valley.glb"

[camera]
eye = [120.0, 150.0, 1150.0]
target = [20.0, 140.0, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 50.0
resolution = [640, 480]
max_distance = 3000.0

[light]
kind = "directional"
direction = [0.6, -0.2, 0.5]
irradiance = [10.0, 8.0, 6.0]

[medium]
scattering = [0.0005, 0.0005, 0.0005]
absorption = [0.00005, 0.00005, 0.00005]
phase = "henyey-greenstein"
g = 0.4
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Half the sheet's side \[m\], and its cells a side.
const HALF_SIDE: f64 = 1300.0;
const CELLS: usize = 742;

fn mesh_bytes() -> Vec<u8> {
    terrain_bytes(CELLS)
}

/// The valley as a GLB file, with that many cells a side.
pub(super) fn terrain_bytes(cells: usize) -> Vec<u8> {
    let mut scene = GlbScene::default();
    let side = [HALF_SIDE, HALF_SIDE];
    scene.add_mesh_node("terrain", sheet(side.map(|half| -half), side, [cells; 2], height));
    scene.to_bytes()
}

/// Height of the land \[m\]: a winding valley floor between ridges with sharp, uneven crests.
fn height(x: f64, z: f64) -> f64 {
    let winding = 110.0 * smooth_noise(0.3, z / 700.0, 11);
    let from_axis = (x - winding).abs();
    let slope = ease((from_axis - 90.0) / 620.0);
    let mountains = ridged_noise(x / 420.0, z / 420.0, 7, 20);
    let crest = 120.0 + 430.0 * mountains * mountains;
    // The valley's head closes the view.
    let head = ease((-z - 700.0) / 700.0);
    let floor = 10.0 * smooth_noise(x / 130.0, z / 130.0, 40) + 3.0 * smooth_noise(x / 31.0, z / 31.0, 41);
    floor + slope.max(0.8 * head) * crest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terrain_has_over_a_million_triangles() {
        const { assert!(2 * CELLS * CELLS > 1_000_000) };
    }

    #[test]
    fn the_eye_is_above_the_land() {
        assert!(height(120.0, 1150.0) < 140.0, "{}", height(120.0, 1150.0));
    }
}
