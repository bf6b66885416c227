//! Sixteen rays of a block side by side, and where they cross borders and codes.
//!
//! Methods, not closures: a closure is compiled without the instructions of its caller's level, and calls one for every operation.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::beam::Beam;
use super::block_rays::{BlockRays, RAYS, SIXTEEN};

/// Rays that are tested side by side.
pub const LANES: usize = SIXTEEN;

/// A number for each ray.
pub type Wide<S> = f32x16<S>;

/// The beams around a block's rays, and around each sixteen of them.
pub struct BlockBeams {
    /// Around all.
    pub block: Beam,
    sixteens: [Beam; RAYS / LANES],
    /// Which of these have a ray.
    exist: [bool; RAYS / LANES],
}

/// Boxes of sixteen of which at least so many must be met by the block's beam for those of its parts to be asked: four more questions
/// cost as much as some ten tests of a face against sixteen rays.
const WORTH_ASKING: u32 = 4;

impl BlockBeams {
    /// Of rays of which one exists.
    #[inline(always)]
    pub fn new(rays: &BlockRays) -> Self {
        let block = Beam::new(&rays.bounds);
        let (mut sixteens, mut exist) = ([block; RAYS / LANES], [false; RAYS / LANES]);
        for (n, bounds) in rays.of_sixteens.iter().enumerate() {
            exist[n] = bounds.end > 0.0;
            if exist[n] {
                sixteens[n] = Beam::new(bounds);
            }
        }
        Self { block, sixteens, exist }
    }

    /// For each sixteen rays a bit for each of the boxes `met` by the block that they may cross something in.
    #[inline(always)]
    pub fn crosses_by_sixteens<S: Simd>(
        &self,
        simd: S,
        boxes: &[[f32; LANES]; 6],
        met: u64,
    ) -> [u64; RAYS / LANES] {
        let mut found = [met; RAYS / LANES];
        if met.count_ones() >= WORTH_ASKING {
            for (n, found) in found.iter_mut().enumerate() {
                *found = if self.exist[n] { met & self.sixteens[n].crosses_sixteen(simd, boxes) } else { 0 };
            }
        }
        found
    }
}

/// Sixteen rays of a block.
pub struct RayGroup<S: Simd> {
    /// Column, row and code at s = 0.
    pub start: [Wide<S>; 3],
    /// s for a unit of each.
    pub inverse: [Wide<S>; 3],
    /// Where they end, in s.
    pub end: Wide<S>,
}

impl<S: Simd> RayGroup<S> {
    /// The rays of a block from `first` on.
    #[inline(always)]
    pub fn load(simd: S, rays: &BlockRays, first: usize) -> Self {
        Self {
            start: [
                lanes(simd, &rays.start[0], first),
                lanes(simd, &rays.start[1], first),
                lanes(simd, &rays.start[2], first),
            ],
            inverse: [
                lanes(simd, &rays.inverse[0], first),
                lanes(simd, &rays.inverse[1], first),
                lanes(simd, &rays.inverse[2], first),
            ],
            end: lanes(simd, &rays.end, first),
        }
    }

    /// Where the rays cross a border or a code.
    #[inline(always)]
    pub fn crossing(&self, simd: S, axis: usize, at: f32) -> Wide<S> {
        (Wide::splat(simd, at) - self.start[axis]) * self.inverse[axis]
    }

    /// Where they cross the first and the second of two borders.
    #[inline(always)]
    pub fn between(&self, simd: S, axis: usize, [near, far]: [f32; 2]) -> [Wide<S>; 2] {
        let (a, b) = (self.crossing(simd, axis, near), self.crossing(simd, axis, far));
        [a.min(b), a.max(b)]
    }
}

/// Sixteen of a block's numbers.
#[inline(always)]
pub fn lanes<S: Simd>(simd: S, values: &[f32; RAYS], first: usize) -> Wide<S> {
    Wide::from_slice(simd, &values[first..first + LANES])
}
