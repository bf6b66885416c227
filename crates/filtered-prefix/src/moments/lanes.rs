//! In what moments are solved: eight f64 side by side where errors are certified, sixteen f32 where nothing is promised, or two of either.
//!
//! The biases of the papers are those for f32 on a GPU: they outweigh what rounding stored moments to f32 does to the Hankel matrix,
//! which is as much as solving in f32 adds with four or six moments (test `f32_errs_hardly_more_than_f64`). What differs is where numbers
//! are taken to be nothing.

use std::ops::{Add, Div, Mul, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, f64x8};

/// Numbers side by side, with their limits.
pub trait Lanes<S: Simd>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
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

    /// `self·a + b`, with one rounding where there is such an instruction.
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// The larger of two.
    fn max(self, other: Self) -> Self;

    /// The smaller of two.
    fn min(self, other: Self) -> Self;

    /// Without its sign.
    fn abs(self) -> Self;

    /// With the sign of another.
    fn copysign(self, sign: Self) -> Self;

    /// The square root of what is ≥ 0.
    fn sqrt(self) -> Self;

    /// `value` where `self` is below a limit, elsewhere 0.
    fn below(self, limit: Self, value: Self) -> Self;
}

/// What both kinds of numbers do by their own operations.
macro_rules! own_operations {
    ($number:ty) => {
        #[inline(always)]
        fn of(simd: S, value: f64) -> Self {
            Self::splat(simd, value as $number)
        }

        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            <Self as SimdFloat<S>>::mul_add(self, a, b)
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            <Self as SimdBase<S>>::max(self, other)
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            <Self as SimdBase<S>>::min(self, other)
        }

        #[inline(always)]
        fn abs(self) -> Self {
            <Self as SimdBase<S>>::abs(self)
        }

        #[inline(always)]
        fn copysign(self, sign: Self) -> Self {
            <Self as SimdFloat<S>>::copysign(self, sign)
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            <Self as SimdFloat<S>>::sqrt(self)
        }

        #[inline(always)]
        fn below(self, limit: Self, value: Self) -> Self {
            self.simd_lt(limit).select(value, Self::splat(self.simd, 0.0))
        }
    };
}

impl<S: Simd> Lanes<S> for f64x8<S> {
    const LEAST_PIVOT: f64 = 1e-13;
    const TINY: f64 = 1e-200;
    const LEAST_LEADING: f64 = 1e-9;
    const FARTHEST: f64 = 1e6;
    const STEPS: usize = 1;
    const CUBIC_STEPS: usize = 3;

    own_operations!(f64);

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

    own_operations!(f32);

    #[inline(always)]
    fn less_product(self, a: Self, b: Self) -> Self {
        <Self as SimdFloat<S>>::mul_add(-a, b, self)
    }
}

/// Two vectors that are solved together: one system is a chain of some fifteen divisions and roots that wait for each other, and a CPU does
/// the other's meanwhile.
#[derive(Clone, Copy)]
pub struct Two<V>(pub [V; 2]);

/// Operators of both. (Functions that are handed over as values would be called where these are not.)
macro_rules! operators {
    ($($operator:ident $method:ident $sign:tt),*) => {$(
        impl<V: Copy + $operator<Output = V>> $operator for Two<V> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self([self.0[0] $sign other.0[0], self.0[1] $sign other.0[1]])
            }
        }
    )*};
}

operators!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<S: Simd, V: Lanes<S>> Lanes<S> for Two<V> {
    const LEAST_PIVOT: f64 = V::LEAST_PIVOT;
    const TINY: f64 = V::TINY;
    const LEAST_LEADING: f64 = V::LEAST_LEADING;
    const FARTHEST: f64 = V::FARTHEST;
    const STEPS: usize = V::STEPS;
    const CUBIC_STEPS: usize = V::CUBIC_STEPS;

    #[inline(always)]
    fn of(simd: S, value: f64) -> Self {
        Self([V::of(simd, value); 2])
    }

    #[inline(always)]
    fn less_product(self, a: Self, b: Self) -> Self {
        Self([self.0[0].less_product(a.0[0], b.0[0]), self.0[1].less_product(a.0[1], b.0[1])])
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self([self.0[0].mul_add(a.0[0], b.0[0]), self.0[1].mul_add(a.0[1], b.0[1])])
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self([self.0[0].max(other.0[0]), self.0[1].max(other.0[1])])
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].min(other.0[1])])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self([self.0[0].abs(), self.0[1].abs()])
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self([self.0[0].copysign(sign.0[0]), self.0[1].copysign(sign.0[1])])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([self.0[0].sqrt(), self.0[1].sqrt()])
    }

    #[inline(always)]
    fn below(self, limit: Self, value: Self) -> Self {
        Self([self.0[0].below(limit.0[0], value.0[0]), self.0[1].below(limit.0[1], value.0[1])])
    }
}
