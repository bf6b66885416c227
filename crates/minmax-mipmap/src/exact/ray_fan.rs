//! Sixteen view rays in the space of a map, side by side, in f64.

use scatter_core::{AffineInPixel, MapFan, RayFan};

/// Rays that are set up side by side.
pub const LANES: usize = 16;

/// Columns of a group of sixteen pixels; it has two rows, so that neighbours share cache lines of the mipmap.
pub const GROUP: [u32; 2] = [8, 2];

/// A number for each ray.
pub type Wide = [f64; LANES];

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

/// Column and row of a lane in its group.
#[inline(always)]
pub fn place_in_group(lane: usize) -> [u32; 2] {
    [lane as u32 % GROUP[0], lane as u32 / GROUP[0]]
}

/// How long a unit of s is on the rays of the group of pixels from `(x, y)` on \[world units\].
#[inline(always)]
pub fn stretches(fan: &RayFan, [x, y]: [u32; 2]) -> Wide {
    let mut stretches = [1.0; LANES];
    if fan.is_perspective() {
        for (lane, stretch) in stretches.iter_mut().enumerate() {
            let [column, row] = place_in_group(lane);
            *stretch = fan.stretch([x + column, y + row]);
        }
    }
    stretches
}

/// The rays of a [`MapFan`], sixteen at a time.
pub trait MapLanes {
    /// The rays of the group of pixels from `(x, y)` on.
    fn paths(&self, place: [u32; 2]) -> MapPaths;

    /// The rays of any sixteen pixels, by their columns and rows.
    fn paths_at(&self, places: &[Wide; 2]) -> MapPaths;

    /// The rays at the corners of a block of pixels: its first and its last one.
    fn corners(&self, first: [u32; 2], last: [u32; 2]) -> Corners;

    /// Whether all rays of a block, up to s = `end`, lie inside of the map's rectangle, and before the centre of a
    /// perspective map. What decides is linear in s and in the pixel's place each, so it decides at the corners. False
    /// where it is not known.
    fn holds(&self, corners: &Corners, end: f64) -> bool;

    /// Whether no ray of a block, up to s = `end`, comes near the map's rectangle before the centre of a perspective map: all
    /// lie beyond one of its borders, or behind it, by more than rounding moves. False where it is not known.
    fn misses(&self, corners: &Corners, end: f64) -> bool;

    /// The parts `[from, to]` of rays that lie inside of the map's rectangle, and before the centre of a perspective map:
    /// one stretch a ray, since the region is convex; `from ≥ to` where there is none.
    fn clip(&self, paths: &MapPaths, from: &mut Wide, to: &mut Wide);
}

impl MapLanes for MapFan {
    #[inline(always)]
    fn paths(&self, [x, y]: [u32; 2]) -> MapPaths {
        let columns = std::array::from_fn(|lane| f64::from(x + place_in_group(lane)[0]));
        let rows = std::array::from_fn(|lane| f64::from(y + place_in_group(lane)[1]));
        self.paths_at(&[columns, rows])
    }

    #[inline(always)]
    fn paths_at(&self, [columns, rows]: &[Wide; 2]) -> MapPaths {
        let mut paths = MapPaths { start: [[0.0; LANES]; 3], step: [[0.0; LANES]; 3] };
        for axis in 0..3 {
            let of = |affine: &AffineInPixel| affine.map(|vector| vector[axis]);
            let (start, step) = (of(&self.start), of(&self.step));
            for lane in 0..LANES {
                let (column, row) = (columns[lane], rows[lane]);
                paths.start[axis][lane] = start[0] + (start[1] * column + start[2] * row);
                paths.step[axis][lane] = step[0] + (step[1] * column + step[2] * row);
            }
        }
        paths
    }

    #[inline(always)]
    fn corners(&self, first: [u32; 2], last: [u32; 2]) -> Corners {
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

    #[inline(always)]
    fn holds(&self, corners: &Corners, end: f64) -> bool {
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

    #[inline(always)]
    fn misses(&self, corners: &Corners, end: f64) -> bool {
        // Rays between the corners are mixtures of theirs, and so are their points.
        let mut beyond = [true; 5];
        for s in [0.0, end] {
            for corner in 0..4 {
                let at = |axis: usize| corners.start[axis][corner] + s * corners.step[axis][corner];
                let (u, v, w) = (at(0), at(1), if self.perspective { at(2) } else { 1.0 });
                let [width, height] = [self.size[0] * w, self.size[1] * w];
                let least = -MISSED * (u.abs() + v.abs() + width.abs() + height.abs());
                let values = [u, width - u, v, height - v, w];
                for (beyond, value) in beyond.iter_mut().zip(values) {
                    *beyond &= value < least;
                }
            }
        }
        beyond.contains(&true)
    }

    #[inline(always)]
    fn clip(&self, paths: &MapPaths, from: &mut Wide, to: &mut Wide) {
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

/// Part of a place's own size by which it must lie beyond a border: f64 rounds by a millionth of that.
const MISSED: f64 = 1e-9;

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
