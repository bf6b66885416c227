//! A segment: the part of a view ray inside of one layer, as the traversal reads it; a cache line.
//!
//! Everything is relative to the segment's own start, which is computed in f64: an error of f32 is one of the segment's
//! length, not of the way from the eye. Directions are mirrored so that both indices grow along the ray: a mirrored axis
//! counts from the far end of the power of two ≥ the map's side, where the index of a block is the true one with all bits
//! flipped.
//!
//! Along a segment texel coordinates and the depth's code are linear in one parameter s. Under a parallel map that is the
//! camera's depth. Under a perspective one, with w the depth in the map,
//!
//! ```text
//!     s = δ/w(δ),   u = u₀ + s·(u̇ − u₀·ẇ),   −1/w = −1/w₀ + s·ẇ/w₀,   δ = s·w₀/(1 − s·ẇ)
//! ```
//!
//! for the depth δ behind the start, u̇ and ẇ the homogeneous coordinates' steps: a projective line, so that one traversal
//! serves suns and lamps.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::{Indices, Reals, transpose};
use super::ray_fan::LANES;

/// A segment as sixteen words; [`Word`] says which is what.
pub type Segment = [u32; LANES];

/// The words of a [`Segment`]; f32 as its bits.
#[derive(Debug, Clone, Copy)]
pub enum Word {
    /// The first texel, mirrored: column | row << 16.
    Texel,
    /// What mirrors: bits that are flipped, as `Texel`.
    Mirror,
    /// The start's place in the first texel, [0, 1): column's, row's.
    PlaceU,
    PlaceV,
    /// Texels a unit of s, ≥ 0.
    StepU,
    StepV,
    /// Units of s a texel.
    PerU,
    PerV,
    /// The depth's code at the start, and its step.
    Code,
    CodeStep,
    /// s at the end.
    End,
    /// Depth at the start, what f32 rounded off of it, and units of s (perspective: of δ) a unit of depth.
    Depth,
    DepthRest,
    PerDepth,
    /// s at the border before the first texel, ≤ 0: column's, row's.
    BorderU,
    BorderV,
}

/// What the pixel of a segment adds up, as runs read it: less than a segment, so that a tile's fit the innermost cache.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// The pixel's number in its tile.
    pub pixel: u32,
    /// The camera's depth at the segment's start.
    pub depth: f32,
}

/// Sixteen segments side by side, a vector a word.
#[derive(Clone, Copy)]
pub struct Columns<S: Simd>(pub [u32x16<S>; LANES]);

impl<S: Simd> Columns<S> {
    /// Of the segments with these numbers.
    #[inline(always)]
    pub fn gathered(simd: S, segments: &[Segment], numbers: &[u32]) -> Self {
        let (numbers, last) = (&numbers[..LANES], segments.len() - 1);
        let mut rows = [u32x16::splat(simd, 0); LANES];
        for lane in 0..LANES {
            rows[lane] = u32x16::load_array_ref(simd, &segments[(numbers[lane] as usize).min(last)]);
        }
        transpose(&mut rows);
        Self(rows)
    }

    /// Of the segments from a number on; the list must go on for sixteen.
    #[inline(always)]
    pub fn from(simd: S, segments: &[Segment], first: usize) -> Self {
        let segments = &segments[first..][..LANES];
        let mut rows = [u32x16::splat(simd, 0); LANES];
        for lane in 0..LANES {
            rows[lane] = u32x16::load_array_ref(simd, &segments[lane]);
        }
        transpose(&mut rows);
        Self(rows)
    }

    /// A word that is a number.
    #[inline(always)]
    pub fn real(&self, word: Word) -> Reals<S> {
        self.0[word as usize].bitcast()
    }

    /// Column and row of a word that holds both.
    #[inline(always)]
    pub fn pair(&self, word: Word) -> [Indices<S>; 2] {
        let both = self.0[word as usize];
        [(both & 0xFFFF).bitcast(), (both >> 16).bitcast()]
    }
}
