//! Exponentially scaled modified Bessel functions `e^{−z}·Iₖ(z)`, the independent witness of the factors' tests.
//!
//! Miller's downward recurrence `Iₖ₋₁ = Iₖ₊₁ + (2k/z)·Iₖ` from an order where `Iₖ` is nothing, normalised by
//! `e^z = I₀ + 2·ΣIₖ`. Only positive terms are added, so every order keeps its digits.

/// `e^{−z}·Iₖ(z)` for k = 0, 1, … `N − 1` and z in [0, 100].
pub(super) fn scaled<const N: usize>(z: f64) -> [f64; N] {
    let mut values = [0.0; N];
    if z == 0.0 {
        values[0] = 1.0;
        return values;
    }
    // Iₖ/I₀ is about e^{−k²/2z} for small k and (z/2)ᵏ/k! for large: 1e-30 here for all z up to 100.
    let start = N + 30 + (12.0 * z.sqrt()) as usize;
    let (mut above, mut value) = (0.0, 1e-300f64);
    let mut sum = 0.0;
    for k in (1..=start).rev() {
        sum += 2.0 * value;
        if k < N {
            values[k] = value;
        }
        (above, value) = (value, above + 2.0 * k as f64 / z * value);
        if value > 1e200 {
            for v in [&mut value, &mut above, &mut sum].into_iter().chain(&mut values) {
                *v *= 1e-250;
            }
        }
    }
    values[0] = value;
    sum += value;
    values.map(|v| v / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaled_bessel_functions_are_bessels_integral() {
        // Iₖ(z) = (1/π)·∫₀^π e^{z·cosθ}·cos kθ dθ; the trapezoidal rule of a periodic function, 400 points for z ≤ 60.
        for z in [1e-3, 0.1, 1.0, 3.7, 10.0, 30.0, 60.0] {
            let values = scaled::<12>(z);
            for (k, value) in values.iter().enumerate() {
                let count = 400;
                let integral: f64 = (0..count)
                    .map(|i| {
                        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
                        (z * (angle.cos() - 1.0)).exp() * (k as f64 * angle).cos()
                    })
                    .sum::<f64>()
                    / f64::from(count);
                // The sum of 400 terms of at most 1 is known to some 1e-16.
                assert!(
                    (value - integral).abs() < 1e-15 + 1e-13 * integral.abs(),
                    "I{k}({z}): {value} {integral}"
                );
            }
        }
    }

    #[test]
    fn high_orders_at_small_arguments_keep_their_digits() {
        // (z/2)ᵏ/k!·(1 + (z/2)²/(k+1)) for z = 1e-3 and k = 7.
        let exact = 0.5e-3f64.powi(7) / 5040.0 * (1.0 + 0.25e-6 / 8.0) * (-1e-3f64).exp();
        assert!((scaled::<8>(1e-3)[7] / exact - 1.0).abs() < 1e-12);
        assert_eq!(scaled::<3>(0.0), [1.0, 0.0, 0.0]);
    }
}
