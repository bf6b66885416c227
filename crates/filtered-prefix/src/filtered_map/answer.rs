//! Pixels answered from a filtered map: where each ray ends in it ([`RayEnds`]), a fetch, and what is made of it ([`MapBasis`]).

use epipolar::driver::Shares;
use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, u32x16};
use scatter_core::Frame;

use super::basis::MapBasis;
use super::filter::BESIDE;
use super::numbers::{EIGHT, Number};
use super::places::{Places, RayEnds};

use super::references::References;
use super::row_depths::RowDepths;
use super::strips::Strip;
use super::turned::LANES;
use crate::options::Fetch;
use crate::projective::{OwnMap, Rectification};

/// Pixels that are collected before they are answered.
const WAITING: usize = 256;

/// Texels about a place, of one reference.
const CORNERS: usize = 4;

/// Numbers of the lanes.
const LANE: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Bits of a pixel's column in its packed place `y·2¹⁶ + x`: images have at most 2¹⁶ pixels a side.
const HALF: u32 = 16;

/// What answers the pixels of a frame.
pub struct Answers<'a> {
    frame: &'a Frame<'a>,
    ends: RayEnds<'a>,
    shares: &'a Shares,
    /// References of the map, and those of a pixel: one or two.
    references: usize,
    sides: usize,
    /// Numbers of a texel.
    a_texel: usize,
    width: usize,
    /// Rows of numbers that are kept, less one.
    last_kept: usize,
    is_bilinear: bool,
}

impl<'a> Answers<'a> {
    /// For a frame and its map, with so many numbers of a basis and rows that are kept.
    pub fn new(
        (frame, map, rectification): (&'a Frame<'a>, &OwnMap, &Rectification),
        (row_depths, references): (&'a RowDepths, References),
        (count, kept): (usize, usize),
        fetch: Fetch,
        shares: &'a Shares,
    ) -> Self {
        let is_bilinear = fetch != Fetch::Nearest;
        Self {
            frame,
            ends: RayEnds::new((frame, map, rectification), row_depths, references, is_bilinear),
            shares,
            references: references.count(),
            sides: references.count().min(2),
            a_texel: count + BESIDE,
            width: map.width(),
            last_kept: kept - 1,
            is_bilinear,
        }
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
        &'n self,
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
        (Fetched { map: self, numbers, texels: self.texels(simd, &places) }, places.depths)
    }

    /// The texels about the pixels' places. The means of column i hold up to its far border, so that a ray that ends at i + 1 has
    /// them to itself.
    #[inline(always)]
    fn texels<S: Simd>(&self, simd: S, places: &Places<S>) -> Texels {
        let of = |value: f32| f32x16::splat(simd, value);
        let whole = |value: usize| u32x16::splat(simd, value as u32);
        let (zero, one) = (of(0.0), of(1.0));
        // The first of two neighbours, and the part of the second: all of it beyond the last.
        let (column, u, v) = if self.is_bilinear {
            let at = (places.columns - one).max(zero);
            let column = at.to_int::<u32x16<S>>().min(whole(self.width.saturating_sub(2)));
            (column, (at - column.to_float::<f32x16<S>>()).min(one), places.downs)
        } else {
            (places.columns.to_int::<u32x16<S>>().min(whole(self.width - 1)), zero, zero)
        };
        let mut texels = Texels { first: [[0; LANES]; 2], weights: [[0.0; LANES]; 2 * CORNERS] };
        let column = column + places.is_far.select(whole(self.width), whole(0));
        let a_row = whole(self.references * self.width);
        for (row, first) in [places.rows, places.rows + 1].into_iter().zip(&mut texels.first) {
            ((row & self.last_kept as u32) * a_row + column).store_slice(first);
        }
        let (up, down) = (one - v, v);
        let corners = [(one - u) * up, u * up, (one - u) * down, u * down];
        let (near, far) = (one - places.parts, places.parts);
        for (corner, &weight) in corners.iter().enumerate() {
            (weight * near).store_slice(&mut texels.weights[corner]);
            (weight * far).store_slice(&mut texels.weights[CORNERS + corner]);
        }
        texels
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

/// Four texels about each of some pixels' places, of each of its references.
struct Texels {
    /// The first ones of the two rows, and of the first reference.
    first: [[u32; LANES]; 2],
    weights: [[f32; LANES]; 2 * CORNERS],
}

/// What pixels fetch.
pub struct Fetched<'a, T> {
    map: &'a Answers<'a>,
    numbers: &'a [T],
    texels: Texels,
}

impl<T: Number> Fetched<'_, T> {
    /// The numbers at a pixel's place, blended: as many as `means` has, of which those of the basis mean something.
    #[inline(always)]
    pub fn means<S: Simd>(&self, simd: S, lane: usize, means: &mut [f32]) {
        let Answers { a_texel, width, sides, .. } = *self.map;
        let Texels { first, weights } = &self.texels;
        let right = if self.map.is_bilinear && width > 1 { a_texel } else { 0 };
        let (up, down) = (first[0][lane] as usize * a_texel, first[1][lane] as usize * a_texel);
        for (block, means) in means.chunks_exact_mut(EIGHT).enumerate() {
            let add = |sum: f32x8<S>, texel: usize, corner: usize| {
                let weight = f32x8::splat(simd, weights[corner][lane]);
                T::eight(simd, &self.numbers[texel..][..EIGHT]).mul_add(weight, sum)
            };
            let mut rows = [f32x8::splat(simd, 0.0); 2];
            for side in 0..sides {
                let (from, corner) = (side * width * a_texel + block * EIGHT, side * CORNERS);
                rows[0] = add(rows[0], up + from, corner);
                rows[0] = add(rows[0], up + from + right, corner + 1);
                rows[1] = add(rows[1], down + from, corner + 2);
                rows[1] = add(rows[1], down + from + right, corner + 3);
            }
            (rows[0] + rows[1]).store_slice(means);
        }
    }
}
