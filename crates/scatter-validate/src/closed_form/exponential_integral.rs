//! The scaled complex exponential integral `Ê(z) = e^z·E₁(z)` (Abramowitz and Stegun 5.1.11 and 5.1.22).
//!
//! The series for |z| ≤ 2, Lentz's continued fraction beyond. The right half
//! plane is all that airlight needs; z never crosses the cut.

/// A complex number, (real, imaginary).
pub(super) type Complex = (f64, f64);

/// `e^z·E₁(z)` for Re z ≥ 0, z ≠ 0.
pub(super) fn scaled_e1(z: Complex) -> Complex {
    if z.0.hypot(z.1) <= 2.0 { mul(exp(z), series(z)) } else { continued_fraction(z) }
}

/// `−γ − ln z − Σ_{k≥1} (−z)ᵏ/(k·k!)`.
fn series(z: Complex) -> Complex {
    /// Euler's constant.
    const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;
    let mut sum = (-EULER_GAMMA - z.0.hypot(z.1).ln(), -z.1.atan2(z.0));
    let mut power = (1.0, 0.0);
    // |z| ≤ 2: 2³⁰/(30·30!) = 1e-25.
    for k in 1..=30 {
        power = mul(power, (-z.0 / f64::from(k), -z.1 / f64::from(k)));
        sum = (sum.0 - power.0 / f64::from(k), sum.1 - power.1 / f64::from(k));
    }
    sum
}

/// `1/(z + 1 − 1/(z + 3 − 4/(z + 5 − 9/…)))`, from the back.
fn continued_fraction(z: Complex) -> Complex {
    // The fraction gains about 2·√(2|z|·k) nats after k terms: 90 terms at |z| = 2 leave e⁻³⁸.
    let mut tail = (0.0, 0.0);
    for k in (1..=90).rev() {
        let k = f64::from(k);
        let denominator = (z.0 + 2.0 * k + 1.0 - tail.0, z.1 - tail.1);
        let inverse = invert(denominator);
        tail = (k * k * inverse.0, k * k * inverse.1);
    }
    invert((z.0 + 1.0 - tail.0, z.1 - tail.1))
}

fn mul(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn exp(z: Complex) -> Complex {
    let size = z.0.exp();
    (size * z.1.cos(), size * z.1.sin())
}

fn invert(z: Complex) -> Complex {
    let size = z.0.hypot(z.1);
    (z.0 / size / size, -z.1 / size / size)
}

#[cfg(test)]
mod tests {
    use super::super::quadrature::integrate;
    use super::*;

    #[test]
    fn it_is_the_integral_that_defines_it() {
        // Ê(z) = ∫₀^∞ e^{−s}/(z + s) ds; the tail beyond s = 60 is below e⁻⁶⁰/60.
        for z in
            [(0.1, -0.3), (1.0, -1.5), (1.9, -0.6), (2.1, -0.7), (0.0, -3.0), (5.0, -40.0), (30.0, -0.01)]
        {
            let part = |pick: fn(Complex) -> f64| {
                integrate(
                    &|s| {
                        let inverse = invert((z.0 + s, z.1));
                        (-s).exp() * pick(inverse)
                    },
                    0.0,
                    60.0,
                )
            };
            let (re, im) = (part(|c| c.0), part(|c| c.1));
            let value = scaled_e1(z);
            let size = re.hypot(im);
            assert!((value.0 - re).hypot(value.1 - im) < 1e-13 * size, "{z:?}: {value:?} ({re}, {im})");
        }
    }

    #[test]
    fn the_tabulated_value_of_e1_comes_out() {
        // Abramowitz and Stegun, table 5.1: E₁(1) = 0.219383934.
        assert!((scaled_e1((1.0, 0.0)).0 * (-1.0f64).exp() - 0.219_383_934_4).abs() < 5e-11);
    }
}
