//! A beam: what bounds the rays of a block or of a tile, and which boxes they may cross.
//!
//! Rays that are bounded by their starts and steps are inside of a box's columns for parameters between two bounds, of its rows
//! between two others, and have depths between two bounds there. A box is left out where these are behind all ends, or where
//! all depths lie on one side of it: what no pixel can see costs nothing more.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::block_rays::Bounds;

/// Boxes that are looked at together.
pub const LANES: usize = 16;

/// How far bounds are widened, as a share of the numbers that they are made of: hundred roundings of f32.
const MARGIN: f32 = 6e-6;

/// A rate that reaches nothing: times a distance it is behind all ends.
const NEVER: f32 = 1e30;

/// First and last column, row and code of a box.
pub type Square = [f32; 6];

/// One texel axis of a beam.
#[derive(Debug, Clone, Copy)]
struct BeamAxis {
    least: f32,
    greatest: f32,
    /// Parameter a texel of the fastest ray towards larger indices, and towards smaller ones.
    soonest: [f32; 2],
    /// That of the slowest one, if all go the same way.
    latest: Latest,
}

#[derive(Debug, Clone, Copy)]
enum Latest {
    Up(f32),
    Down(f32),
    BothWays,
}

/// Rays between bounds.
#[derive(Debug, Clone, Copy)]
pub struct Beam {
    axes: [BeamAxis; 2],
    codes: [[f32; 2]; 2],
    end: f32,
}

impl Beam {
    /// Of rays within these bounds, which are not empty.
    #[inline(always)]
    pub fn new(bounds: &Bounds) -> Self {
        let axis = |axis: usize| {
            let ([least, greatest], [slowest, fastest]) = (bounds.start[axis], bounds.step[axis]);
            BeamAxis {
                least,
                greatest,
                soonest: [
                    if fastest > 0.0 { (1.0 / fastest).min(NEVER) } else { NEVER },
                    if slowest < 0.0 { (-1.0 / slowest).min(NEVER) } else { NEVER },
                ],
                latest: if slowest > 0.0 {
                    Latest::Up((1.0 / slowest).min(NEVER))
                } else if fastest < 0.0 {
                    Latest::Down((-1.0 / fastest).min(NEVER))
                } else {
                    Latest::BothWays
                },
            }
        };
        Self { axes: [axis(0), axis(1)], codes: [bounds.start[2], bounds.step[2]], end: bounds.end }
    }

    /// Whether they may cross something in a box.
    #[inline(always)]
    pub fn crosses(&self, square: &Square) -> bool {
        let (mut from, mut to) = (0.0f32, self.end);
        for (axis, beam) in self.axes.iter().enumerate() {
            let (first, last) = (square[2 * axis], square[2 * axis + 1]);
            let slack = MARGIN * (last.abs() + beam.least.abs().max(beam.greatest.abs()));
            let ahead = (first - beam.greatest - slack) * beam.soonest[0];
            let behind = (beam.least - last - slack) * beam.soonest[1];
            from = from.max(ahead).max(behind);
            match beam.latest {
                Latest::Up(rate) => to = to.min((last - beam.least + slack) * rate),
                Latest::Down(rate) => to = to.min((beam.greatest - first + slack) * rate),
                Latest::BothWays => {}
            }
        }
        from *= 1.0 - MARGIN;
        to *= 1.0 + MARGIN;
        let [[least, greatest], [slowest, fastest]] = self.codes;
        let nearest = least + (slowest * from).min(slowest * to);
        let farthest = greatest + (fastest * from).max(fastest * to);
        let slack = MARGIN * (least.abs().max(greatest.abs()) + nearest.abs().min(farthest.abs()));
        // Not "disjoint": of bounds that overflowed nothing is left out.
        !(from > to) && !(farthest + slack < square[4]) && !(nearest - slack > square[5])
    }

    /// A bit for each of sixteen boxes that they may cross something in: as [`Self::crosses`].
    #[inline(always)]
    pub fn crosses_sixteen<S: Simd>(&self, simd: S, boxes: &[[f32; LANES]; 6]) -> u64 {
        let (zero, margin) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, MARGIN));
        let (mut from, mut to) = (zero, f32x16::splat(simd, self.end));
        for (axis, beam) in self.axes.iter().enumerate() {
            let first = f32x16::load_array_ref(simd, &boxes[2 * axis]);
            let last = f32x16::load_array_ref(simd, &boxes[2 * axis + 1]);
            let (least, greatest) = (f32x16::splat(simd, beam.least), f32x16::splat(simd, beam.greatest));
            let of_starts = f32x16::splat(simd, MARGIN * beam.least.abs().max(beam.greatest.abs()));
            let slack = last.mul_add(margin, of_starts);
            let ahead = (first - greatest - slack) * f32x16::splat(simd, beam.soonest[0]);
            let behind = (least - last - slack) * f32x16::splat(simd, beam.soonest[1]);
            from = from.max(ahead).max(behind);
            match beam.latest {
                Latest::Up(rate) => to = to.min((last - least + slack) * f32x16::splat(simd, rate)),
                Latest::Down(rate) => to = to.min((greatest - first + slack) * f32x16::splat(simd, rate)),
                Latest::BothWays => {}
            }
        }
        from *= f32x16::splat(simd, 1.0 - MARGIN);
        to *= f32x16::splat(simd, 1.0 + MARGIN);
        let [[least, greatest], [slowest, fastest]] = self.codes;
        let (slow, fast) = (f32x16::splat(simd, slowest), f32x16::splat(simd, fastest));
        let nearest = f32x16::splat(simd, least) + (slow * from).min(slow * to);
        let farthest = f32x16::splat(simd, greatest) + (fast * from).max(fast * to);
        let of_starts = f32x16::splat(simd, least.abs().max(greatest.abs()));
        let slack = (nearest.abs().min(farthest.abs()) + of_starts) * margin;
        let codes = [f32x16::load_array_ref(simd, &boxes[4]), f32x16::load_array_ref(simd, &boxes[5])];
        let outside =
            from.simd_gt(to) | (farthest + slack).simd_lt(codes[0]) | (nearest - slack).simd_gt(codes[1]);
        !outside.to_bitmask() & 0xFFFF
    }
}
