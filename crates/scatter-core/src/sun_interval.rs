//! One lit interval of a view ray under a directional light: `∫ₐᵇ e^{−σt} dt`, in f64 and in f32.
//!
//! `e^{−σa}·(b−a)·φ(σ(b−a))` with `φ(x) = −expm1(−x)/x`, φ(0) = 1 (MODEL.md): exact for σ → 0,
//! σ·D ≫ 1 and b = ∞. Two large antiderivatives are never subtracted.

/// `∫ₐᵇ e^{−σt} dt` for 0 ≤ a ≤ b ≤ ∞ and σ ≥ 0, to a few ulp. Infinite only where σ = 0 and b = ∞.
pub fn sun_interval(sigma: f64, a: f64, b: f64) -> f64 {
    let length = b - a;
    if !(length > 0.0) {
        // Also a = b = ∞, where the difference is NaN.
        return 0.0;
    }
    if sigma == 0.0 {
        return length;
    }
    let x = sigma * length;
    // Below 1e-300 the quotient −expm1(−x)/σ loses σ to underflow; there φ = 1 to the last bit.
    let integral = if x < 1e-300 { length } else { -(-x).exp_m1() / sigma };
    (-sigma * a).exp() * integral
}

/// [`sun_interval`] in f32, without a libm call or a division by σ.
///
/// Relative error ≤ 5e-6 for σ·b ≤ 80, where the rounding of σ·a is most of it; measured 3.6e-6 (test
/// `the_fast_form_keeps_its_bound`). Beyond σ·a ≈ 87 the true
/// value is below the smallest normal f32 and 0 is returned. `b` may be ∞ where σ > 0.
#[inline(always)]
pub fn sun_interval_f32(sigma: f32, a: f32, b: f32) -> f32 {
    let length = b - a;
    if !(length > 0.0) {
        return 0.0;
    }
    let x = sigma * length;
    if x < 0.5 {
        // φ by its Taylor series to x⁷: the first term left out is x⁸/9! < 1.1e-8.
        let phi = 1.0
            - x * (1.0 / 2.0
                - x * (1.0 / 6.0
                    - x * (1.0 / 24.0
                        - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x * (1.0 / 5040.0 - x * (1.0 / 40320.0)))))));
        exp_f32(-sigma * a) * length * phi
    } else {
        // x ≥ ½: 1 − e^{−x} ≥ 0.39, so the subtraction costs a bit and a half.
        exp_f32(-sigma * a) * ((1.0 - exp_f32(-x)) / sigma)
    }
}

/// `eˣ` for x ≤ 88 by `2ⁿ·P₆(r)`; 0 below −87.3 (no denormals), relative error ≤ 2.5e-7.
///
/// The rounding is an addition of 1.5·2²³ rather than a cast: Rust's float casts saturate, which keeps compilers
/// from vectorising the loop around them.
#[inline]
pub fn exp_f32(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let clamped = x.clamp(-87.3, 88.0);
    let shifted = clamped * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (clamped - n * LN2_HIGH) - n * LN2_LOW;
    // Taylor to r⁶ on |r| ≤ ln2/2: the first term left out is r⁷/7! ≤ 1.2e-7.
    let p = 1.0
        + r * (1.0
            + r * (0.5
                + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r / 5040.0))))));
    let exponent = (shifted.to_bits().wrapping_sub(ROUND.to_bits()) << 23).wrapping_add(1.0f32.to_bits());
    let value = p * f32::from_bits(exponent);
    if x < -87.3 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extreme_intervals_have_their_analytic_values() {
        // E = 1, albedo 1, isotropic.
        let radiance = |sigma: f64, a: f64, b: f64| sigma * sun_interval(sigma, a, b) * crate::INV_4PI;
        let near = |value: f64, exact: f64| {
            // Five to six digits are printed.
            assert!((value / exact - 1.0).abs() < 1.5e-5, "{value} {exact}");
        };
        near(radiance(0.1, 0.0, 20.0), 0.068_807_9);
        near(radiance(0.1, 0.0, f64::INFINITY), 0.079_577_5);
        near(radiance(1e-8, 0.0, 1.0), 7.957_75e-10);
        near(radiance(1e3, 0.0, 1e6), 0.079_577_5);
        near(radiance(1e-3, 1e4, 1e4 + 1.0), 3.611_0e-9);
        assert_eq!(radiance(1.0, 0.0, 0.0), 0.0);
        assert_eq!(sun_interval(0.0, 0.0, 1e-30), 1e-30);
        assert_eq!(sun_interval(1e-320, 0.0, 2.0), 2.0);
        assert_eq!(sun_interval(1.0, f64::INFINITY, f64::INFINITY), 0.0);
    }

    #[test]
    fn adjacent_intervals_add_up() {
        for sigma in [0.0, 1e-9, 0.3, 20.0, 1e4] {
            let (a, m, b) = (0.7, 1.9, 31.0);
            let parts = sun_interval(sigma, a, m) + sun_interval(sigma, m, b);
            let whole = sun_interval(sigma, a, b);
            assert!((parts - whole).abs() <= 4.0 * f64::EPSILON * whole, "{sigma}");
        }
    }

    #[test]
    fn the_fast_form_keeps_its_bound() {
        let mut worst = 0.0f64;
        for i in 0..200 {
            for j in 0..60 {
                let sigma = 10f32.powf(i as f32 * 0.05 - 7.0);
                let (a, length) = (j as f32 * 0.37, 10f32.powf(j as f32 * 0.1 - 3.0));
                let b = a + length;
                if sigma * b > 80.0 {
                    continue;
                }
                let exact = sun_interval(sigma.into(), a.into(), b.into());
                worst = worst.max((f64::from(sun_interval_f32(sigma, a, b)) / exact - 1.0).abs());
            }
        }
        println!("sun_interval_f32: worst relative error {worst:.2e}");
        // σ·a is rounded to f32 before the exponential: up to 80·2⁻²⁵ = 2.4e-6 at the far end.
        assert!(worst < 5e-6, "{worst}");
    }

    #[test]
    fn the_fast_exponential_keeps_its_bound_and_never_leaves_the_finite_range() {
        let mut worst = 0.0f64;
        for i in 0..1_000_000 {
            let x = -87.0 + i as f32 * 1.74e-4;
            worst = worst.max((f64::from(exp_f32(x)) / f64::from(x).exp() - 1.0).abs());
        }
        println!("exp_f32: worst relative error {worst:.2e}");
        assert!(worst < 2.5e-7, "{worst}");
        assert_eq!(exp_f32(0.0), 1.0);
        assert_eq!(exp_f32(f32::NEG_INFINITY), 0.0);
        assert!(exp_f32(1e30).is_finite());
    }
}
