//! Airlight of a lamp on one lit interval, twice: by the exponential integral (isotropic, no cone; the closed form
//! of Pegoraro and Parker 2009) and by adaptive quadrature in the
//! angle at the lamp (any phase function, any cone; Sun et al. 2005 and Kulla and Fajardo 2012 use that variable).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::exponential_integral::scaled_e1;
use super::quadrature::integrate;
use super::terms::{Channel, Lamp};

/// In-scattered radiance \[W/(m²·sr)\] of the lit interval `[a, b]` of the view ray from the origin along `view`:
/// `I·∫ₐᵇ Σσs·p(cosθ)·C·exp(−σt(t+d))/d² dt`. 0 ≤ a ≤ b ≤ ∞.
///
/// A ray that passes the lamp closer than 1e-6 of its distance is taken at that distance.
pub fn lamp_radiance(lamp: &Lamp, channel: &Channel<'_>, view: DVec3, a: f64, b: f64) -> f64 {
    let foot = lamp.position.dot(view);
    let offset = view * foot - lamp.position;
    let h = offset.length().max(1e-6 * lamp.position.length());
    // Beyond this the exponent alone is e⁻⁷⁵⁰: not even a denormal is left.
    let reach = foot + 750.0 / channel.sigma_t.max(f64::MIN_POSITIVE) + h;
    let b = b.min(reach.max(a));
    let (x0, x1) = (a - foot, b - foot);
    let (mut along, mut across, mut kinks) = (0.0, 0.0, Vec::new());
    if let Some(cone) = &lamp.cone {
        along = cone.axis.dot(view);
        across = cone.axis.dot(offset) / h;
        kinks = cone.crossings(along, across);
    }
    let cone_at = |cos: f64| lamp.cone.map_or(1.0, |cone| cone.factor(cos));
    // An interval that the lamp hardly sees turn is integrated along the ray: as a difference of two angles it would
    // lose its digits.
    if b - a < 0.2 * (x0.hypot(h) + x1.hypot(h)) {
        let value = |s: f64| {
            let x = x0 + s;
            let d = x.hypot(h);
            let cone = cone_at((along * x + across * h) / d);
            channel.scattering(-x / d) * cone * (-channel.sigma_t * (a + s + d)).exp() / (d * d)
        };
        let ends = kinks.iter().map(|u| h * u.tan() - x0);
        return lamp.intensity * integrate_between(&value, 0.0, b - a, ends);
    }
    // Angles from the perpendicular; the complement v = π/2 − |u| keeps its digits far from the lamp.
    let value = |ahead: bool, v: f64| {
        let sign = if ahead { 1.0 } else { -1.0 };
        // t + d = foot + p, p = x + d = h·(cos v·sign + 1)/sin v.
        let path = if ahead { h / (0.5 * v).tan() } else { h * (0.5 * v).tan() };
        // The light travels from the lamp outwards; behind the foot that is along the view ray, away from the eye.
        let cos_theta = -sign * v.cos();
        let cone = cone_at(along * sign * v.cos() + across * v.sin());
        channel.scattering(cos_theta) * cone * (-channel.sigma_t * (foot + path)).exp()
    };
    let mut sum = 0.0;
    for ahead in [false, true] {
        let side = if ahead { (x0.max(0.0), x1) } else { (x0, x1.min(0.0)) };
        if side.1 <= side.0 {
            continue;
        }
        let angle = |x: f64| h.atan2(x.abs());
        let (low, high) = (angle(side.0).min(angle(side.1)), angle(side.0).max(angle(side.1)));
        let ends = kinks.iter().filter(|&&u| (u > 0.0) == ahead).map(|u| FRAC_PI_2 - u.abs());
        sum += integrate_between(&|v| value(ahead, v), low, high, ends);
    }
    lamp.intensity * sum / h
}

/// `∫ f` over `[low, high]`, piece by piece between the kinks that lie inside.
pub(super) fn integrate_between(
    f: &dyn Fn(f64) -> f64,
    low: f64,
    high: f64,
    kinks: impl Iterator<Item = f64>,
) -> f64 {
    let mut ends: Vec<f64> = kinks.filter(|&v| v > low && v < high).chain([low, high]).collect();
    ends.sort_by(f64::total_cmp);
    ends.windows(2).map(|pair| integrate(f, pair[0], pair[1])).sum()
}

/// `∫ₐᵇ exp(−σ(t+d))/d² dt` for a lamp at distance `distance` and angle `angle` in (0, π) from the view ray, by the
/// exponential integral: `(2/h)·{e^{−σ(a+d_a)}·Im Ê(z_a) − e^{−σ(b+d_b)}·Im Ê(z_b)}`, `z = σp − iσh`.
///
/// A difference: good to about 1e-15 of its first term, so not for short intervals.
pub fn airlight_isotropic(sigma: f64, distance: f64, angle: f64, a: f64, b: f64) -> f64 {
    let (foot, h) = (distance * angle.cos(), distance * angle.sin());
    let term = |t: f64| {
        if t == f64::INFINITY {
            return 0.0;
        }
        let x = t - foot;
        let d = x.hypot(h);
        let path = if x < 0.0 { h * h / (d - x) } else { x + d };
        (-sigma * (foot + path)).exp() * scaled_e1((sigma * path, -sigma * h)).1
    };
    debug_assert!(angle > 0.0 && angle < PI, "the lamp is off the ray");
    2.0 / h * (term(a) - term(b))
}

/// σ, lamp distance, angle, a, b and K = ∫ e^{−σ(x+d)}/d² dx (ten digits).
pub(crate) const PUBLISHED: [(f64, f64, f64, f64, f64, f64); 9] = [
    (0.1, 10.0, 0.5, 0.0, 20.0, 0.110_030_205_1),
    (1.0, 10.0, 0.5, 0.0, 20.0, 3.241_860_946e-6),
    (1e-6, 10.0, 0.5, 0.0, 20.0, 0.466_783_426_4),
    (1e-6, 10.0, 1e-4, 0.0, 20.0, 3_141.361_225),
    (0.1, 10.0, 0.01, 0.0, 30.0, 11.150_669_07),
    (0.3, 10.0, 3.1, 0.0, 50.0, 6.395_084_486e-4),
    (0.01, 10.0, 0.001, 0.0, 9.0, 0.814_327_842_3),
    (0.5, 4.0, 0.7, 3.0, 3.001, 9.254_041_844e-6),
    (5.0, 10.0, 1.0, 8.0, 9.0, 6.230_838_964e-40),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{Cone, PhaseFunction};

    /// K by quadrature: an isotropic medium that scatters 4π times as much as it should.
    fn by_quadrature(sigma: f64, distance: f64, angle: f64, a: f64, b: f64) -> f64 {
        let components = [(4.0 * PI, PhaseFunction::Isotropic)];
        let position = DVec3::new(distance * angle.sin(), 0.0, distance * angle.cos());
        let lamp = Lamp { position, intensity: 1.0, cone: None };
        lamp_radiance(&lamp, &Channel { components: &components, sigma_t: sigma }, DVec3::Z, a, b)
    }

    #[test]
    fn both_forms_give_the_published_values() {
        for (sigma, distance, angle, a, b, exact) in PUBLISHED {
            let quadrature = by_quadrature(sigma, distance, angle, a, b);
            // Half a unit of the tenth digit.
            assert!((quadrature / exact - 1.0).abs() < 5e-10, "{sigma} {angle}: {quadrature} {exact}");
            let closed = airlight_isotropic(sigma, distance, angle, a, b);
            // The short interval is a difference of terms 1e3 times as large: 1e-15 · 1e3 still.
            assert!((closed / exact - 1.0).abs() < 5e-10, "{sigma} {angle}: {closed} {exact}");
        }
    }

    #[test]
    fn both_forms_agree_over_a_wide_grid() {
        let mut worst: f64 = 0.0;
        for sigma in [1e-5, 1e-2, 0.3, 3.0] {
            for angle in [1e-4, 0.03, 0.9, 1.6, 2.9, 3.13] {
                for b in [0.5, 9.99, 10.0, 30.0, 1e3] {
                    let quadrature = by_quadrature(sigma, 10.0, angle, 0.0, b);
                    let closed = airlight_isotropic(sigma, 10.0, angle, 0.0, b);
                    // The closed form is a difference of terms of up to (2/h)·π·e^{−σ·10}, Ê good to about 1e-15.
                    let term = 2.0 * PI / (10.0 * f64::sin(angle)) * f64::exp(-10.0 * sigma);
                    worst = worst.max((quadrature - closed).abs() / (quadrature + 1e-3 * term));
                }
            }
        }
        println!("quadrature against the exponential integral: worst relative difference {worst:.1e}");
        // 1e-15 of the term is 1e-12 of 1e-3 of it.
        assert!(worst < 2e-12, "{worst}");
    }

    #[test]
    fn without_extinction_the_isotropic_integral_is_the_angle_at_the_lamp() {
        for (distance, angle, b) in [(3.0, 0.7, 8.0), (1e4, 1e-5, 2e4), (2.0, 3.0, 1.0)] {
            let (foot, h) = (distance * f64::cos(angle), distance * f64::sin(angle));
            let exact = (((b - foot) / h).atan() + (foot / h).atan()) / h;
            let value = by_quadrature(0.0, distance, angle, 0.0, b);
            assert!((value / exact - 1.0).abs() < 1e-12, "{distance} {angle}: {value} {exact}");
        }
    }

    #[test]
    fn a_cone_of_a_half_space_halves_what_a_symmetric_ray_sees() {
        // The ray passes under the lamp; the cone looks along the ray: only what is ahead of the foot is lit, and by
        // the square of the cosine, for inner = 0 and outer = 90°: ∫₀^{π/2} sin²u du = π/4 instead of π/2.
        let components = [(4.0 * PI, PhaseFunction::Isotropic)];
        let channel = Channel { components: &components, sigma_t: 0.0 };
        let cone = Cone { axis: DVec3::Z, inner: 0.0, outer: FRAC_PI_2 };
        let lamp = Lamp { position: DVec3::new(0.0, 2.0, 5e7), intensity: 1.0, cone: Some(cone) };
        let value = lamp_radiance(&lamp, &channel, DVec3::Z, 0.0, 1e8);
        let h = 50.0; // 1e-6 of the distance is more than the 2 units of offset
        assert!((value * h / (PI / 4.0) - 1.0).abs() < 1e-5, "{value}");
    }
}
