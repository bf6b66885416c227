//! A stretch of a view ray on which the light fades with a constant rate, as behind smoke: the integrand itself, by
//! quadrature.

use glam::DVec3;

use super::quadrature::integrate_smooth;
use super::terms::{Channel, Lamp};

/// A stretch `[a, b]` of a view ray, 0 ≤ a < b < ∞, and the optical depth that the light has behind it at both ends, linear
/// between.
#[derive(Debug, Clone, Copy)]
pub struct Fading {
    /// Ray parameters \[world units\].
    pub span: (f64, f64),
    /// Optical depths there, ≥ 0, finite.
    pub depths: [f64; 2],
}

impl Fading {
    /// `∫ₐᵇ value(t)·e^{−τ(t)} dt`. Parts halve towards the brighter end until the light fades by less than e there, so
    /// that nothing is stepped over; `kinks` are places where `value` is not smooth.
    fn integral(&self, value: &dyn Fn(f64) -> f64, kinks: impl Iterator<Item = f64>) -> f64 {
        let ((a, b), [from, to]) = (self.span, self.depths);
        let share = |t: f64| (t - a) / (b - a);
        let faded = |t: f64| value(t) * (-(from + (to - from) * share(t))).exp();
        let mut cuts: Vec<f64> = kinks.filter(|&t| t > a && t < b).chain([a, b]).collect();
        let mut width = b - a;
        for _ in 0..(to - from).abs().log2().ceil().clamp(0.0, 40.0) as u32 {
            width *= 0.5;
            cuts.push(if to > from { a + width } else { b - width });
        }
        cuts.sort_by(f64::total_cmp);
        integrate_smooth(&faded, &cuts)
    }

    /// Radiance under a sun of this irradiance that travels along `travel`, on the ray along `view` \[W/(m²·sr)\].
    pub fn sun_radiance(&self, irradiance: f64, travel: DVec3, channel: &Channel<'_>, view: DVec3) -> f64 {
        let scattering = channel.scattering(travel.dot(-view).clamp(-1.0, 1.0));
        irradiance * scattering * self.integral(&|t| (-channel.sigma_t * t).exp(), std::iter::empty())
    }

    /// Radiance around a lamp, on the ray along `view` from the origin \[W/(m²·sr)\].
    pub fn lamp_radiance(&self, lamp: &Lamp, channel: &Channel<'_>, view: DVec3) -> f64 {
        let foot = lamp.position.dot(view);
        let offset = view * foot - lamp.position;
        let h = offset.length().max(1e-6 * lamp.position.length());
        let (mut along, mut across, mut kinks) = (0.0, 0.0, Vec::new());
        if let Some(cone) = &lamp.cone {
            along = cone.axis.dot(view);
            across = cone.axis.dot(offset) / h;
            kinks = cone.crossings(along, across);
        }
        let value = |t: f64| {
            let x = t - foot;
            let d = x.hypot(h);
            let cone = lamp.cone.map_or(1.0, |cone| cone.factor((along * x + across * h) / d));
            channel.scattering(-x / d) * cone * (-channel.sigma_t * (t + d)).exp() / (d * d)
        };
        // Beside the lamp the integrand is a peak of the width h.
        let peak =
            (-8..=8).map(|n: i32| foot + h * f64::from(n.signum()) * (f64::from(n.abs()).exp2() - 1.0));
        let ends = kinks.into_iter().map(|u| foot + h * u.tan());
        lamp.intensity * self.integral(&value, ends.chain(peak))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{Cone, PhaseFunction, lamp_radiance, sun_integral};

    const GREY: [(f64, PhaseFunction); 1] = [(0.05, PhaseFunction::Isotropic)];

    #[test]
    fn under_a_sun_the_rate_adds_to_the_extinction() {
        let channel = Channel { components: &GREY, sigma_t: 0.06 };
        for (rise, length) in [(0.5, 3.0), (1e4, 2.0), (-40.0, 1.5), (-0.01, 7.0)] {
            let from = if rise < 0.0 { -rise } else { 0.3 };
            let stretch = Fading { span: (2.0, 2.0 + length), depths: [from, from + rise] };
            let found = stretch.sun_radiance(1.0, DVec3::NEG_Y, &channel, DVec3::Z);
            // ∫ e^{−σt − from − rise·(t − 2)/length}, as one exponential; where the light grows, from its far end on.
            let rate = 0.06 + rise / length;
            let integral = if rate > 0.0 {
                sun_integral(rate, 0.0, length) * (-0.12 - from).exp()
            } else {
                sun_integral(-rate, 0.0, length) * (-0.06 * (2.0 + length) - from - rise).exp()
            };
            let expected = 0.05 / (4.0 * std::f64::consts::PI) * integral;
            assert!((found / expected - 1.0).abs() < 1e-12, "{rise}: {found} {expected}");
        }
    }

    #[test]
    fn without_fading_a_lamp_has_its_airlight() {
        let channel = Channel { components: &GREY, sigma_t: 0.06 };
        let cone = Cone { axis: DVec3::NEG_Y, inner: 0.4, outer: 0.7 };
        for (height, cone) in [(3.0, None), (3.0, Some(cone)), (1e-3, None)] {
            let lamp = Lamp { position: DVec3::new(0.0, height, 4.0), intensity: 2.0, cone };
            let stretch = Fading { span: (1.0, 9.0), depths: [0.7; 2] };
            let found = stretch.lamp_radiance(&lamp, &channel, DVec3::Z);
            let expected = (-0.7f64).exp() * lamp_radiance(&lamp, &channel, DVec3::Z, 1.0, 9.0);
            assert!((found / expected - 1.0).abs() < 1e-11, "{height}: {found} {expected}");
        }
    }
}
