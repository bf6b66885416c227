//! Sixteen numbers at a time: what the traversal's packets are made of.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x16};

use super::ray_fan::LANES;
use crate::depth_codes::LAST;

/// A number for each lane.
pub type Reals<S> = f32x16<S>;
/// An index for each lane.
pub type Indices<S> = i32x16<S>;
/// An answer for each lane.
pub type Answers<S> = mask32x16<S>;

/// The same number in every lane.
#[inline(always)]
pub fn real<S: Simd>(simd: S, value: f32) -> Reals<S> {
    Reals::splat(simd, value)
}

/// The same index in every lane.
#[inline(always)]
pub fn index<S: Simd>(simd: S, value: i32) -> Indices<S> {
    Indices::splat(simd, value)
}

/// The first `count` lanes.
#[inline(always)]
pub fn first_lanes<S: Simd>(simd: S, count: usize) -> Answers<S> {
    let bits = if count >= LANES { 0xFFFF } else { (1u64 << count) - 1 };
    Answers::from_bitmask(simd, bits)
}

/// Whether lanes are compressed by one instruction: elsewhere each is moved by itself.
#[inline(always)]
pub fn compresses_at_once<S: Simd>(simd: S) -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        simd.level().as_avx512().is_some()
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        let _ = simd;
        false
    }
}

/// Rays' codes as they are compared with nodes'.
#[inline(always)]
pub fn clamped<S: Simd>(simd: S, code: Reals<S>) -> Reals<S> {
    code.max(real(simd, 0.5)).min(real(simd, LAST - 0.5))
}

/// Rows become columns, in place: four perfect shuffles of sixteen rows.
#[inline(always)]
pub fn transpose<S: Simd>(rows: &mut [u32x16<S>; LANES]) {
    shuffle(rows);
    shuffle(rows);
    shuffle(rows);
    shuffle(rows);
}

/// One of the four. (Loops, not `array::from_fn`: a closure that is not inlined has no vector instructions.)
#[inline(always)]
fn shuffle<S: Simd>(rows: &mut [u32x16<S>; LANES]) {
    let before = *rows;
    for n in 0..LANES / 2 {
        let (a, b) = (before[n], before[n + LANES / 2]);
        rows[2 * n] = a.zip_low(b);
        rows[2 * n + 1] = a.zip_high(b);
    }
}

/// `eˣ` for x ≤ 0, relative error ≤ 3e-7; 0 below −87.3, where f32 has no normal numbers.
#[inline(always)]
fn exp<S: Simd>(simd: S, x: Reals<S>) -> Reals<S> {
    const ROUND: f32 = 12_582_912.0;
    let clamped = x.max(real(simd, -87.3));
    // Adding 1.5·2²³ rounds to an integer and leaves it in the low bits.
    let shifted = clamped.mul_add(real(simd, std::f32::consts::LOG2_E), real(simd, ROUND));
    let n = shifted - ROUND;
    let r = n.mul_add(real(simd, -0.693_359_4), clamped);
    let r = n.mul_add(real(simd, 2.121_944_4e-4), r);
    let mut p = real(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.mul_add(r, real(simd, coefficient));
    }
    let bits: Indices<S> = shifted.bitcast();
    let exponent = ((bits - ROUND.to_bits() as i32) << 23) + 1.0f32.to_bits() as i32;
    x.simd_ge(real(simd, -87.3)).select(p * exponent.bitcast::<Reals<S>>(), real(simd, 0.0))
}

/// `∫ e^{−σs} ds` over the `length` ≥ 0 behind `start` ≥ 0, relative error ≤ 1e-6 + σ·start·2⁻²⁴: `e^{−σ·start}·length·φ(x)`,
/// `φ(x) = (1 − e^{−x})/x`, x = σ·length.
#[inline(always)]
pub fn lit_length<S: Simd>(simd: S, sigma: Reals<S>, start: Reals<S>, length: Reals<S>) -> Reals<S> {
    // An endless ray: e^{−x} is 0, and length/x is 1/σ.
    let length = length.min(real(simd, 1e30));
    let x = sigma * length;
    // The series below ½: the first term left out is x⁸/9! < 1.1e-8.
    let mut phi = real(simd, -1.0 / 40320.0);
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        phi = phi.mul_add(x, real(simd, coefficient));
    }
    let long = x.simd_ge(real(simd, 0.5));
    if long.any_true() {
        phi = long.select((1.0 - exp(simd, -x)) / x, phi);
    }
    // 0·∞ of clear air is nothing that is extinguished.
    exp(simd, -(sigma * start.min(real(simd, 1e30)))) * (length * phi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::{Level, at_level, sun_interval};

    #[test]
    fn rows_become_columns() {
        for simd in [Level::new(), Level::baseline()] {
            at_level!(simd, v => {
                let mut rows = std::array::from_fn(|n| u32x16::from_fn(v, |m| (16 * n + m) as u32));
                transpose(&mut rows);
                for (m, column) in rows.into_iter().enumerate() {
                    assert_eq!(column.to_array(), std::array::from_fn(|n| (16 * n + m) as u32));
                }
            });
        }
    }

    #[test]
    fn lit_lengths_are_those_of_the_exact_form() {
        let mut worst = 0.0f64;
        for simd in [Level::new(), Level::baseline()] {
            for sigma in [0.0f32, 1e-7, 0.01, 0.4, 3.0, 100.0] {
                for start in [0.0f32, 1e-3, 2.0, 11.0] {
                    for length in [1e-6f32, 0.01, 0.7, 1.2, 5.0, 300.0, f32::INFINITY] {
                        if sigma == 0.0 && length == f32::INFINITY {
                            continue;
                        }
                        let mut found = [0.0; 16];
                        at_level!(simd, v => {
                            lit_length(v, real(v, sigma), real(v, start), real(v, length)).store_slice(&mut found);
                        });
                        let (sigma, start) = (f64::from(sigma), f64::from(start));
                        let exact = sun_interval(sigma, start, start + f64::from(length));
                        // b − a is not the length to the last bit where it is short.
                        let exact = if length < 1.0 {
                            sun_interval(sigma, 0.0, length.into()) * (-sigma * start).exp()
                        } else {
                            exact
                        };
                        if exact > 1e-30 {
                            let error = (f64::from(found[3]) / exact - 1.0).abs();
                            worst = worst.max(error / (1e-6 + sigma * start * 2f64.powi(-24)));
                        }
                    }
                }
            }
        }
        println!("worst share of the bound {worst:.2}");
        assert!(worst <= 1.0, "{worst}");
    }
}
