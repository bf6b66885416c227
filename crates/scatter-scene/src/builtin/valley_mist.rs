//! `valley-mist`: the valley of `valley` with mist on its floor, as height fog.

use super::shot::BuiltinShot;
use super::valley::terrain_bytes;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "valley-mist",
    shows: "the valley with mist on its floor: height fog that is fifty times denser there than at the eye, so that \
            rays downwards gather most of their light in their last stretch, and rays over the ridge nearly none",
    shot_text: r#"# Mist on a mountain valley's floor under a low sun.
mesh = "valley-mist.glb"

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
scattering = [0.006, 0.006, 0.006]
absorption = [0.0003, 0.0003, 0.0003]
phase = "henyey-greenstein"
g = 0.4

[medium.height_falloff]
base_height = 0.0
scale_height = 38.0
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Cells a side: 10 m wide. What there is to see is the fog; the terrain of over a million triangles is `valley`'s.
const CELLS: usize = 260;

fn mesh_bytes() -> Vec<u8> {
    terrain_bytes(CELLS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mist_lies_on_the_floor() {
        // ln 50 scale heights from the floor to the eye.
        let eye = 150.0 / 38.0;
        assert!((f64::exp(eye) / 50.0 - 1.0).abs() < 0.05);
        // A ray that falls by 150 over 1000 passes an optical depth of about one, and is not opaque.
        let depth = 0.0063 * 38.0 * (1.0 - f64::exp(-eye)) * (1.0f64 + (1000.0f64 / 150.0).powi(2)).sqrt();
        assert!((1.0..2.0).contains(&depth), "{depth}");
        assert!(SHOT.shot_text.contains("scale_height = 38.0"));
    }
}
