//! Which patches of a mesh the rays of a tile, and then of a block, may cross: culling by bounds.
//!
//! Rays that are bounded by their starts and steps are inside of a square's columns for parameters between two bounds, of its
//! rows between two others, and have depths between two bounds there. A square is left out where these are behind all ends, or
//! where all depths lie on one side of all its faces: what no pixel can see costs nothing.

use super::block_rays::Bounds;
use crate::volume::cells::{PATCH, squares};
use crate::volume::{Patch, SteppedVolume};

/// Squares that are looked at together.
const LANES: usize = 16;

/// How far bounds are widened, as a share of the numbers that they are made of: hundred roundings of f32.
const MARGIN: f32 = 6e-6;

/// A square with faces.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Its first patch: column and row of patches.
    pub place: [u32; 2],
    /// That patch.
    pub patch: Patch,
}

/// Squares with faces that rays of a tile may cross; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct Candidates {
    /// Column border before and behind, row border before and behind, least and greatest code: sixteen squares each.
    boxes: Vec<[[f32; LANES]; 6]>,
    list: Vec<Candidate>,
    stack: Vec<(u8, [u16; 2])>,
}

/// The code of a depth: what is affine along a ray.
#[inline(always)]
pub fn code_of(depth: f32, perspective: bool) -> f32 {
    // A depth of 0 is the lamp itself; the code stays finite, so that no product is NaN.
    if perspective { (-1.0 / depth).max(-1e30) } else { depth }
}

impl Candidates {
    /// Finds the squares of a mesh that rays within `bounds` may cross. O(squares found · log).
    #[inline(always)]
    pub fn find(&mut self, volume: &SteppedVolume, perspective: bool, bounds: &Bounds) {
        self.list.clear();
        self.boxes.clear();
        self.stack.clear();
        if !(bounds.end > 0.0) {
            return;
        }
        self.stack.push((volume.coarsest() as u8, [0; 2]));
        let size = volume.size();
        while let Some((level, place)) = self.stack.pop() {
            let (level, place) = (level as usize, place.map(u32::from));
            let spread = volume.bounds(level, place);
            if !(spread[0] <= spread[1]) {
                continue;
            }
            let first = place.map(|n| (n * (PATCH << level)) as f32);
            let last = [0, 1].map(|axis| (first[axis] + (PATCH << level) as f32).min(size[axis] as f32));
            let codes = spread.map(|depth| code_of(depth, perspective));
            let square = [first[0], last[0], first[1], last[1], codes[0], codes[1]];
            if !may_cross(bounds, &square) {
                continue;
            }
            let first_patch = place.map(|n| n << level);
            let patch = volume.patch(first_patch);
            if level == 0 || patch.level() == level {
                if !patch.is_empty() {
                    self.push(Candidate { place: first_patch, patch: *patch }, &square);
                }
                continue;
            }
            let finer = squares(size, level - 1);
            for [i, j] in [[1, 1], [0, 1], [1, 0], [0, 0]] {
                let [column, row] = [2 * place[0] + i, 2 * place[1] + j];
                if column < finer[0] && row < finer[1] {
                    self.stack.push((level as u8 - 1, [column as u16, row as u16]));
                }
            }
        }
    }

    fn push(&mut self, candidate: Candidate, square: &[f32; 6]) {
        let lane = self.list.len() % LANES;
        if lane == 0 {
            self.boxes.push([[0.0; LANES]; 6]);
        }
        if let Some(boxes) = self.boxes.last_mut() {
            for (values, value) in boxes.iter_mut().zip(square) {
                values[lane] = *value;
            }
        }
        self.list.push(candidate);
    }

    /// Calls `each` for those that rays within narrower bounds may cross.
    #[inline(always)]
    pub fn of_block(&self, bounds: &Bounds, mut each: impl FnMut(&Candidate)) {
        if !(bounds.end > 0.0) {
            return;
        }
        for (candidates, boxes) in self.list.chunks(LANES).zip(&self.boxes) {
            let mut crosses = [false; LANES];
            for lane in 0..LANES {
                crosses[lane] = may_cross(bounds, &boxes.map(|values| values[lane]));
            }
            for (candidate, crosses) in candidates.iter().zip(crosses) {
                if crosses {
                    each(candidate);
                }
            }
        }
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        (self.boxes.capacity() * size_of::<[[f32; LANES]; 6]>()
            + self.list.capacity() * size_of::<Candidate>()
            + self.stack.capacity() * size_of::<(u8, [u16; 2])>()) as u64
    }
}

/// Whether rays within bounds may cross faces in a box of columns, rows and codes.
#[inline(always)]
fn may_cross(bounds: &Bounds, square: &[f32; 6]) -> bool {
    let (mut from, mut to) = (0.0f32, bounds.end);
    for axis in 0..2 {
        let ([least, greatest], [slowest, fastest]) = (bounds.start[axis], bounds.step[axis]);
        let (first, last) = (square[2 * axis], square[2 * axis + 1]);
        let slack = MARGIN * (first.abs().max(last.abs()) + least.abs().max(greatest.abs()));
        // From here to there, at the least and at the most, towards larger indices and towards smaller ones.
        let (up_least, up_most) = (first - greatest - slack, last - least + slack);
        let (down_least, down_most) = (least - last - slack, greatest - first + slack);
        // Rays that start before the square get there by the fastest step at the earliest.
        let enter_up = if fastest > 0.0 { up_least / fastest } else { f32::INFINITY };
        let enter_down = if slowest < 0.0 { down_least / -slowest } else { f32::INFINITY };
        let enter = if up_least > 0.0 {
            enter_up
        } else if down_least > 0.0 {
            enter_down
        } else {
            0.0
        };
        // They are past it by the slowest step at the latest.
        let leave = if slowest > 0.0 {
            up_most / slowest
        } else if fastest < 0.0 {
            down_most / -fastest
        } else {
            f32::INFINITY
        };
        from = from.max(enter);
        to = to.min(leave);
    }
    from *= 1.0 - MARGIN;
    to *= 1.0 + MARGIN;
    let ([least, greatest], [slowest, fastest]) = (bounds.start[2], bounds.step[2]);
    let nearest = least + (slowest * from).min(slowest * to);
    let farthest = greatest + (fastest * from).max(fastest * to);
    let slack = MARGIN * (least.abs().max(greatest.abs()) + nearest.abs().min(farthest.abs()));
    // Not "disjoint": of bounds that overflowed nothing is left out.
    from <= to && !(farthest + slack < square[4]) && !(nearest - slack > square[5])
}
