//! The matrices of a right-handed engine with z in [0, 1], written out for tests.

use glam::{DMat4, DVec3, DVec4};

use crate::camera::Camera;

/// World to view, looking along `forward` (view −z).
pub fn look_to(eye: DVec3, forward: DVec3, up: DVec3) -> DMat4 {
    let back = -forward.normalize();
    let right = up.cross(back).normalize();
    let up = back.cross(right);
    let row = |axis: DVec3| axis.extend(-axis.dot(eye));
    DMat4::from_cols(row(right), row(up), row(back), DVec4::W).transpose()
}

/// Reversed z with an infinite far plane.
pub fn perspective_infinite_reversed(vertical_fov: f64, aspect: f64, near: f64) -> DMat4 {
    let focal = 1.0 / (0.5 * vertical_fov).tan();
    DMat4::from_cols(
        DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, near, 0.0),
    )
}

/// A box of ± half extents, forward z from 0 to `far`.
pub fn orthographic(half: [f64; 2], far: f64) -> DMat4 {
    DMat4::from_diagonal(DVec4::new(1.0 / half[0], 1.0 / half[1], -1.0 / far, 1.0))
}

/// A perspective whose image is sheared.
pub fn sheared_camera(size: [u32; 2]) -> Camera {
    let mut clip = perspective_infinite_reversed(1.2, 1.5, 0.1);
    (clip.x_axis.y, clip.y_axis.x, clip.z_axis.x) = (0.3, -0.2, 0.1);
    camera(clip, size)
}

/// Parallel rays at an angle to the view direction.
pub fn oblique_camera(size: [u32; 2]) -> Camera {
    let mut clip = orthographic([3.0, 2.0], 10.0);
    (clip.z_axis.x, clip.z_axis.y, clip.y_axis.x) = (0.2, -0.1, 0.05);
    camera(clip, size)
}

fn camera(clip: DMat4, size: [u32; 2]) -> Camera {
    let view = look_to(DVec3::new(1e3, -2.0, 3.0), DVec3::new(0.4, 0.3, -0.9), DVec3::new(0.1, 1.0, 0.0));
    Camera::from_matrices(view.to_cols_array_2d(), clip.to_cols_array_2d(), size).expect("sane matrices")
}
