//! Sixteen view rays in the space of a map: two affine functions of the pixel's place, in f64.
//!
//! Rays of a perspective camera are parametrised by the depth along the camera's axis instead of the way along the ray: then
//! directions are linear in the pixel's coordinates, in the world and in the homogeneous space of every map. Those of a
//! parallel camera, square to its image or oblique, are parametrised by the way along them, and their starts are linear.

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

/// All view rays of a camera: `origin + s·direction` \[world units\], relative to the eye, s the depth along the axis of a
/// perspective camera and the way along the rays of a parallel one.
#[derive(Debug, Clone, Copy)]
pub struct RayFan {
    eye: DVec3,
    origin: Affine,
    direction: Affine,
    perspective: bool,
    /// Where a pixel's centre lies in the camera's window: the first one, and a step of columns and of rows.
    place: [[f64; 2]; 3],
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

/// The rays at the corners of a block of pixels, in a map's space: what is affine in the pixel's place has its bounds there.
#[derive(Debug, Clone, Copy)]
pub struct Corners {
    /// `[axis][corner]` at s = 0.
    pub start: [[f64; 4]; 3],
    /// A unit of s.
    pub step: [[f64; 4]; 3],
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
        let perspective = camera.projection() == Projection::Perspective;
        let (origin, direction) = match camera.parallel_direction() {
            None => ([DVec3::ZERO; 3], [camera.forward() + offset, columns, rows]),
            Some(travel) => ([offset, columns, rows], [travel, DVec3::ZERO, DVec3::ZERO]),
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
                let (column, row) = (f64::from(x + column), f64::from(y + row));
                let [first, step, row_step] = self.place;
                let u = first[0] + step[0] * column + row_step[0] * row;
                let v = first[1] + row_step[1] * row;
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
        let columns = std::array::from_fn(|lane| f64::from(x + place_in_group(lane)[0]));
        let rows = std::array::from_fn(|lane| f64::from(y + place_in_group(lane)[1]));
        self.paths_at(&[columns, rows])
    }

    /// The rays of any sixteen pixels, by their columns and rows.
    #[inline(always)]
    pub fn paths_at(&self, [columns, rows]: &[Wide; 2]) -> MapPaths {
        let mut paths = MapPaths { start: [[0.0; LANES]; 3], step: [[0.0; LANES]; 3] };
        for axis in 0..3 {
            let of = |affine: &Affine| affine.map(|vector| vector[axis]);
            let (start, step) = (of(&self.start), of(&self.step));
            for lane in 0..LANES {
                let (column, row) = (columns[lane], rows[lane]);
                paths.start[axis][lane] = start[0] + (start[1] * column + start[2] * row);
                paths.step[axis][lane] = step[0] + (step[1] * column + step[2] * row);
            }
        }
        paths
    }

    /// The rays at the corners of a block of pixels: its first and its last one.
    #[inline(always)]
    pub fn corners(&self, first: [u32; 2], last: [u32; 2]) -> Corners {
        let columns = [first[0], last[0], first[0], last[0]].map(f64::from);
        let rows = [first[1], first[1], last[1], last[1]].map(f64::from);
        let mut corners = Corners { start: [[0.0; 4]; 3], step: [[0.0; 4]; 3] };
        for axis in 0..3 {
            for corner in 0..4 {
                let (column, row) = (columns[corner], rows[corner]);
                let [at, by_column, by_row] = [self.start[0][axis], self.start[1][axis], self.start[2][axis]];
                corners.start[axis][corner] = at + (by_column * column + by_row * row);
                let [at, by_column, by_row] = [self.step[0][axis], self.step[1][axis], self.step[2][axis]];
                corners.step[axis][corner] = at + (by_column * column + by_row * row);
            }
        }
        corners
    }

    /// Whether all rays of a block, up to s = `end`, lie inside of the map's rectangle, and before the centre of a
    /// perspective map. What decides is linear in s and in the pixel's place each, so it decides at the corners. False
    /// where it is not known.
    #[inline(always)]
    pub fn holds(&self, corners: &Corners, end: f64) -> bool {
        let mut inside = true;
        for s in [0.0, end] {
            for corner in 0..4 {
                let at = |axis: usize| corners.start[axis][corner] + s * corners.step[axis][corner];
                let (u, v, w) = (at(0), at(1), if self.perspective { at(2) } else { 1.0 });
                inside &=
                    (u >= 0.0) & (u < self.size[0] * w) & (v >= 0.0) & (v < self.size[1] * w) & (w > 0.0);
            }
        }
        inside
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
        from[lane] = if slope > 0.0 { greater(first, crossing) } else { first };
        let reached = if slope < 0.0 { lesser(last, crossing) } else { last };
        to[lane] = if slope == 0.0 && outside { f64::NEG_INFINITY } else { reached };
    }
}

/// The lesser of two numbers, the first one if either is NaN: one instruction, where `f64::min` is three.
#[inline(always)]
pub fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The greater of two numbers, the first one if either is NaN.
#[inline(always)]
pub fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
