//! The light as one view ray sees it: the in-scattered radiance of a lit interval, exactly, for any light and medium.
//!
//! This is the one place that turns [`sun_interval`], [`FogRay`] and [`LampIntegral`] into radiance for the f64 references
//! (the exact walk through a shadow map, ray-cast truth) and for unoccluded pixels.

use glam::DVec3;

use crate::camera::ViewRay;
use crate::fog_lamp::FogLampIntegral;
use crate::fog_ray::FogRay;
use crate::lamp_interval::{ConeOnRay, LampIntegral, LampRay};
use crate::light::{Light, PointLight};
use crate::medium::Medium;
use crate::sun_interval::sun_interval;

/// Strength, phase and geometry of a light along one view ray; f64.
#[derive(Debug, Clone)]
pub struct RayLight<'a> {
    pub(crate) kind: Kind<'a>,
}

#[derive(Debug, Clone)]
pub(crate) enum Kind<'a> {
    Sun {
        /// `E · Σ σs·p`: constant along the ray, so the phase function stays out of every sum.
        source: DVec3,
        sigma_t: DVec3,
        grey: bool,
    },
    /// A sun in height fog.
    FogSun {
        source: DVec3,
        sigma_t: DVec3,
        grey: bool,
        fog: FogRay,
    },
    Lamp {
        intensity: DVec3,
        integral: LampIntegral<'a>,
    },
    /// A lamp in height fog.
    FogLamp {
        intensity: DVec3,
        integral: FogLampIntegral<'a>,
    },
}

impl<'a> RayLight<'a> {
    /// For a ray of a camera whose eye is at `eye` (world space).
    pub fn new(light: &Light, medium: &'a Medium, eye: DVec3, ray: &ViewRay) -> Self {
        let direction = ray.direction;
        let kind = match light {
            Light::Directional(sun) => {
                // To the camera is −direction; |travel − to camera|²/4 is sin²(θ/2) without cancellation.
                let haversine = 0.25 * (sun.direction() + direction).length_squared();
                let source = DVec3::from(sun.irradiance()) * medium.scattering_towards(haversine);
                let (sigma_t, grey) = (medium.sigma_t().into(), medium.is_grey());
                match medium.fog_ray(eye, ray) {
                    None => Kind::Sun { source, sigma_t, grey },
                    Some(fog) => Kind::FogSun { source, sigma_t, grey, fog },
                }
            }
            Light::Point(lamp) => Self::lamp(lamp, medium, eye, ray, |_, _| None),
            Light::Spot(spot) => Self::lamp(spot.lamp(), medium, eye, ray, |lamp_ray, relative| {
                Some(ConeOnRay::new(spot, lamp_ray, ray.origin, direction, relative))
            }),
        };
        Self { kind }
    }

    fn lamp(
        lamp: &PointLight,
        medium: &'a Medium,
        eye: DVec3,
        ray: &ViewRay,
        cone: impl Fn(LampRay, DVec3) -> Option<ConeOnRay>,
    ) -> Kind<'a> {
        let relative = lamp.position() - eye;
        let lamp_ray = LampRay::new(ray.origin, ray.direction, relative, lamp.radius());
        let cone = cone(lamp_ray, relative);
        let intensity = lamp.intensity().into();
        match medium.height_falloff() {
            None => Kind::Lamp { intensity, integral: LampIntegral::with_cone(lamp_ray, cone, medium) },
            Some(falloff) => {
                let fog = FogRay::new(falloff, eye, ray);
                let at_lamp = falloff.log_density(eye, relative);
                let integral = FogLampIntegral::new(lamp_ray, cone, medium, fog, at_lamp);
                Kind::FogLamp { intensity, integral }
            }
        }
    }

    /// Where a lamp is, seen from the ray; `None` of a sun.
    pub(crate) fn lamp_ray(&self) -> Option<LampRay> {
        match &self.kind {
            Kind::Sun { .. } | Kind::FogSun { .. } => None,
            Kind::Lamp { integral, .. } => Some(integral.ray()),
            Kind::FogLamp { integral, .. } => Some(integral.ray()),
        }
    }

    /// A spot's cone along the ray.
    pub(crate) fn cone(&self) -> Option<(ConeOnRay, LampRay)> {
        match &self.kind {
            Kind::Sun { .. } | Kind::FogSun { .. } => None,
            Kind::Lamp { integral, .. } => integral.cone().map(|cone| (cone, integral.ray())),
            Kind::FogLamp { integral, .. } => integral.cone().map(|cone| (cone, integral.ray())),
        }
    }

    /// In-scattered RGB radiance \[W/(m²·sr)\] of the lit interval `[a, b]`, 0 ≤ a ≤ b ≤ ∞.
    pub fn interval(&self, a: f64, b: f64) -> DVec3 {
        match &self.kind {
            Kind::Sun { source, sigma_t, grey: true } => *source * finite(sun_interval(sigma_t.x, a, b)),
            Kind::Sun { source, sigma_t, grey: false } => {
                *source * DVec3::from(sigma_t.to_array().map(|sigma| finite(sun_interval(sigma, a, b))))
            }
            Kind::FogSun { source, sigma_t, grey: true, fog } => {
                *source * finite(fog.sun_interval(sigma_t.x, a, b))
            }
            Kind::FogSun { source, sigma_t, grey: false, fog } => {
                *source * DVec3::from(sigma_t.to_array().map(|sigma| finite(fog.sun_interval(sigma, a, b))))
            }
            Kind::Lamp { intensity, integral } => *intensity * integral.interval(a, b),
            Kind::FogLamp { intensity, integral } => *intensity * integral.interval(a, b),
        }
    }
}

/// An endless ray without extinction has an infinite interval; it scatters nothing, and 0·∞ is not a number.
fn finite(interval: f64) -> f64 {
    interval.min(f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::Phase;

    #[test]
    fn looking_into_the_sun_through_a_forward_scattering_haze_is_brightest() {
        let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::HenyeyGreenstein { g: 0.8 }).unwrap();
        let sun = Light::directional([0.0, 0.0, 1.0], [1.0; 3]).unwrap();
        let radiance = |direction: DVec3| {
            let ray = ViewRay { origin: DVec3::ZERO, direction };
            RayLight::new(&sun, &medium, DVec3::ZERO, &ray).interval(0.0, 5.0).x
        };
        // Towards the sun is against its travel. The ratio of the lobes is ((1+g)/(1−g))³ = 729.
        assert!((radiance(DVec3::NEG_Z) / radiance(DVec3::Z) - 729.0).abs() < 1e-9);
    }

    #[test]
    fn coloured_extinction_is_taken_channel_by_channel() {
        let medium = Medium::homogeneous([0.1, 0.2, 0.0], [0.0; 3], Phase::Isotropic).unwrap();
        let sun = Light::directional([1.0, 0.0, 0.0], [4.0, 2.0, 1.0]).unwrap();
        let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::Z };
        let value = RayLight::new(&sun, &medium, DVec3::ZERO, &ray).interval(0.0, 3.0);
        let exact = |e: f64, sigma: f64| e * (1.0 - (-sigma * 3.0).exp()) * crate::INV_4PI;
        assert!((value.x - exact(4.0, 0.1)).abs() < 1e-15 && (value.y - exact(2.0, 0.2)).abs() < 1e-15);
        assert_eq!(value.z, 0.0);
    }

    #[test]
    fn an_endless_ray_through_a_vacuum_or_a_clear_channel_scatters_nothing() {
        let sun = Light::directional([1.0, 0.0, 0.0], [4.0, 2.0, 1.0]).unwrap();
        let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::Z };
        for sigma in [[0.0; 3], [0.1, 0.0, 0.2]] {
            let medium = Medium::homogeneous(sigma, [0.0; 3], Phase::Isotropic).unwrap();
            let value = RayLight::new(&sun, &medium, DVec3::ZERO, &ray).interval(1.0, f64::INFINITY);
            for c in 0..3 {
                assert!(value[c].is_finite() && (sigma[c] > 0.0) == (value[c] > 0.0), "{value}");
            }
        }
    }
}
