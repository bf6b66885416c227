//! A pixel's ray in the space of a map, and what of it lies inside of the map.

use glam::DVec3;
use scatter_core::{AffineInPixel, MapFan};

/// A pixel's ray in a map's space.
#[derive(Debug, Clone, Copy)]
pub struct MapPath {
    /// `[u, v, depth]` at s = 0.
    pub start: DVec3,
    /// A unit of s.
    pub step: DVec3,
}

/// The rays of a [`MapFan`], one by one.
pub trait MapRays {
    /// The ray of a pixel.
    fn path(&self, place: [u32; 2]) -> MapPath;

    /// The part of `[from, to]` of a ray that lies inside of the map's rectangle, and before the centre of a perspective
    /// map: one stretch, since the region is convex; `from ≥ to` where there is none.
    fn clip(&self, path: &MapPath, part: [f64; 2]) -> [f64; 2];
}

impl MapRays for MapFan {
    #[inline(always)]
    fn path(&self, [x, y]: [u32; 2]) -> MapPath {
        let at = |affine: &AffineInPixel| affine[0] + (affine[1] * f64::from(x) + affine[2] * f64::from(y));
        MapPath { start: at(&self.start), step: at(&self.step) }
    }

    #[inline(always)]
    fn clip(&self, path: &MapPath, [mut from, mut to]: [f64; 2]) -> [f64; 2] {
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
