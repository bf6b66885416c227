//! The epipole: where the image shows the light, or the point opposite to it (Baran et al. 2010, Section 3).
//!
//! All planes through the eye along the light's direction (sun), or through the eye and the lamp, meet in one line,
//! the axis. Its image is the epipole, from which all shafts seem to come. A sun behind the camera has its
//! **anti-epipole** in the image: shafts run towards it. Image points are homogeneous, so that an epipole 10⁶ pixels
//! outside, or at infinity (the light parallel to the image plane), is no special case.

use glam::{DVec2, DVec3};
use scatter_core::{Camera, Light, Window};

/// The axis of the epipolar planes and its image (Baran et al. 2010, Section 3): all half-planes of slices begin in it.
///
/// Homogeneous, in f64: an epipole 10⁶ pixels outside of the image, or at infinity, is no special case. O(1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epipole {
    /// Homogeneous image point `(x·w, y·w, w)` in pixels, w ≥ 0; w = 0 at infinity.
    pub image: DVec3,
    /// Unit vector from the eye towards the light (a sun: against its travel).
    pub to_light: DVec3,
    /// Whether light travels away from the epipole across the image: the light is before the camera. Else the image
    /// point is the anti-epipole, and light travels towards it.
    pub outward: bool,
    /// Distance from it \[pixels, along the image's axes\] below which slices do not tell view rays from the axis: such
    /// pixels lie in no gap between slices, and are walked.
    pub too_near: f64,
}

/// Largest 1/sin β that is told apart: 0.01 pixel from the epipole at 160 pixels a degree. A larger value makes more
/// bands around the epipole; a smaller one walks more pixels there.
pub const STEEPEST: f64 = 1_000_000.0;

/// Least [`Epipole::too_near`]. The column at which a slice's light ray ends is an f32 number of up to 8,192 with an error of a
/// few units in its last place, and along a view ray at a distance of δ columns from the epipole that error counts 1/δ
/// times: at 1,280 columns 1e-4/δ. Twice as small, and the nearest pixel is off by up to a percent; twice as large, and
/// every eighth image walks a pixel that needs it not.
const NEAREST_COLUMN: f64 = 1.0 / 32.0;

impl Epipole {
    /// Of a perspective camera and a light.
    pub fn new(camera: &Camera, light: &Light) -> Self {
        let to_light = match light {
            Light::Directional(sun) => -sun.direction(),
            Light::Point(_) | Light::Spot(_) => {
                let lamp = light.position().unwrap_or_default();
                (lamp - camera.eye()).normalize()
            }
        };
        let outward = to_light.dot(camera.forward()) >= 0.0;
        let seen = if outward { to_light } else { -to_light };
        let mut image = camera.image_from_direction(seen);
        image.z = image.z.max(0.0);
        let too_near = NEAREST_COLUMN.max(steepest_pixels(camera, seen));
        Self { image, to_light, outward, too_near }
    }

    /// Whether the image point at `offset` from the epipole ([`Self::towards`] it) is [too near](Self::too_near).
    pub fn is_too_near(&self, offset: DVec2) -> bool {
        // At the epipole itself both sides are 0, and at infinity nothing is near.
        offset.abs().max_element() <= self.too_near * self.image.z
    }

    /// Direction in the image from the epipole to the image point `p` (any length; zero at the epipole itself).
    pub fn towards(&self, p: DVec2) -> DVec2 {
        p * self.image.z - self.image.truncate()
    }
}

/// Pixels from the axis on within which a view ray's sine may be below 1/[`STEEPEST`].
fn steepest_pixels(camera: &Camera, seen: DVec3) -> f64 {
    let Window { left, right, bottom, top } = camera.window();
    let [width, height] = camera.size().map(f64::from);
    let step = ((right - left).abs() / width).min((top - bottom).abs() / height);
    // Directions of lengths a and b (1 along the view direction) whose tangents differ by δ have a sine of δ/(a·b) at the least.
    let longest =
        DVec3::new(left.abs().max(right.abs()) + camera.shear().abs(), bottom.abs().max(top.abs()), 1.0)
            .length();
    let depth = seen.dot(camera.forward());
    if depth > 0.0 { longest / (depth * STEEPEST * step) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::perspective([1.0, 2.0, 3.0], [2.0, 1.5, -4.0], [0.0, 1.0, 0.0], 60.0, [63, 41]).unwrap()
    }

    #[test]
    fn the_epipole_is_the_image_of_the_lamp() {
        let camera = camera();
        let ray = camera.ray(17.25, 8.5);
        let lamp = camera.eye() + 5.0 * ray.direction;
        let light = Light::point(lamp.to_array(), [1.0; 3], 0.0).unwrap();
        let epipole = Epipole::new(&camera, &light);
        assert!(epipole.outward);
        let p = epipole.image.truncate() / epipole.image.z;
        assert!((p - DVec2::new(17.25, 8.5)).length() < 1e-9, "{p}");
        assert!(epipole.towards(p).length() < 1e-9);
    }

    #[test]
    fn a_sun_behind_the_camera_shows_its_anti_epipole() {
        let camera = camera();
        let ray = camera.ray(40.0, 30.0);
        let sun = Light::directional(ray.direction.to_array(), [1.0; 3]).unwrap();
        let epipole = Epipole::new(&camera, &sun);
        assert!(!epipole.outward);
        let p = epipole.image.truncate() / epipole.image.z;
        assert!((p - DVec2::new(40.0, 30.0)).length() < 1e-9, "{p}");
    }

    #[test]
    fn light_parallel_to_the_image_plane_has_its_epipole_at_infinity() {
        let camera =
            Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [63, 41]).unwrap();
        let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
        let epipole = Epipole::new(&camera, &sun);
        assert_eq!(epipole.image.z, 0.0);
        // Away from the sun is down in the image.
        let down = epipole.towards(DVec2::new(3.0, 4.0));
        assert!(down.y > 0.0 && down.x.abs() < 1e-12 * down.y);
    }
}
