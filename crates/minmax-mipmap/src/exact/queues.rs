//! Lists that lanes are compressed into, to be worked off sixteen at a time: blocks of texels that must be looked at one by
//! one, and lit runs.
//!
//! Branches that only some lanes of a packet take cost more than anything else here, so no lane branches: what one of them
//! finds is written to a list, and the packet goes on.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::{Answers, Reals};
use super::ray_fan::LANES;

/// Entries from which on a list is worked off.
pub const FULL: usize = 1024;

/// Most that is added between two looks at the length: two packets of sixteen, through eight texels each.
const SLACK: usize = 2 * LANES * (8 + 1);

/// Lit runs: a segment's number, and from where to where in its parameter s.
#[derive(Debug, Clone)]
pub struct Runs {
    segments: Vec<u32>,
    from: Vec<f32>,
    to: Vec<f32>,
    count: usize,
}

/// Blocks of 4×4 texels: a segment's number, the texel where it comes in (column | row << 16), and from where to where.
#[derive(Debug, Clone)]
pub struct Blocks {
    segments: Vec<u32>,
    texels: Vec<u32>,
    from: Vec<f32>,
    to: Vec<f32>,
    count: usize,
}

impl Default for Runs {
    fn default() -> Self {
        let length = FULL + SLACK;
        Self { segments: vec![0; length], from: vec![0.0; length], to: vec![0.0; length], count: 0 }
    }
}

impl Default for Blocks {
    fn default() -> Self {
        let length = FULL + SLACK;
        Self {
            segments: vec![0; length],
            texels: vec![0; length],
            from: vec![0.0; length],
            to: vec![0.0; length],
            count: 0,
        }
    }
}

impl Runs {
    /// Adds the lanes that the mask names.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, mask: Answers<S>, segments: u32x16<S>, from: Reals<S>, to: Reals<S>) {
        let added = mask.to_bitmask().count_ones() as usize;
        if added == 0 {
            return;
        }
        let at = self.count..self.count + LANES;
        segments.compress(mask).store_slice(&mut self.segments[at.clone()]);
        from.compress(mask).store_slice(&mut self.from[at.clone()]);
        to.compress(mask).store_slice(&mut self.to[at]);
        self.count += added;
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
        segments[..count].copy_from_slice(&self.segments[at..][..count]);
        from[..count].copy_from_slice(&self.from[at..][..count]);
        to[..count].copy_from_slice(&self.to[at..][..count]);
        (segments, from, to)
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Bytes that the list holds.
    pub fn memory_bytes(&self) -> u64 {
        (3 * self.segments.capacity() * size_of::<u32>()) as u64
    }
}

impl Blocks {
    /// Adds the lanes that the mask names.
    #[inline(always)]
    pub fn push<S: Simd>(
        &mut self,
        mask: Answers<S>,
        segments: u32x16<S>,
        texels: u32x16<S>,
        from: Reals<S>,
        to: Reals<S>,
    ) {
        let added = mask.to_bitmask().count_ones() as usize;
        if added == 0 {
            return;
        }
        let at = self.count..self.count + LANES;
        segments.compress(mask).store_slice(&mut self.segments[at.clone()]);
        texels.compress(mask).store_slice(&mut self.texels[at.clone()]);
        from.compress(mask).store_slice(&mut self.from[at.clone()]);
        to.compress(mask).store_slice(&mut self.to[at]);
        self.count += added;
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
        (4 * self.segments.capacity() * size_of::<u32>()) as u64
    }
}
