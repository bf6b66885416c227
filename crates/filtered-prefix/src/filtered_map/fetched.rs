//! The fetch: which texels lie about the places of sixteen pixels, by which weights, and the numbers that they have together.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, u32x16};

use super::numbers::{EIGHT, Number};
use super::places::Places;
use super::turned::LANES;

/// Texels about a place, of one reference.
const CORNERS: usize = 4;

/// How the numbers of a strip lie, `[row % kept][reference][column][number]`, and how they are read.
#[derive(Debug, Clone, Copy)]
pub struct TexelLayout {
    /// References of the map, and those of a pixel: one or two.
    pub references: usize,
    pub sides: usize,
    /// Numbers of a texel.
    pub a_texel: usize,
    pub width: usize,
    /// Rows of numbers that are kept, less one.
    pub last_kept: usize,
    /// Whether pixels blend two columns, and two rows.
    pub blends_columns: bool,
    pub blends_rows: bool,
}

/// Four texels about each of some pixels' places, of each of its references.
struct Texels {
    /// The first ones of the two rows, and of the first reference.
    first: [[u32; LANES]; 2],
    weights: [[f32; LANES]; 2 * CORNERS],
}

impl Texels {
    /// The texels about the pixels' places. The means of column i hold up to its far border, so that a ray that ends at i + 1 has
    /// them to itself.
    #[inline(always)]
    fn of<S: Simd>(simd: S, layout: TexelLayout, places: &Places<S>) -> Self {
        let of = |value: f32| f32x16::splat(simd, value);
        let whole = |value: usize| u32x16::splat(simd, value as u32);
        let (zero, one) = (of(0.0), of(1.0));
        // The first of two neighbours, and the part of the second: all of it beyond the last.
        let (column, u) = if layout.blends_columns {
            let at = (places.columns - one).max(zero);
            let column = at.to_int::<u32x16<S>>().min(whole(layout.width.saturating_sub(2)));
            (column, (at - column.to_float::<f32x16<S>>()).min(one))
        } else {
            (places.columns.to_int::<u32x16<S>>().min(whole(layout.width - 1)), zero)
        };
        let v = if layout.blends_rows { places.downs } else { zero };
        let mut texels = Self { first: [[0; LANES]; 2], weights: [[0.0; LANES]; 2 * CORNERS] };
        let column = column + places.is_far.select(whole(layout.width), whole(0));
        let a_row = whole(layout.references * layout.width);
        let next = places.rows + u32::from(layout.blends_rows);
        for (row, first) in [places.rows, next].into_iter().zip(&mut texels.first) {
            ((row & layout.last_kept as u32) * a_row + column).store_slice(first);
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

/// What pixels fetch.
pub struct Fetched<'a, T> {
    layout: TexelLayout,
    numbers: &'a [T],
    texels: Texels,
}

impl<'a, T: Number> Fetched<'a, T> {
    /// Of sixteen pixels, from the numbers `[row % kept][reference][column][number]` of a strip.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, layout: TexelLayout, numbers: &'a [T], places: &Places<S>) -> Self {
        Self { layout, numbers, texels: Texels::of(simd, layout, places) }
    }

    /// The numbers at a pixel's place, blended: as many as `means` has, of which those of the basis mean something.
    #[inline(always)]
    pub fn means<S: Simd>(&self, simd: S, lane: usize, means: &mut [f32]) {
        let TexelLayout { a_texel, width, sides, blends_columns, .. } = self.layout;
        let Texels { first, weights } = &self.texels;
        let right = if blends_columns && width > 1 { a_texel } else { 0 };
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
