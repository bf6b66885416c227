//! The view rays of a camera in the space of a map: affine functions of the pixel's place, in f64.
//!
//! Rays of a perspective camera are parametrised by the depth along the camera's axis instead of the way along the ray: then
//! directions are linear in the pixel's coordinates, in the world and in the homogeneous space of every map. Those of a
//! parallel camera, square to its image or oblique, are parametrised by the way along them, and their starts are linear.

use glam::DVec3;

use crate::camera::{Camera, Projection, Window};
use crate::map_projection::MapProjection;

/// A vector that is affine in the pixel's column and row: constant, a column's, a row's.
pub type AffineInPixel = [DVec3; 3];

/// All view rays of a camera: `origin + s·direction` \[world units\], relative to the eye, s the depth along the axis of a
/// perspective camera and the way along the rays of a parallel one.
#[derive(Debug, Clone, Copy)]
pub struct RayFan {
    eye: DVec3,
    origin: AffineInPixel,
    direction: AffineInPixel,
    perspective: bool,
    /// Where a pixel's centre lies in the camera's window: the first one, and a step of columns and of rows.
    place: [[f64; 2]; 3],
}

/// The rays of a [`RayFan`] in the space of one map: `[u, v, depth]` is `start + s·step`, in texels and in the map's depth;
/// under a perspective map u and v are to be divided by depth.
#[derive(Debug, Clone, Copy)]
pub struct MapFan {
    /// At s = 0.
    pub start: AffineInPixel,
    /// A unit of s.
    pub step: AffineInPixel,
    /// Whether the map is a perspective one.
    pub perspective: bool,
    /// Columns and rows of the map.
    pub size: [f64; 2],
    /// Whether all rays start at one point, the eye.
    pub one_start: bool,
}

impl RayFan {
    /// Of a camera.
    pub fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size().map(f64::from);
        let Window { left, right, bottom, top } = camera.window();
        let first = camera.window_from_image(0.5, 0.5);
        let place =
            [first, [(right - left) / width, 0.0], [camera.shear() / height, (bottom - top) / height]];
        let [offset, columns, rows] = place.map(|[u, v]| camera.right() * u + camera.up() * v);
        let (origin, direction) = match camera.parallel_direction() {
            None => ([DVec3::ZERO; 3], [camera.forward() + offset, columns, rows]),
            Some(travel) => ([offset, columns, rows], [travel, DVec3::ZERO, DVec3::ZERO]),
        };
        let perspective = camera.projection() == Projection::Perspective;
        Self { eye: camera.eye(), origin, direction, perspective, place }
    }

    /// Where the rays start, relative to the eye.
    pub fn origin(&self) -> &AffineInPixel {
        &self.origin
    }

    /// A unit of s along the rays.
    pub fn direction(&self) -> &AffineInPixel {
        &self.direction
    }

    /// The rays in the space of a map.
    pub fn in_map(&self, map: &MapProjection) -> MapFan {
        let linear = |v: DVec3| map.ray(self.eye, DVec3::ZERO, v).step;
        let [first, columns, rows] = self.origin;
        MapFan {
            start: [map.ray(self.eye, first, DVec3::ZERO).start, linear(columns), linear(rows)],
            step: self.direction.map(linear),
            perspective: map.is_perspective(),
            size: map.size().map(f64::from),
            one_start: self.perspective,
        }
    }

    /// Whether s is the depth along a perspective camera's axis; else it is the way along the rays.
    #[inline(always)]
    pub fn is_perspective(&self) -> bool {
        self.perspective
    }

    /// How long a unit of s is on the ray of a pixel \[world units\].
    #[inline(always)]
    pub fn stretch(&self, [x, y]: [u32; 2]) -> f64 {
        if !self.perspective {
            return 1.0;
        }
        let (column, row) = (f64::from(x), f64::from(y));
        let [first, step, row_step] = self.place;
        let u = first[0] + step[0] * column + row_step[0] * row;
        let v = first[1] + row_step[1] * row;
        (1.0 + u * u + v * v).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the camera's own rays and the map's own: two ways of their own to the same point.
    #[test]
    fn a_pixels_ray_in_a_map_is_the_maps_ray_of_the_pixel() {
        let eye = [1.0, 2.0, 3.0];
        let (target, up) = ([2.0, 1.5, -1.0], [0.0, 1.0, 0.0]);
        let size = [7, 5];
        let cameras = [
            Camera::perspective(eye, target, up, 75.0, size).unwrap(),
            Camera::orthographic(eye, target, up, 4.0, size).unwrap(),
        ];
        let map =
            MapProjection::orthographic([0.0; 3], [0.3, -1.0, 0.2], [0.0, 0.0, 1.0], [6.0; 2], [33, 21])
                .unwrap();
        let mut worst = 0.0f64;
        for camera in &cameras {
            let rays = RayFan::new(camera);
            let fan = rays.in_map(&map);
            for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                let own = camera.pixel_ray(x, y);
                let expected = map.ray(camera.eye(), own.origin, own.direction);
                let at =
                    |affine: &AffineInPixel| affine[0] + affine[1] * f64::from(x) + affine[2] * f64::from(y);
                let s = 2.5;
                let found = at(&fan.start) + at(&fan.step) * s;
                let expected = expected.start + expected.step * (s * rays.stretch([x, y]));
                worst = worst.max((found - expected).abs().max_element());
            }
        }
        println!("off by {worst:.1e} texels at the most");
        // Sums of three terms of up to 1e2 in f64.
        assert!(worst < 1e-12, "{worst:e}");
    }
}
