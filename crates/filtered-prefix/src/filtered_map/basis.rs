//! The bases of a filtered map: what is kept of a row, and how pixels' shares follow from what they fetched, by a dot product of a
//! series, or the bounds of a few moments.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, f64x8};

use super::fetched::Fetched;
use super::filter::{BESIDE, MARGIN, MOST, RowFilter, place};
use super::numbers::{EIGHT, Number};
use super::turned::{LANES, by_number};
use crate::fourier::harmonics;
use crate::moments::{Lanes, MOST_POWERS, Two, bias_of, mass_below};
use crate::storage::Storage;

/// A basis: what of a row is kept for it, and how fetched numbers are turned into shares.
pub trait MapBasis: Sync {
    /// Fills the numbers of a row.
    fn filter<S: Simd, T: Number>(&self, simd: S, filter: &RowFilter<'_>, row: usize, numbers: &mut [T]);

    /// The shares of twice sixteen pixels whose depths among the row's view rays are given; the series' may lie outside of 0 to 1.
    fn shares<S: Simd, T: Number>(
        &self,
        simd: S,
        fetched: &[Fetched<'_, T>; 2],
        depths: [f32x16<S>; 2],
    ) -> [f32x16<S>; 2];
}

/// From a Fourier series of so many coefficients (Klehm et al. 2014, Listing 4, with `1 − e^{−dσ}` in the closed form that the share is
/// multiplied by).
pub struct Series {
    pub count: usize,
}

impl MapBasis for Series {
    #[inline(always)]
    fn filter<S: Simd, T: Number>(&self, _: S, filter: &RowFilter<'_>, row: usize, numbers: &mut [T]) {
        filter.fourier(row, self.count, numbers);
    }

    #[inline(always)]
    fn shares<S: Simd, T: Number>(
        &self,
        simd: S,
        fetched: &[Fetched<'_, T>; 2],
        depths: [f32x16<S>; 2],
    ) -> [f32x16<S>; 2] {
        let mut shares = depths;
        for (share, fetched) in shares.iter_mut().zip(fetched) {
            *share = self.sixteen(simd, fetched, *share);
        }
        shares
    }
}

impl Series {
    #[inline(always)]
    fn sixteen<S: Simd, T: Number>(&self, simd: S, fetched: &Fetched<'_, T>, depths: f32x16<S>) -> f32x16<S> {
        let count = self.count + BESIDE;
        let mut of_pixel = [0.0f32; MOST + EIGHT];
        let mut means = [[0.0f32; LANES]; MOST + BESIDE];
        for lane in 0..LANES {
            let of_pixel = &mut of_pixel[..count.next_multiple_of(EIGHT)];
            fetched.means(simd, lane, of_pixel);
            for (means, &mean) in means[..count].iter_mut().zip(&*of_pixel) {
                means[lane] = mean;
            }
        }
        let mut at = [0.0f32; LANES];
        depths.store_slice(&mut at);
        let mut out = [0.0f32; LANES];
        for lane in 0..LANES {
            out[lane] = means[0][lane] + 0.5 * means[1][lane];
        }
        harmonics(&at.map(place), self.count / 2, |k, sines, cosines| {
            let factor = 2.0 / ((2 * k + 1) as f32 * std::f32::consts::PI);
            let (own, other) = (&means[2 * k + BESIDE], &means[2 * k + 1 + BESIDE]);
            for lane in 0..LANES {
                out[lane] += factor * (cosines[lane] * own[lane] - sines[lane] * other[lane]);
            }
        });
        // The series overshoots by a part of what is in doubt.
        for lane in 0..LANES {
            out[lane] = out[lane].clamp(means[0][lane], means[0][lane] + means[1][lane].max(0.0));
        }
        f32x16::from_slice(simd, &out)
    }
}

/// From moments (Peters et al. 2016): N is half their number, A all numbers of a texel, P room for
/// them, a power of two.
pub struct Moments<const N: usize, const A: usize, const P: usize> {
    bias: f64,
}

impl<const N: usize, const A: usize, const P: usize> Moments<N, A, P> {
    /// Of moments that are kept in a storage.
    pub fn new(storage: Storage) -> Self {
        let bias = bias_of(2 * N as u32);
        match storage {
            Storage::F32 => Self { bias },
            Storage::F16 | Storage::U8 => Self { bias: (bias * 6000.0).min(0.2) },
        }
    }
}

impl<const N: usize, const A: usize, const P: usize> MapBasis for Moments<N, A, P> {
    #[inline(always)]
    fn filter<S: Simd, T: Number>(&self, simd: S, filter: &RowFilter<'_>, row: usize, numbers: &mut [T]) {
        filter.moments::<T, A, P, S>(simd, row, numbers);
    }

    #[inline(always)]
    fn shares<S: Simd, T: Number>(
        &self,
        simd: S,
        fetched: &[Fetched<'_, T>; 2],
        depths: [f32x16<S>; 2],
    ) -> [f32x16<S>; 2] {
        let mut numbers = [[f32x16::splat(simd, 0.0); P]; 2];
        for (numbers, fetched) in numbers.iter_mut().zip(fetched) {
            let mut means = [[0.0f32; P]; LANES];
            for (lane, means) in means.iter_mut().enumerate() {
                fetched.means(simd, lane, means);
            }
            *numbers = by_number(simd, &means);
        }
        let of = |value: f64| Two::<f32x16<S>>::of(simd, value);
        let number = |index: usize| Two([numbers[0][index], numbers[1][index]]);
        let doubt = number(1).max(of(0.0));
        let inverse = of(1.0) / doubt.max(of(1e-12));
        let mut moments = [of(1.0); MOST_POWERS];
        for (index, moment) in moments[1..=2 * N].iter_mut().enumerate() {
            *moment = number(BESIDE + index) * inverse;
        }
        // The depths' places in the range of moments.
        let margin = f64::from(MARGIN);
        let z = Two(depths).mul_add(of(2.0 - 4.0 * margin), of(2.0 * margin - 1.0));
        let dark = middle::<N, _>(simd, &moments, z, self.bias);
        (number(0) + doubt * (of(1.0) - dark).max(of(0.0))).0
    }
}

/// The middle of the bounds of the mass below z: in f32, but of eight moments, whose smallest pivots f32 does not resolve.
#[inline(always)]
fn middle<const N: usize, S: Simd>(
    simd: S,
    moments: &[Two<f32x16<S>>; MOST_POWERS],
    z: Two<f32x16<S>>,
    bias: f64,
) -> Two<f32x16<S>> {
    if N < 4 {
        let bounds = mass_below::<N, _, _>(simd, moments, z, bias);
        return bounds.least + bounds.width * Two::of(simd, 0.5);
    }
    let mut out = z;
    for (one, out) in out.0.iter_mut().enumerate() {
        let mut wide = [Two::of(simd, 1.0); MOST_POWERS];
        for (wide, moment) in wide.iter_mut().zip(moments) {
            *wide = widened(simd, moment.0[one]);
        }
        let bounds = mass_below::<N, _, _>(simd, &wide, widened(simd, z.0[one]), bias);
        let middle = bounds.least + bounds.width * Two::of(simd, 0.5);
        let mut narrow = [0.0f32; LANES];
        for (narrow, middle) in narrow.chunks_exact_mut(LANES / 2).zip(middle.0) {
            for (narrow, &middle) in narrow.iter_mut().zip(middle.as_slice()) {
                *narrow = middle as f32;
            }
        }
        *out = f32x16::from_slice(simd, &narrow);
    }
    out
}

/// Sixteen f32 as f64.
#[inline(always)]
fn widened<S: Simd>(simd: S, numbers: f32x16<S>) -> Two<f64x8<S>> {
    let mut values = [0.0f64; LANES];
    for (value, &number) in values.iter_mut().zip(numbers.as_slice()) {
        *value = f64::from(number);
    }
    let (low, high) = values.split_at(LANES / 2);
    Two([f64x8::from_slice(simd, low), f64x8::from_slice(simd, high)])
}
