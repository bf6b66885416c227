//! Sixteen view rays in the space of a map: two affine functions of the pixel's place, in f64.
//!
//! Rays are parametrised by the depth along the camera's axis instead of the way along the ray: then directions are linear
//! in the pixel's coordinates (for a perspective camera), and so are starts (for an orthographic one), in the world and
//! in the homogeneous space of every map.

use glam::DVec3;
use scatter_core::{Camera, MapProjection, Projection, Window};

/// Rays that are set up side by side.
pub const LANES: usize = 16;

/// Columns of a group of sixteen pixels; it has two rows, so that neighbours share cache lines of the mipmap.
pub const GROUP: [u32; 2] = [8, 2];

/// A number for each ray.
pub type Wide = [f64; LANES];

/// A vector that is affine in the pixel's column and row: constant, a column's, a row's.
type Affine = [DVec3; 3];

/// All view rays of a camera: `origin + s·direction`, s the depth along the camera's axis \[world units\], relative to the
/// eye.
#[derive(Debug, Clone, Copy)]
pub struct RayFan {
    eye: DVec3,
    origin: Affine,
    direction: Affine,
    perspective: bool,
    /// Tangents (or offsets) of the first pixel's centre and of a pixel's step, of columns and rows.
    place: [[f64; 2]; 2],
}

/// The rays of a [`RayFan`] in the space of one map.
#[derive(Debug, Clone, Copy)]
pub struct MapFan {
    start: Affine,
    step: Affine,
    /// What divides u and v.
    perspective: bool,
    size: [f64; 2],
}

/// Sixteen rays in a map's space: `[u, v, depth]` is `start + s·step`.
#[derive(Debug, Clone, Copy)]
pub struct MapPaths {
    /// At s = 0.
    pub start: [Wide; 3],
    /// A unit of s.
    pub step: [Wide; 3],
}

impl RayFan {
    /// Of a camera.
    pub fn new(camera: &Camera) -> Self {
        let Window { left, right, bottom, top } = camera.window();
        let [width, height] = camera.size().map(f64::from);
        let steps = [(right - left) / width, (bottom - top) / height];
        let place = [[left + 0.5 * steps[0], steps[0]], [top + 0.5 * steps[1], steps[1]]];
        let offset = camera.right() * place[0][0] + camera.up() * place[1][0];
        let (columns, rows) = (camera.right() * steps[0], camera.up() * steps[1]);
        let perspective = camera.projection() == Projection::Perspective;
        let (origin, direction) = if perspective {
            ([DVec3::ZERO; 3], [camera.forward() + offset, columns, rows])
        } else {
            ([offset, columns, rows], [camera.forward(), DVec3::ZERO, DVec3::ZERO])
        };
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
        }
    }

    /// How long a unit of s is on the rays of the group of pixels from `(x, y)` on \[world units\].
    #[inline(always)]
    pub fn stretch(&self, [x, y]: [u32; 2]) -> Wide {
        let mut stretch = [1.0; LANES];
        if self.perspective {
            for (lane, stretch) in stretch.iter_mut().enumerate() {
                let [column, row] = place_in_group(lane);
                let u = self.place[0][0] + self.place[0][1] * f64::from(x + column);
                let v = self.place[1][0] + self.place[1][1] * f64::from(y + row);
                *stretch = (1.0 + u * u + v * v).sqrt();
            }
        }
        stretch
    }
}

/// Column and row of a lane in its group.
#[inline(always)]
pub fn place_in_group(lane: usize) -> [u32; 2] {
    [lane as u32 % GROUP[0], lane as u32 / GROUP[0]]
}

impl MapFan {
    /// The rays of the group of pixels from `(x, y)` on.
    #[inline(always)]
    pub fn paths(&self, [x, y]: [u32; 2]) -> MapPaths {
        let mut paths = MapPaths { start: [[0.0; LANES]; 3], step: [[0.0; LANES]; 3] };
        for axis in 0..3 {
            let of = |affine: &Affine| affine.map(|vector| vector[axis]);
            let (start, step) = (of(&self.start), of(&self.step));
            for lane in 0..LANES {
                let [column, row] = place_in_group(lane);
                let (column, row) = (f64::from(x + column), f64::from(y + row));
                paths.start[axis][lane] = start[0] + (start[1] * column + start[2] * row);
                paths.step[axis][lane] = step[0] + (step[1] * column + step[2] * row);
            }
        }
        paths
    }

    /// Start and step of one pixel's ray.
    pub fn path_of(&self, [x, y]: [u32; 2]) -> [DVec3; 2] {
        let at = |affine: &Affine| affine[0] + (affine[1] * f64::from(x) + affine[2] * f64::from(y));
        [at(&self.start), at(&self.step)]
    }

    /// The parts `[from, to]` of rays that lie inside of the map's rectangle, and before the centre of a perspective map:
    /// one stretch a ray, since the region is convex; `from ≥ to` where there is none.
    #[inline(always)]
    pub fn clip(&self, paths: &MapPaths, from: &mut Wide, to: &mut Wide) {
        let [u, v, depth] = [0, 1, 2].map(|axis| (&paths.start[axis], &paths.step[axis]));
        // Texel coordinates are u/w and v/w, w the depth of a perspective map and 1 of a parallel one: 0 ≤ u < width·w.
        let one = ([1.0; LANES], [0.0; LANES]);
        let divisor = if self.perspective { depth } else { (&one.0, &one.1) };
        for ((value, slope), size) in [(u, self.size[0]), (v, self.size[1])] {
            let (mut beyond, mut beyond_slope) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                beyond[lane] = size * divisor.0[lane] - value[lane];
                beyond_slope[lane] = size * divisor.1[lane] - slope[lane];
            }
            clip_by(value, slope, false, from, to);
            clip_by(&beyond, &beyond_slope, true, from, to);
        }
        if self.perspective {
            clip_by(depth.0, depth.1, true, from, to);
        }
    }
}

/// Shrinks `[from, to]` to where `value + s·slope` is ≥ 0, or > 0 if the border is open.
#[inline(always)]
pub fn clip_by(value: &Wide, slope: &Wide, open: bool, from: &mut Wide, to: &mut Wide) {
    for lane in 0..LANES {
        let (value, slope) = (value[lane], slope[lane]);
        let crossing = -value / slope;
        let outside = if open { value <= 0.0 } else { value < 0.0 };
        let (first, last) = (from[lane], to[lane]);
        from[lane] = if slope > 0.0 { first.max(crossing) } else { first };
        let reached = if slope < 0.0 { last.min(crossing) } else { last };
        to[lane] = if slope == 0.0 && outside { f64::NEG_INFINITY } else { reached };
    }
}
