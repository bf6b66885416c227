//! Airlight by the exponential integral: exact, one evaluation an end, in f64.
//!
//! After Pegoraro and Parker 2009 (the form is derived anew): with `p = (t − t₀) + d`, h the distance of the closest approach and
//! `z = σp − iσh`,
//!
//! ```text
//!     ∫ₐᵇ e^{−σ(t+d)}/d² dt = (2/h)·{ e^{−σ(a+d_a)}·Im Ê(z_a) − e^{−σ(b+d_b)}·Im Ê(z_b) },      Ê(z) = e^z·E₁(z)
//! ```
//!
//! z never crosses the cut of E₁. It is a difference of two ends: good to 1e-15 of its first term, so short intervals behind long
//! ones lose what cancels.

use scatter_core::LampRay;

/// Euler's constant.
const EULER: f64 = 0.577_215_664_901_532_9;
/// Below, the series; above, the continued fraction, which needs up to seventy terms there and ever fewer outwards.
const SERIES_RADIUS: f64 = 2.0;
/// Terms after which either has long converged to the last bit: the series needs 30 at |z| = 2.
const MOST_TERMS: u32 = 200;

/// `∫ₐᵇ exp(−σ(t+d))/d² dt`, 0 ≤ a ≤ b ≤ ∞, σ ≥ 0 (without extinction the arc that the interval is seen under from the lamp).
/// Relative error 1e-12 where nothing cancels.
pub fn exact_airlight(sigma: f64, lamp: LampRay, a: f64, b: f64) -> f64 {
    let (t0, h) = (lamp.closest, lamp.distance);
    if sigma == 0.0 {
        if b == f64::INFINITY {
            return h.atan2(a - t0) / h;
        }
        return (h * (b - a)).atan2(h * h + (a - t0) * (b - t0)) / h;
    }
    let end = |t: f64| {
        if t == f64::INFINITY {
            return 0.0;
        }
        let (x, d) = (t - t0, lamp.distance_at(t));
        // (t − t₀) + d cancels before the closest approach.
        let p = if x < 0.0 { h * h / (d - x) } else { x + d };
        (-sigma * (t + d)).exp() * scaled_e1([sigma * p, -sigma * h])[1]
    };
    2.0 / h * (end(a) - end(b))
}

/// `e^z·E₁(z)` for Re z ≥ 0, z ≠ 0, as `[re, im]`. Relative error ≤ 1e-13.
pub fn scaled_e1(z: [f64; 2]) -> [f64; 2] {
    let size = z[0].hypot(z[1]);
    if size <= SERIES_RADIUS {
        // E₁(z) = −γ − ln z − Σ (−z)^k/(k·k!)
        let mut sum = [-EULER - size.ln(), -z[1].atan2(z[0])];
        let mut term = [1.0, 0.0];
        for k in 1..MOST_TERMS {
            let share = -1.0 / f64::from(k);
            term = product(term, [z[0] * share, z[1] * share]);
            let added = term.map(|value| value / f64::from(k));
            sum = [sum[0] - added[0], sum[1] - added[1]];
            if added[0].abs().max(added[1].abs()) < 1e-17 {
                break;
            }
        }
        let (sin, cos) = z[1].sin_cos();
        let scale = z[0].exp();
        return product(sum, [scale * cos, scale * sin]);
    }
    // 1/(z + 1 − 1/(z + 3 − 4/(z + 5 − 9/…))), from the front (Lentz).
    let mut b = [z[0] + 1.0, z[1]];
    let mut d = inverse(b);
    let (mut c, mut fraction) = ([f64::INFINITY, 0.0], d);
    for k in 1..MOST_TERMS {
        let a = -f64::from(k * k);
        b[0] += 2.0;
        d = inverse([b[0] + a * d[0], b[1] + a * d[1]]);
        c = if c[0] == f64::INFINITY {
            b
        } else {
            let below = inverse(c);
            [b[0] + a * below[0], b[1] + a * below[1]]
        };
        let change = product(c, d);
        fraction = product(fraction, change);
        if (change[0] - 1.0).abs() + change[1].abs() < 1e-16 {
            break;
        }
    }
    fraction
}

fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn inverse(z: [f64; 2]) -> [f64; 2] {
    let size = z[0] * z[0] + z[1] * z[1];
    [z[0] / size, -z[1] / size]
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::airlight;

    /// A lamp at distance `distance` and angle `angle` to the ray: σ, distance, angle, from, to, and the integral to ten digits.
    const CASES: [(f64, f64, f64, [f64; 2], f64); 8] = [
        (0.1, 10.0, 0.5, [0.0, 20.0], 0.110_030_205_1),
        (1.0, 10.0, 0.5, [0.0, 20.0], 3.241_860_946e-6),
        (1e-6, 10.0, 0.5, [0.0, 20.0], 0.466_783_426_4),
        (1e-6, 10.0, 1e-4, [0.0, 20.0], 3_141.361_225),
        (0.1, 10.0, 0.01, [0.0, 30.0], 11.150_669_07),
        (0.3, 10.0, 3.1, [0.0, 50.0], 6.395_084_486e-4),
        (0.01, 10.0, 0.001, [0.0, 9.0], 0.814_327_842_3),
        (0.5, 4.0, 0.7, [3.0, 3.001], 9.254_041_844e-6),
    ];

    #[test]
    fn it_is_the_published_value_and_the_quadrature_s() {
        for (sigma, distance, angle, [a, b], expected) in CASES {
            let lamp = LampRay { closest: distance * angle.cos(), distance: distance * angle.sin() };
            let found = exact_airlight(sigma, lamp, a, b);
            // The last digit of ten, and what cancels in an interval of 1/1000.
            assert!((found / expected - 1.0).abs() < 1e-8, "{sigma} {angle}: {found} {expected}");
            let other = airlight(sigma, lamp, a, b);
            let cancels = if b - a < 0.1 { 1e-9 } else { 1e-12 };
            assert!((found / other - 1.0).abs() < cancels, "{sigma} {angle}: {found} {other}");
        }
    }

    #[test]
    fn both_forms_of_the_exponential_integral_meet() {
        for angle in (0..=20).map(|n| -f64::from(n) * 0.05 * std::f64::consts::FRAC_PI_2) {
            let at = |size: f64| scaled_e1([size * angle.cos(), size * angle.sin()]);
            let (inside, outside) = (at(SERIES_RADIUS * (1.0 - 1e-14)), at(SERIES_RADIUS * (1.0 + 1e-14)));
            let off = (inside[0] - outside[0]).hypot(inside[1] - outside[1]);
            assert!(off < 1e-13 * inside[0].hypot(inside[1]), "{angle}: {inside:?} {outside:?}");
        }
    }
}
