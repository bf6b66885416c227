//! The rays of 8×8 pixels in one layer, in a parameter s in which texels' borders and depths are crossed in order.
//!
//! In s all three coordinates of a ray are affine: column, row and the depth's code. Under a parallel map s is the camera's
//! depth behind a base and the code is the depth itself. Under a perspective one, with (u, v, w) at the base z₀,
//!
//! ```text
//! s = δ·w₀/(w₀ + δ·ẇ)      δ = z − z₀      u/w = u₀/w₀ + s·(u̇ − (u₀/w₀)·ẇ)/w₀      −1/w = −1/w₀ + s·ẇ/w₀²
//! ```
//!
//! so a lamp's pyramid becomes a box, the code is −1/w, and the planes of all faces are square to an axis. A border `k` of a
//! column is crossed at `(k − start)·inverse`: one number a ray and border, however many faces stand on it.

use scatter_core::MapFan;

use super::ray_fan::{MapPath, MapRays};

/// Pixels along the side of a block.
pub const SIDE: u32 = 8;
/// Rays of a block.
pub const RAYS: usize = 64;
/// Rays that are looked at side by side: two rows of a block.
pub const SIXTEEN: usize = 16;

/// Largest inverse of a step: times the index of a border it is finite in f32.
const STEEPEST: f64 = 1e30;
/// An end behind everything.
pub const ENDLESS: f64 = 1e30;
/// How many maps' widths aside an eye may lie from a perspective map before rays start where they enter it.
const ASIDE: f64 = 4.0;

/// A number for each ray of a block.
pub type Reals = [f32; RAYS];

/// Rays of a block in a layer.
#[derive(Debug, Clone)]
pub struct BlockRays {
    /// Column, row and code at s = 0.
    pub start: [Reals; 3],
    /// s for a unit of each; ±1e30 where it does not change.
    pub inverse: [Reals; 3],
    /// The change of each for a unit of s.
    pub step: [Reals; 3],
    /// Where rays end, in s; ≤ 0 where there is none.
    pub end: Reals,
    /// The same starts in f64, and their inverses.
    exact: [[[f64; 2]; 3]; RAYS],
    /// The camera's depth at s = 0, and ẇ/w₀.
    base: [[f64; 2]; RAYS],
    /// What bounds them all.
    pub bounds: Bounds,
    /// What bounds each sixteen of them.
    pub of_sixteens: [Bounds; RAYS / SIXTEEN],
}

/// Bounds of the rays of a block or of a tile.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Least and greatest start of each axis.
    pub start: [[f32; 2]; 3],
    /// Least and greatest change of it a unit of s.
    pub step: [[f32; 2]; 3],
    /// The farthest end; 0 if there is no ray.
    pub end: f32,
}

impl Bounds {
    /// Of no ray.
    pub const EMPTY: Self = Self {
        start: [[f32::INFINITY, f32::NEG_INFINITY]; 3],
        step: [[f32::INFINITY, f32::NEG_INFINITY]; 3],
        end: 0.0,
    };

    /// Of both.
    pub fn joined(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for (mine, theirs) in
                [(&mut self.start[axis], &other.start[axis]), (&mut self.step[axis], &other.step[axis])]
            {
                *mine = [mine[0].min(theirs[0]), mine[1].max(theirs[1])];
            }
        }
        self.end = self.end.max(other.end);
        self
    }
}

impl Default for BlockRays {
    fn default() -> Self {
        Self {
            start: [[0.0; RAYS]; 3],
            inverse: [[1.0; RAYS]; 3],
            step: [[1.0; RAYS]; 3],
            end: [0.0; RAYS],
            exact: [[[0.0; 2]; 3]; RAYS],
            base: [[0.0; 2]; RAYS],
            bounds: Bounds::EMPTY,
            of_sixteens: [Bounds::EMPTY; RAYS / SIXTEEN],
        }
    }
}

impl BlockRays {
    /// The rays of the block of pixels from `(x, y)` on, which end at the camera's depths `ends` (0 where there is no pixel).
    /// Returns a bit for every ray that numbers of f64 cannot hold.
    #[inline(always)]
    pub fn set_up(&mut self, fan: &MapFan, [x, y]: [u32; 2], ends: &[f64; RAYS]) -> u64 {
        let mut lost = 0;
        self.of_sixteens = [Bounds::EMPTY; RAYS / SIXTEEN];
        let starts_at_eye = fan.one_start && fan.perspective && is_before(fan, &fan.path([x, y]));
        for (ray, &end) in ends.iter().enumerate() {
            let path = fan.path([x + ray as u32 % SIDE, y + ray as u32 / SIDE]);
            let line = if !fan.perspective {
                Some(Line::parallel(&path, end))
            } else if starts_at_eye {
                Line::projective(&path, 0.0, end)
            } else {
                let [from, to] = fan.clip(&path, [0.0, end]);
                if from < to { Line::projective(&path, from, end) } else { None }
            };
            // A ray that misses the layer crosses nothing in it.
            let line = line.filter(|_| end > 0.0).unwrap_or(Line::NONE);
            let is_sane =
                line.start.iter().chain(&line.step).all(|value| value.abs() < 1e15) && line.end >= 0.0;
            if !is_sane {
                lost |= 1 << ray;
            }
            self.put(ray, if is_sane { &line } else { &Line::NONE });
        }
        self.bounds = Bounds::EMPTY;
        for bounds in &self.of_sixteens {
            self.bounds = self.bounds.joined(bounds);
        }
        lost
    }

    #[inline(always)]
    fn put(&mut self, ray: usize, line: &Line) {
        let bounds = &mut self.of_sixteens[ray / SIXTEEN];
        let exists = line.end > 0.0;
        for axis in 0..3 {
            let (start, step) = (line.start[axis], line.step[axis]);
            // A depth that does not change counts as falling: a ray along a cap is lit, as a point on it is.
            let still = if axis == 2 { -STEEPEST } else { STEEPEST };
            let inverse = if step == 0.0 { still } else { (1.0 / step).clamp(-STEEPEST, STEEPEST) };
            self.exact[ray][axis] = [start, inverse];
            self.start[axis][ray] = start as f32;
            self.inverse[axis][ray] = inverse as f32;
            self.step[axis][ray] = step as f32;
            if exists {
                let (start, step) = (start as f32, step as f32);
                bounds.start[axis] = [bounds.start[axis][0].min(start), bounds.start[axis][1].max(start)];
                bounds.step[axis] = [bounds.step[axis][0].min(step), bounds.step[axis][1].max(step)];
            }
        }
        let end = line.end.min(ENDLESS) as f32;
        self.end[ray] = end;
        bounds.end = bounds.end.max(end);
        self.base[ray] = line.base;
    }

    /// The camera's depth where a ray crosses `at` on an axis, in f64.
    #[inline(always)]
    pub fn depth_of(&self, ray: usize, axis: usize, at: f64) -> f64 {
        let [start, inverse] = self.exact[ray][axis];
        let s = (at - start) * inverse;
        self.depth_at(ray, s)
    }

    /// The camera's depth at s = 0.
    #[inline(always)]
    pub fn base(&self, ray: usize) -> f64 {
        self.base[ray][0]
    }

    /// The texel in which a ray starts, as its crossings have it; `None` outside of a map of that size.
    #[inline(always)]
    pub fn first_texel(&self, ray: usize, size: [u32; 2]) -> Option<[u32; 2]> {
        if self.end[ray] <= 0.0 {
            return None;
        }
        let mut texel = [0; 2];
        for axis in 0..2 {
            let start = self.start[axis][ray];
            // On a border the ray has crossed it already.
            let index = if self.inverse[axis][ray] > 0.0 { start.floor() } else { start.ceil() - 1.0 };
            if !(index >= 0.0 && index < size[axis] as f32) {
                return None;
            }
            texel[axis] = index as u32;
        }
        Some(texel)
    }

    /// The cell between texels' centres in which a ray starts, as its crossings have it, and whether it starts in the right and in
    /// the lower half of it; `None` outside of a map of that size.
    #[inline(always)]
    pub fn first_cell(&self, ray: usize, size: [u32; 2]) -> Option<([u32; 2], [bool; 2])> {
        let texel = self.first_texel(ray, size)?;
        let (mut cell, mut half) = ([0; 2], [false; 2]);
        for axis in 0..2 {
            let (start, rises) = (self.start[axis][ray], self.inverse[axis][ray] > 0.0);
            // The centre of the texel, behind which the next cell begins.
            let centre = texel[axis] as f32 + 0.5;
            let is_past = if rises { start >= centre } else { start > centre };
            cell[axis] = texel[axis] + u32::from(is_past);
            half[axis] = !is_past;
        }
        Some((cell, half))
    }

    /// The parameter where a plane lies that a ray crosses: `at` its height above a point of the ray at s = 0 in code, `slopes` its
    /// change a column and a row. In f64.
    #[inline(always)]
    pub fn plane_crossing(&self, ray: usize, height: impl Fn(f64, f64) -> f64, slopes: [f64; 2]) -> f64 {
        let [u, v, code] = self.exact[ray];
        let above = height(u[0], v[0]) - code[0];
        above / (1.0 / code[1] - slopes[0] / u[1] - slopes[1] / v[1])
    }

    /// The camera's depth at a parameter, in f64.
    #[inline(always)]
    pub fn depth_at(&self, ray: usize, s: f64) -> f64 {
        let [base, bend] = self.base[ray];
        let nearer = 1.0 - s * bend;
        // Of the last depth before infinity nothing may be left but rounding.
        if nearer > 0.0 { base + s / nearer } else { f64::INFINITY }
    }

    /// Whether a ray starts behind a cap of that code.
    #[inline(always)]
    pub fn starts_behind(&self, ray: usize, code: f32) -> bool {
        let start = self.start[2][ray];
        if self.inverse[2][ray] > 0.0 { start >= code } else { start > code }
    }
}

/// Whether the eye lies before the plane of a perspective map's lamp, and not far aside of its pyramid.
fn is_before(fan: &MapFan, path: &MapPath) -> bool {
    let (start, w) = (path.start, path.start.z);
    w > 0.0
        && [(start.x, fan.size[0]), (start.y, fan.size[1])]
            .into_iter()
            .all(|(value, size)| value.abs() <= (ASIDE + 1.0) * size * w)
}

/// A ray in s.
struct Line {
    start: [f64; 3],
    step: [f64; 3],
    end: f64,
    base: [f64; 2],
}

impl Line {
    const NONE: Self = Self { start: [0.0; 3], step: [1.0; 3], end: 0.0, base: [0.0; 2] };

    #[inline(always)]
    fn parallel(path: &MapPath, end: f64) -> Self {
        Self { start: path.start.to_array(), step: path.step.to_array(), end, base: [0.0; 2] }
    }

    /// From the camera's depth `from` on. `None` where the lamp itself is there.
    #[inline(always)]
    fn projective(path: &MapPath, from: f64, end: f64) -> Option<Self> {
        let at = path.start + path.step * from;
        let (w, rate) = (at.z, path.step.z);
        if !(w > 0.0) {
            return None;
        }
        let (u, v) = (at.x / w, at.y / w);
        let step = [(path.step.x - u * rate) / w, (path.step.y - v * rate) / w, rate / (w * w)];
        let way = end - from;
        let w_end = w + way * rate;
        let s_end = if way < ENDLESS && w_end > 0.0 {
            way * w / w_end
        } else if way >= ENDLESS && rate > 0.0 {
            w / rate
        } else {
            ENDLESS
        };
        Some(Self { start: [u, v, -1.0 / w], step, end: s_end, base: [from, rate / w] })
    }
}
