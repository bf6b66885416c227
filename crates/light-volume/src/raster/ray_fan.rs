//! View rays in the space of a map: two affine functions of the pixel's place, in f64.
//!
//! Rays of a perspective camera are parametrised by the depth along the camera's axis instead of the way along the ray: then
//! directions are linear in the pixel's coordinates, in the world and in the homogeneous space of every map. Those of a
//! parallel camera are parametrised by the way along them, and their starts are linear.

use glam::DVec3;
use scatter_core::{Camera, MapProjection, Projection, Window};

/// A vector that is affine in the pixel's column and row: constant, a column's, a row's.
type Affine = [DVec3; 3];

/// All view rays of a camera: `origin + z·direction` \[world units\], relative to the eye.
#[derive(Debug, Clone, Copy)]
pub struct RayFan {
    eye: DVec3,
    origin: Affine,
    direction: Affine,
    perspective: bool,
    /// Where a pixel's centre lies in the camera's window: the first one, and a step of columns and of rows.
    place: [[f64; 2]; 3],
}

/// The rays of a [`RayFan`] in the space of one map: `[u, v, depth]` is `start + z·step`.
#[derive(Debug, Clone, Copy)]
pub struct MapFan {
    start: Affine,
    step: Affine,
    /// Whether u and v are to be divided by depth.
    pub perspective: bool,
    /// Columns and rows of the map.
    pub size: [f64; 2],
    /// Whether all rays start at one point.
    pub one_start: bool,
}

/// A pixel's ray in a map's space.
#[derive(Debug, Clone, Copy)]
pub struct MapPath {
    /// `[u, v, depth]` at z = 0.
    pub start: DVec3,
    /// A unit of z.
    pub step: DVec3,
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

    /// How long a unit of z is on the ray of a pixel \[world units\].
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

impl MapFan {
    /// The ray of a pixel.
    #[inline(always)]
    pub fn path(&self, [x, y]: [u32; 2]) -> MapPath {
        let at = |affine: &Affine| affine[0] + (affine[1] * f64::from(x) + affine[2] * f64::from(y));
        MapPath { start: at(&self.start), step: at(&self.step) }
    }

    /// The part of `[from, to]` of a ray that lies inside of the map's rectangle, and before the centre of a perspective
    /// map: one stretch, since the region is convex; `from ≥ to` where there is none.
    #[inline(always)]
    pub fn clip(&self, path: &MapPath, [mut from, mut to]: [f64; 2]) -> [f64; 2] {
        let (p, d) = (path.start, path.step);
        let (w, dw) = if self.perspective { (p.z, d.z) } else { (1.0, 0.0) };
        let [width, height] = self.size;
        let mut clip = |value: f64, slope: f64, open: bool| {
            let crossing = -value / slope;
            if slope > 0.0 {
                from = from.max(crossing);
            } else if slope < 0.0 {
                to = to.min(crossing);
            } else if value < 0.0 || (open && value <= 0.0) {
                to = f64::NEG_INFINITY;
            }
        };
        clip(p.x, d.x, false);
        clip(width * w - p.x, width * dw - d.x, true);
        clip(p.y, d.y, false);
        clip(height * w - p.y, height * dw - d.y, true);
        if self.perspective {
            clip(w, dw, true);
        }
        [from, to]
    }
}
