//! Pixels answered from a filtered map: where each ray ends in it ([`RayEnds`]), a fetch, and what is made of it ([`MapBasis`]).

use epipolar::driver::Shares;
use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use scatter_core::Frame;

use super::basis::MapBasis;
use super::fetched::{Fetched, TexelLayout};
use super::numbers::Number;
use super::places::RayEnds;

use super::references::References;
use super::row_depths::RowDepths;
use super::strips::Strip;
use super::turned::LANES;
use crate::projective::{OwnMap, Rectification};

/// Pixels that are collected before they are answered.
const WAITING: usize = 256;

/// Numbers of the lanes.
const LANE: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Bits of a pixel's column in its packed place `y·2¹⁶ + x`: images have at most 2¹⁶ pixels a side.
const HALF: u32 = 16;

/// What answers the pixels of a frame.
pub struct Answers<'a> {
    frame: &'a Frame<'a>,
    ends: RayEnds<'a>,
    shares: &'a Shares,
    layout: TexelLayout,
}

impl<'a> Answers<'a> {
    /// For a frame and its map, whose strips' numbers lie like that.
    pub fn new(
        shared: (&'a Frame<'a>, &OwnMap, &Rectification),
        (row_depths, references): (&'a RowDepths, References),
        layout: TexelLayout,
        shares: &'a Shares,
    ) -> Self {
        let ends = RayEnds::new(shared, row_depths, references, layout.blends_rows);
        Self { frame: shared.0, ends, shares, layout }
    }

    /// Answers the pixels of a strip from its rows' numbers, `[row % kept][reference][column][number]`.
    #[inline(always)]
    pub fn strip<S: Simd, T: Number>(&self, simd: S, strip: &Strip, numbers: &[T], basis: &impl MapBasis) {
        let [width, height] = self.frame.size().map(|side| side as usize);
        let depth = self.frame.depth().texels();
        let mut pixels = Pixels::default();
        let lane = u32x16::from_slice(simd, &LANE);
        for y in 0..height {
            let [mut x, end] = strip.columns(y);
            while x < end {
                let first = y * width + x;
                (lane + first as u32).store_slice(&mut pixels.index[pixels.count..][..LANES]);
                let packed = (y as u32) << HALF | x as u32;
                (lane + packed).store_slice(&mut pixels.packed[pixels.count..][..LANES]);
                let ends = &mut pixels.ends[pixels.count..][..LANES];
                match depth.get(first..first + LANES) {
                    Some(depth) => ends.copy_from_slice(depth),
                    None => ends[..depth.len() - first].copy_from_slice(&depth[first..]),
                }
                let taken = (end - x).min(LANES);
                (x, pixels.count) = (x + taken, pixels.count + taken);
                if pixels.count > WAITING {
                    let whole = pixels.count / (2 * LANES) * (2 * LANES);
                    self.pixels(simd, strip, (&pixels, whole), numbers, basis);
                    pixels.shift(whole);
                }
            }
        }
        self.pixels(simd, strip, (&pixels, pixels.count), numbers, basis);
    }

    /// Answers the first `count` pixels, twice sixteen at a time.
    #[inline(always)]
    fn pixels<S: Simd, T: Number>(
        &self,
        simd: S,
        strip: &Strip,
        (pixels, count): (&Pixels, usize),
        numbers: &[T],
        basis: &impl MapBasis,
    ) {
        for first in (0..count).step_by(2 * LANES) {
            let (one, depths_of_one) = self.fetched(simd, strip, (pixels, first), numbers);
            let (two, depths_of_two) = self.fetched(simd, strip, (pixels, first + LANES), numbers);
            let shares = basis.shares(simd, &[one, two], [depths_of_one, depths_of_two]);
            let zero = f32x16::splat(simd, 0.0);
            for (half, share) in shares.into_iter().enumerate() {
                // The series overshoots; NaN is nobody's share.
                let share = share.simd_gt(zero).select(share.min(f32x16::splat(simd, 1.0)), zero);
                let first = (first + half * LANES).min(count);
                for (&pixel, &share) in pixels.index[first..count].iter().zip(share.as_slice()) {
                    self.shares.put(pixel as usize, 0, share);
                }
            }
        }
    }

    /// What sixteen pixels fetch, and their depths among the row's view rays.
    #[inline(always)]
    fn fetched<'n, S: Simd, T: Number>(
        &self,
        simd: S,
        strip: &Strip,
        (pixels, first): (&Pixels, usize),
        numbers: &'n [T],
    ) -> (Fetched<'n, T>, f32x16<S>) {
        let packed = u32x16::from_slice(simd, &pixels.packed[first..][..LANES]);
        let x = (packed & ((1 << HALF) - 1)).to_float::<f32x16<S>>();
        let y = (packed >> HALF).to_float::<f32x16<S>>();
        let limit = f32x16::splat(simd, self.frame.max_distance() as f32);
        let ends = f32x16::from_slice(simd, &pixels.ends[first..][..LANES]).min(limit);
        let rows = [strip.first as u32, strip.end as u32 - 1];
        let places = self.ends.find(simd, [x, y], ends, rows);
        (Fetched::new(simd, self.layout, numbers, &places), places.depths)
    }
}

/// Pixels that wait until there are many, as runs of image rows come: read at once, what was written in pieces has to be put together
/// first, which takes a CPU longer than to write it out and read it later. What lies behind the last one is any pixel's or 0.
struct Pixels {
    count: usize,
    /// Places in the image, `y·width + x` and `y·2¹⁶ + x`, and depths.
    index: [u32; WAITING + 3 * LANES],
    packed: [u32; WAITING + 3 * LANES],
    ends: [f32; WAITING + 3 * LANES],
}

impl Default for Pixels {
    fn default() -> Self {
        const ROOM: usize = WAITING + 3 * LANES;
        Self { count: 0, index: [0; ROOM], packed: [0; ROOM], ends: [0.0; ROOM] }
    }
}

impl Pixels {
    /// Takes the first ones away.
    #[inline(always)]
    fn shift(&mut self, answered: usize) {
        self.index.copy_within(answered..self.count, 0);
        self.packed.copy_within(answered..self.count, 0);
        self.ends.copy_within(answered..self.count, 0);
        self.count -= answered;
    }
}
