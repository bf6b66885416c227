//! The matrices of a right-handed engine with z in [0, 1], written out for tests.

use glam::{DMat4, DVec3, DVec4};

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
