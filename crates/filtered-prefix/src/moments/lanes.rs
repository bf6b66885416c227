//! In what moments are solved: eight f64 side by side where errors are certified, sixteen f32 where nothing is promised.
//!
//! The biases of the papers are those for f32 on a GPU: they outweigh what rounding stored moments to f32 does to the Hankel matrix,
//! which is as much as solving in f32 adds with four or six moments (test `f32_errs_hardly_more_than_f64`). What differs is where numbers
//! are taken to be nothing.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, f64x8};

/// Numbers side by side, with their limits.
pub trait Lanes<S: Simd>: SimdFloat<S> {
    /// Smallest pivot of the Hankel matrix: far below the smallest bias, and where it can be above the rounding.
    const LEAST_PIVOT: f64;
    /// Smallest divisor of what may be 0.
    const TINY: f64;
    /// A leading coefficient that is smaller than this part of the largest one is taken to be as large: the root that it sends
    /// away lies beyond everything that has a weight.
    const LEAST_LEADING: f64;
    /// Roots beyond are taken there.
    const FARTHEST: f64;
    /// Newton's steps of a root beside a degree of 2: what closed forms lose beside a root far away.
    const STEPS: usize;
    /// Newton's steps to a third of an angle's cosine, from within 0.006; each about squares what is missing.
    const CUBIC_STEPS: usize;

    /// One number in all lanes.
    fn of(simd: S, value: f64) -> Self;

    /// `self − a·b`: certificates with two roundings, the same on every CPU; the rest with one where there is such an instruction.
    fn less_product(self, a: Self, b: Self) -> Self;
}

impl<S: Simd> Lanes<S> for f64x8<S> {
    const LEAST_PIVOT: f64 = 1e-13;
    const TINY: f64 = 1e-200;
    const LEAST_LEADING: f64 = 1e-9;
    const FARTHEST: f64 = 1e6;
    const STEPS: usize = 1;
    const CUBIC_STEPS: usize = 3;

    #[inline(always)]
    fn of(simd: S, value: f64) -> Self {
        Self::splat(simd, value)
    }

    #[inline(always)]
    fn less_product(self, a: Self, b: Self) -> Self {
        self - a * b
    }
}

impl<S: Simd> Lanes<S> for f32x16<S> {
    const LEAST_PIVOT: f64 = 3e-8;
    const TINY: f64 = 1e-30;
    const LEAST_LEADING: f64 = 1e-5;
    const FARTHEST: f64 = 1e3;
    const STEPS: usize = 1;
    const CUBIC_STEPS: usize = 1;

    #[inline(always)]
    fn of(simd: S, value: f64) -> Self {
        Self::splat(simd, value as f32)
    }

    #[inline(always)]
    fn less_product(self, a: Self, b: Self) -> Self {
        (-a).mul_add(b, self)
    }
}
