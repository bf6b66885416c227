//! Sixteen numbers at a time: the functions that the marcher's inner loops are made of.
//!
//! The vector type is that of `fearless_simd`; each function is compiled once for every instruction set and chosen
//! when the marcher is made. Without fused multiply-add (the portable path) results differ in rounding alone.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, mask32x16, u32x16};

/// Pixels of a packet: one AVX-512 register, two AVX2 ones, four SSE2 or NEON ones.
pub const LANES: usize = 16;

/// One number for each pixel of a packet.
pub type Lanes<S> = f32x16<S>;
/// One answer for each pixel of a packet.
pub type LaneMask<S> = mask32x16<S>;

/// `values` in a register.
#[inline(always)]
pub fn load<S: Simd>(simd: S, values: &[f32; LANES]) -> Lanes<S> {
    (*values).simd_into(simd)
}

/// The same number in every lane.
#[inline(always)]
pub fn splat<S: Simd>(simd: S, value: f32) -> Lanes<S> {
    Lanes::splat(simd, value)
}

/// 1 where the mask is set, else 0.
#[inline(always)]
pub fn one_where<S: Simd>(simd: S, mask: LaneMask<S>) -> Lanes<S> {
    mask.select(splat(simd, 1.0), splat(simd, 0.0))
}

/// `eˣ` for x ≤ 0, relative error ≤ 3e-7 (test); 0 below −87.3, where f32 has no normal numbers.
#[inline(always)]
pub fn exp<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    const ROUND: f32 = 12_582_912.0;
    let clamped = x.max(splat(simd, -87.3));
    // Adding 1.5·2²³ rounds to an integer and leaves it in the low bits.
    let shifted = clamped.mul_add(splat(simd, std::f32::consts::LOG2_E), splat(simd, ROUND));
    let n = shifted - ROUND;
    let r = n.mul_add(splat(simd, -0.693_359_4), clamped);
    let r = n.mul_add(splat(simd, 2.121_944_4e-4), r);
    let mut p = splat(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.mul_add(r, splat(simd, coefficient));
    }
    let bits: i32x16<S> = shifted.bitcast();
    let exponent = ((bits - ROUND.to_bits() as i32) << 23) + 1.0f32.to_bits() as i32;
    x.simd_ge(splat(simd, -87.3)).select(p * exponent.bitcast::<Lanes<S>>(), splat(simd, 0.0))
}

/// `(sin x, cos x)` for x in [0, π/2], absolute error ≤ 2e-7, the sine's relative error ≤ 2e-7 (test).
#[inline(always)]
pub fn sin_cos<S: Simd>(simd: S, x: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    // Taylor: the terms left out are x¹³/13! ≤ 6e-8 and x¹⁴/14! ≤ 7e-9.
    let square = x * x;
    let mut sine = splat(simd, -1.0 / 39_916_800.0);
    for coefficient in [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0] {
        sine = sine.mul_add(square, splat(simd, coefficient));
    }
    let mut cosine = splat(simd, 1.0 / 479_001_600.0);
    for coefficient in [-1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5, 1.0] {
        cosine = cosine.mul_add(square, splat(simd, coefficient));
    }
    (sine * x, cosine)
}

/// The angle in [0, π] of the point `(x, y)` with y ≥ 0, absolute error ≤ 4e-7 (test); 0 at the origin.
#[inline(always)]
pub fn upper_angle<S: Simd>(simd: S, y: Lanes<S>, x: Lanes<S>) -> Lanes<S> {
    let width = x.abs();
    let (least, greatest) = (width.min(y), width.max(y).max(splat(simd, f32::MIN_POSITIVE)));
    // tan(angle) ≤ 1; beyond tan(π/8) the tangent of the angle's difference to π/4 is smaller.
    let steep = (least * 2.414_213_6).simd_gt(greatest);
    let ratio = steep.select(least - greatest, least) / steep.select(least + greatest, greatest);
    let square = ratio * ratio;
    // Taylor to r⁹ on |r| ≤ 0.4142: the term left out is r¹¹/11 = 5.6e-6·0.0… ≤ 6e-6, so one term more.
    let mut p = splat(simd, 1.0 / 13.0);
    for coefficient in [-1.0 / 11.0, 1.0 / 9.0, -1.0 / 7.0, 1.0 / 5.0, -1.0 / 3.0, 1.0] {
        p = p.mul_add(square, splat(simd, coefficient));
    }
    let angle = p * ratio + steep.select(splat(simd, std::f32::consts::FRAC_PI_4), splat(simd, 0.0));
    let angle = y.simd_gt(width).select(splat(simd, std::f32::consts::FRAC_PI_2) - angle, angle);
    x.simd_lt(splat(simd, 0.0)).select(splat(simd, std::f32::consts::PI) - angle, angle)
}

/// A number in [0, 1) from each lane's seed and a step: the same on every machine.
#[inline(always)]
pub fn hashed<S: Simd>(simd: S, seeds: u32x16<S>, step: u32) -> Lanes<S> {
    // The finaliser of Wellons' "hash prospector" (lowbias32).
    let mut x = seeds + step.wrapping_mul(0x9E37_79B9);
    x = (x ^ (x >> 16)) * u32x16::splat(simd, 0x7FEB_352D);
    x = (x ^ (x >> 15)) * u32x16::splat(simd, 0x846C_A68B);
    x = x ^ (x >> 16);
    let high: i32x16<S> = (x >> 8).bitcast();
    // 24 bits: the largest value is 1 − 2⁻²⁴, exactly.
    high.to_float::<Lanes<S>>() * (1.0 / 16_777_216.0)
}

/// [`hashed`] on one seed, for making lane seeds: mixes two words.
pub fn mixed(a: u32, b: u32) -> u32 {
    let mut x = a ^ b.wrapping_mul(0x9E37_79B9).rotate_left(15);
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    /// Applies `f` to sixteen copies of `x` on both paths.
    fn both(x: f32, f: impl Fn(&[f32; LANES], Level) -> [f32; LANES]) -> [f64; 2] {
        [Level::new(), Level::baseline()].map(|simd| f64::from(f(&[x; LANES], simd)[7]))
    }

    #[test]
    fn the_exponential_keeps_its_bound() {
        for i in 0..200_000 {
            let x = -87.0 * (i as f32 / 200_000.0);
            for value in both(x, |x, simd| dispatch!(simd, s => exp(s, load(s, x)).into())) {
                let error = value / f64::from(x).exp() - 1.0;
                assert!(error.abs() < 3e-7, "{x}: {error:e}");
            }
        }
        for value in both(f32::NEG_INFINITY, |x, simd| dispatch!(simd, s => exp(s, load(s, x)).into())) {
            assert_eq!(value, 0.0);
        }
    }

    #[test]
    fn sine_and_cosine_keep_their_bounds() {
        for i in 0..=100_000 {
            let x = std::f32::consts::FRAC_PI_2 * (i as f32 / 100_000.0);
            for value in both(x, |x, simd| dispatch!(simd, s => sin_cos(s, load(s, x)).0.into())) {
                let exact = f64::from(x).sin();
                assert!((value - exact).abs() <= 2e-7 * exact, "sin {x}: {value} {exact}");
            }
            for value in both(x, |x, simd| dispatch!(simd, s => sin_cos(s, load(s, x)).1.into())) {
                assert!((value - f64::from(x).cos()).abs() < 2e-7, "cos {x}: {value}");
            }
        }
    }

    #[test]
    fn angles_keep_their_bound_in_the_whole_half_plane() {
        for i in 0..=100_000 {
            let angle = std::f64::consts::PI * f64::from(i) / 100_000.0;
            for radius in [1e-15, 1.0, 1e15] {
                let (x, y) = ((radius * angle.cos()) as f32, (radius * angle.sin()) as f32);
                let exact = f64::from(y).atan2(f64::from(x));
                for value in
                    both(x, |x, simd| dispatch!(simd, s => upper_angle(s, splat(s, y), load(s, x)).into()))
                {
                    assert!((value - exact).abs() < 4e-7, "{x} {y}: {value} {exact}");
                }
            }
        }
        assert_eq!(
            both(0.0, |x, simd| dispatch!(simd, s => upper_angle(s, load(s, x), load(s, x)).into())),
            [0.0; 2]
        );
    }

    #[test]
    fn hashed_numbers_fill_the_unit_interval_alike_on_both_paths() {
        let mut mean = 0.0;
        for step in 0..10_000 {
            let draw = |simd| -> [f32; LANES] {
                let seeds = std::array::from_fn(|lane| mixed(lane as u32, 5));
                dispatch!(simd, s => hashed(s, <[u32; LANES]>::simd_into(seeds, s), step).into())
            };
            let numbers = draw(Level::new());
            assert_eq!(numbers, draw(Level::baseline()));
            assert!(numbers.iter().all(|n| (0.0..1.0).contains(n)));
            mean += f64::from(numbers.iter().sum::<f32>()) / 160_000.0;
        }
        // 160,000 uniform numbers: σ of the mean is 0.289/400 = 7e-4.
        assert!((mean - 0.5).abs() < 3e-3, "{mean}");
    }
}
