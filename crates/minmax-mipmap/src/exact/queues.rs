//! Lists that lanes are compressed into, to be worked off sixteen at a time: blocks of texels that must be looked at one by
//! one, and lit runs.
//!
//! Branches that only some lanes of a packet take cost more than anything else here, so no lane branches: what one of them
//! finds is written to a list, and the packet goes on. Nor does a packet branch by whether any lane has found something,
//! where lanes are compressed by one instruction.
//!
//! Blocks are sorted by how many texels their rays pass before they are worked off: sixteen that are looked at together end
//! together, and 87 to 90 of 100 lanes are at work where unsorted ones are 58 to 65.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::{Answers, Reals, compresses_at_once, first_lanes};
use super::ray_fan::LANES;

/// Entries from which on a list is worked off.
pub const FULL: usize = 1024;

/// Most that is added between two looks at the length: two packets of sixteen, through eight texels each; and sixteen more,
/// since whole vectors are written.
const SLACK: usize = 2 * LANES * (8 + 1);

/// Room of a list: a constant, so that one comparison checks all of its columns.
const ROOM: usize = FULL + SLACK;

/// A column of a list.
type Column<T> = Box<[T; ROOM]>;

/// Lit runs: a segment's number, and from where to where in its parameter s.
#[derive(Debug, Clone)]
pub struct Runs {
    segments: Column<u32>,
    from: Column<f32>,
    to: Column<f32>,
    count: usize,
}

/// Blocks of 4×4 texels: a segment's number, the texel where it comes in (column | row << 16), and from where to where.
#[derive(Debug, Clone)]
pub struct Blocks {
    segments: Column<u32>,
    texels: Column<u32>,
    from: Column<f32>,
    to: Column<f32>,
    count: usize,
}

impl Default for Runs {
    fn default() -> Self {
        Self {
            segments: Box::new([0; ROOM]),
            from: Box::new([0.0; ROOM]),
            to: Box::new([0.0; ROOM]),
            count: 0,
        }
    }
}

impl Default for Blocks {
    fn default() -> Self {
        Self {
            segments: Box::new([0; ROOM]),
            texels: Box::new([0; ROOM]),
            from: Box::new([0.0; ROOM]),
            to: Box::new([0.0; ROOM]),
            count: 0,
        }
    }
}

impl Runs {
    /// Adds the lanes that the mask names. With AVX-512 it writes sixteen whether there are any or not:
    /// whether a packet has some is no better to predict than whether a lane has.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, mask: Answers<S>, segments: u32x16<S>, from: Reals<S>, to: Reals<S>) {
        if !compresses_at_once(from.simd) && !mask.any_true() {
            return;
        }
        let at = self.count..self.count + LANES;
        segments.compress(mask).store_slice(&mut self.segments[at.clone()]);
        from.compress(mask).store_slice(&mut self.from[at.clone()]);
        to.compress(mask).store_slice(&mut self.to[at]);
        self.count += mask.to_bitmask().count_ones() as usize;
    }

    /// Whether it is to be worked off.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count >= FULL
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Sixteen of them from number `at` on: segments, from, to; those behind the last one are empty runs.
    #[inline(always)]
    pub fn sixteen(&self, at: usize) -> ([u32; LANES], [f32; LANES], [f32; LANES]) {
        let (mut segments, mut from, mut to) = ([0; LANES], [0.0; LANES], [0.0; LANES]);
        let count = (self.count - at).min(LANES);
        if count == LANES {
            segments.copy_from_slice(&self.segments[at..][..LANES]);
            from.copy_from_slice(&self.from[at..][..LANES]);
            to.copy_from_slice(&self.to[at..][..LANES]);
        } else {
            segments[..count].copy_from_slice(&self.segments[at..][..count]);
            from[..count].copy_from_slice(&self.from[at..][..count]);
            to[..count].copy_from_slice(&self.to[at..][..count]);
        }
        (segments, from, to)
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Bytes that the list holds.
    pub fn memory_bytes(&self) -> u64 {
        (3 * ROOM * size_of::<u32>()) as u64
    }
}

/// Where the number of texels that a ray passes in its block stands above the segment's number.
const PASSED: u32 = 28;

/// Classes of blocks by that number, each up to and with its own. Fewer classes leave more lanes idle, more cost more passes.
const CLASSES: [u32; 5] = [2, 3, 4, 5, u32::MAX];

impl Blocks {
    /// Adds the lanes that the mask names; `passed` is about how many texels each ray passes in its block, 1 to 8 (whatever it
    /// says, no block is lost); segments' numbers are below 2²⁸, a hundred thousand a pixel of a tile.
    #[inline(always)]
    pub fn push<S: Simd>(
        &mut self,
        mask: Answers<S>,
        (segments, passed): (u32x16<S>, u32x16<S>),
        texels: u32x16<S>,
        from: Reals<S>,
        to: Reals<S>,
    ) {
        if !compresses_at_once(from.simd) && !mask.any_true() {
            return;
        }
        let at = self.count..self.count + LANES;
        let segments = segments | (passed << PASSED);
        segments.compress(mask).store_slice(&mut self.segments[at.clone()]);
        texels.compress(mask).store_slice(&mut self.texels[at.clone()]);
        from.compress(mask).store_slice(&mut self.from[at.clone()]);
        to.compress(mask).store_slice(&mut self.to[at]);
        self.count += mask.to_bitmask().count_ones() as usize;
    }

    /// Puts them into `sorted`, those first that pass fewest texels.
    #[inline(always)]
    pub fn sort_into<S: Simd>(&self, simd: S, sorted: &mut Self) {
        sorted.count = 0;
        if !compresses_at_once(simd) {
            return self.sort_one_by_one(sorted);
        }
        let mut least = 0;
        for most in CLASSES {
            for at in (0..self.count).step_by(LANES) {
                let segments = u32x16::from_slice(simd, &self.segments[at..][..LANES]);
                let passed = segments >> PASSED;
                let mask = first_lanes(simd, self.count - at)
                    & passed.simd_ge(u32x16::splat(simd, least))
                    & passed.simd_le(u32x16::splat(simd, most));
                let to = sorted.count..sorted.count + LANES;
                let number = segments & ((1 << PASSED) - 1);
                number.compress(mask).store_slice(&mut sorted.segments[to.clone()]);
                u32x16::from_slice(simd, &self.texels[at..][..LANES])
                    .compress(mask)
                    .store_slice(&mut sorted.texels[to.clone()]);
                Reals::from_slice(simd, &self.from[at..][..LANES])
                    .compress(mask)
                    .store_slice(&mut sorted.from[to.clone()]);
                Reals::from_slice(simd, &self.to[at..][..LANES])
                    .compress(mask)
                    .store_slice(&mut sorted.to[to]);
                sorted.count += mask.to_bitmask().count_ones() as usize;
            }
            least = most.wrapping_add(1);
        }
        debug_assert_eq!(sorted.count, self.count, "every block is of one class");
    }

    /// [`Self::sort_into`] without vectors, to the same order.
    fn sort_one_by_one(&self, sorted: &mut Self) {
        let class_of = |segment: u32| CLASSES.iter().take_while(|most| **most < segment >> PASSED).count();
        let mut places = [0; CLASSES.len() + 1];
        for segment in &self.segments[..self.count] {
            places[class_of(*segment) + 1] += 1;
        }
        for class in 1..places.len() {
            places[class] += places[class - 1];
        }
        for at in 0..self.count {
            let segment = self.segments[at];
            let place = &mut places[class_of(segment)];
            sorted.segments[*place] = segment & ((1 << PASSED) - 1);
            sorted.texels[*place] = self.texels[at];
            (sorted.from[*place], sorted.to[*place]) = (self.from[at], self.to[at]);
            *place += 1;
        }
        sorted.count = self.count;
    }

    /// Whether it is to be worked off.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count >= FULL
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Sixteen of them from number `at` on: segments, texels, from, to. Lanes behind the last one hold what was there
    /// before.
    #[inline(always)]
    pub fn sixteen(&self, at: usize) -> [&[u32]; 2] {
        [&self.segments[at..][..LANES], &self.texels[at..][..LANES]]
    }

    /// From where to where sixteen of them reach.
    #[inline(always)]
    pub fn parts(&self, at: usize) -> [&[f32]; 2] {
        [&self.from[at..][..LANES], &self.to[at..][..LANES]]
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Bytes that the list holds.
    pub fn memory_bytes(&self) -> u64 {
        (4 * ROOM * size_of::<u32>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::{Level, at_level};
    use scatter_testing::Random;

    /// Every block once, with its own texel and ends, those first that pass fewest texels; for lists that end within a vector.
    #[test]
    fn sorted_blocks_are_the_same_blocks() {
        for (simd, count) in
            [(Level::new(), 0), (Level::new(), 5), (Level::new(), 1029), (Level::baseline(), 77)]
        {
            let mut random = Random(count as u64 + 1);
            let passed: Vec<u32> = (0..count).map(|_| random.below(16)).collect();
            let (mut blocks, mut sorted) = (Blocks::default(), Blocks::default());
            // What an earlier list left must not matter.
            sorted.count = 99;
            at_level!(simd, v => {
                for (n, passed) in passed.iter().enumerate() {
                    let lane = n % LANES;
                    let number = u32x16::splat(v, n as u32);
                    let from = Reals::splat(v, n as f32);
                    let mask = Answers::from_bitmask(v, 1 << lane);
                    blocks.push(mask, (number, u32x16::splat(v, *passed)), number + 7, from, from + 0.5);
                }
                blocks.sort_into(v, &mut sorted);
            });
            assert_eq!(sorted.len(), count);
            let class = |n: u32| CLASSES.iter().position(|most| passed[n as usize] <= *most);
            assert!(sorted.segments[..count].is_sorted_by_key(|n| class(*n)));
            for n in 0..count {
                let number = sorted.segments[n];
                assert_eq!(sorted.texels[n], number + 7);
                assert_eq!([sorted.from[n], sorted.to[n]], [number as f32, number as f32 + 0.5]);
            }
            let mut numbers = sorted.segments[..count].to_vec();
            numbers.sort_unstable();
            assert!(numbers.iter().copied().eq(0..count as u32));
        }
    }
}
