//! The sun: `∫ₐᵇ e^{−σt} dt` by a Taylor series where it is short and by the plain difference where it is long.

use glam::DVec3;

use super::terms::Channel;

/// In-scattered radiance \[W/(m²·sr)\] of the lit interval `[a, b]` of a view ray: `E·Σσs·p(cosθ)·∫ₐᵇ e^{−σt} dt`.
///
/// `travel` is the unit direction in which the light travels, `view` that of the view ray.
pub fn sun_radiance(
    irradiance: f64,
    travel: DVec3,
    channel: &Channel<'_>,
    view: DVec3,
    a: f64,
    b: f64,
) -> f64 {
    // The light travels along `travel`, and from the scattering point to the eye along −view.
    let cos_theta = travel.dot(-view).clamp(-1.0, 1.0);
    irradiance * channel.scattering(cos_theta) * sun_integral(channel.sigma_t, a, b)
}

/// `∫ₐᵇ e^{−σt} dt` for 0 ≤ a ≤ b ≤ ∞, σ ≥ 0.
pub fn sun_integral(sigma: f64, a: f64, b: f64) -> f64 {
    if sigma == 0.0 {
        return b - a;
    }
    let x = sigma * (b - a);
    if x > 1.0 {
        // e^{−x} < 0.37: the difference loses less than a bit.
        return ((-sigma * a).exp() - (-sigma * b).exp()) / sigma;
    }
    // Σ (−x)ᵏ/(k+1)!: after 20 terms x ≤ 1 leaves 1/21! = 2e-20.
    let series = (1..=20).rev().fold(0.0, |sum, k| (1.0 - x * sum) / f64::from(k));
    (-sigma * a).exp() * (b - a) * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::PhaseFunction;

    #[test]
    fn the_extreme_suite_of_the_algorithm_notes_comes_out() {
        // ρ = 1/4π, E = 1, albedo 1; five to six digits are printed.
        let cases = [
            (0.1, 0.0, 20.0, 0.068_807_9),
            (0.1, 0.0, f64::INFINITY, 0.079_577_5),
            (1e-8, 0.0, 1.0, 7.957_75e-10),
            (1e3, 0.0, 1e6, 0.079_577_5),
            (1e-3, 1e4, 1e4 + 1.0, 3.611_0e-9),
        ];
        for (sigma, a, b, expected) in cases {
            let components = [(sigma, PhaseFunction::Isotropic)];
            let channel = Channel { components: &components, sigma_t: sigma };
            let value = sun_radiance(1.0, DVec3::NEG_Y, &channel, DVec3::X, a, b);
            // Half a unit of the last digit printed, 0.00005/3.611 at worst.
            assert!((value / expected - 1.0).abs() < 1.5e-5, "({sigma}, {a}, {b}): {value} {expected}");
        }
        assert_eq!(sun_integral(0.3, 5.0, 5.0), 0.0);
    }

    #[test]
    fn the_series_meets_the_difference() {
        // Both forms near x = 1, against 1 − e^{−1}, e^{−1} to 20 digits.
        let exact = 1.0 - 0.367_879_441_171_442_33;
        assert!((sun_integral(1.0, 0.0, 1.0) / exact - 1.0).abs() < 4e-16);
        assert!((sun_integral(1.0, 0.0, 1.0 + 1e-15) / exact - 1.0).abs() < 4e-15);
    }
}
