//! What a part of a view ray scatters towards the eye while the light's transmittance changes along it.

use glam::DVec3;
use scatter_core::{Frame, Level, Light, LightTexture, RayLight, ViewRay, at_level};

use crate::curve::{Between, DARK};
use crate::curves::avsm::AvsmCurve;
use crate::ray::crossing::{Crossing, mean_of_parabola, mean_under_sun};

/// A light along one view ray; f64.
pub struct DimmedLight<'a> {
    light: RayLight<'a>,
    texture: Option<&'a LightTexture<'a>>,
    eye: DVec3,
    ray: ViewRay,
    sun: Option<Sun>,
    simd: Level,
}

/// A sun in a uniform medium.
struct Sun {
    /// `E · Σ σs·p`.
    source: DVec3,
    sigma_t: DVec3,
    grey: bool,
}

/// A part of a ray and the optical depths that the light has behind it at the part's ends.
#[derive(Debug, Clone, Copy)]
pub struct DimmedPart {
    /// Ray parameters \[world units\], the first one smaller; finite where the optical depths differ.
    pub t: [f64; 2],
    /// τ of the light there.
    pub optical_depths: [f64; 2],
    /// How τ runs between.
    pub between: Between,
}

impl DimmedPart {
    /// τ at a ray parameter of the part.
    fn at(&self, t: f64) -> f64 {
        let [a, b] = self.optical_depths;
        if a == b {
            return a;
        }
        let share = ((t - self.t[0]) / (self.t[1] - self.t[0])).clamp(0.0, 1.0);
        match self.between {
            Between::Exponential => a + share * (b - a),
            Between::Linear => a - (share * (a - b).exp_m1()).ln_1p(),
        }
    }

    fn cut(&self, t: [f64; 2]) -> Self {
        Self { t, optical_depths: t.map(|t| self.at(t)), between: self.between }
    }
}

impl<'a> DimmedLight<'a> {
    /// Of a frame's light along a ray, with the instructions of a level.
    pub fn new(frame: &Frame<'a>, ray: &ViewRay, simd: Level) -> Self {
        let (eye, medium) = (frame.camera().eye(), frame.medium());
        let light = RayLight::new(frame.light(), medium, eye, ray);
        let sun = match frame.light() {
            Light::Directional(sun) if medium.height_falloff().is_none() => {
                // |travel − to camera|²/4 is sin²(θ/2) without cancellation.
                let haversine = 0.25 * (sun.direction() + ray.direction).length_squared();
                Some(Sun {
                    source: DVec3::from(sun.irradiance()) * medium.scattering_towards(haversine),
                    sigma_t: medium.sigma_t().into(),
                    grey: medium.is_grey(),
                })
            }
            _ => None,
        };
        Self { light, texture: frame.texture(), eye, ray: *ray, sun, simd }
    }

    /// RGB radiance of a whole way through a texel of adaptive curves, in lanes of f32: to 1e-5 of it, and the parabola of a lamp's or
    /// of height fog's radiance. `None` where that will not do: behind glass, where f32 cannot tell the depths apart, or beside a
    /// lamp and at the edge of a cone, where no parabola is near.
    pub fn crossing<const N: usize>(&self, crossing: &Crossing, curve: &AvsmCurve<N>) -> Option<DVec3> {
        if self.texture.is_some() || !crossing.is_resolved() {
            return None;
        }
        let (depths, sums) = curve.lanes();
        let simd = self.simd;
        let [a, b] = crossing.t;
        if let Some(sun) = &self.sun {
            let of = |sigma: f64| {
                let optical_depth = (sigma * (b - a)) as f32;
                let mean = at_level!(simd, mean_under_sun(depths, sums, crossing, optical_depth));
                (-sigma * a).exp() * (b - a) * f64::from(mean)
            };
            let integrals = if sun.grey {
                DVec3::splat(of(sun.sigma_t.x))
            } else {
                sun.sigma_t.to_array().map(of).into()
            };
            return Some(sun.source * integrals);
        }
        let at = |share: f64| self.light.radiance_at(crossing.at(share));
        let [start, middle, end] = [0.0, 0.5, 1.0].map(at);
        let bend = start - 2.0 * middle + end;
        let (least, most) = (start.min(end).max_element(), start.max(end).max_element());
        let is_smooth = most <= 2.0 * least && bend.abs().max_element() <= 0.05 * most;
        // Radiance as a number of the middle's size, in which f32 neither under- nor overflows.
        let unit = middle.max_element();
        if !(is_smooth && unit > 0.0 && unit.is_finite()) {
            return None;
        }
        let coefficients = [start, 4.0 * middle - 3.0 * start - end, 2.0 * bend]
            .map(|value| (value / unit).to_array().map(|value| value as f32));
        let mean = at_level!(simd, mean_of_parabola(depths, sums, crossing, &coefficients));
        Some(DVec3::from(mean.map(f64::from)).max(DVec3::ZERO) * (unit * (b - a)))
    }

    /// RGB radiance of a part that all of the light reaches.
    pub fn lit(&self, a: f64, b: f64) -> DVec3 {
        match self.texture {
            None => self.light.interval(a, b),
            Some(texture) => {
                let mut sum = DVec3::ZERO;
                texture.pieces(self.eye, self.ray.origin, self.ray.direction, [a, b], |a, b, colour| {
                    sum += self.light.interval(a, b) * DVec3::from(colour.map(f64::from));
                });
                sum
            }
        }
    }

    /// RGB radiance of a part that is reached by what `e^{−τ}` leaves of the light: a closed form of a sun in a uniform medium and
    /// where τ does not change, else core's quadrature ([`RayLight::fading_interval`], [`RayLight::dimmed_interval`]).
    pub fn dimmed(&self, part: &DimmedPart) -> DVec3 {
        match self.texture {
            None => self.untinted(part),
            Some(texture) => {
                let mut sum = DVec3::ZERO;
                texture.pieces(self.eye, self.ray.origin, self.ray.direction, part.t, |a, b, colour| {
                    sum += self.untinted(&part.cut([a, b])) * DVec3::from(colour.map(f64::from));
                });
                sum
            }
        }
    }

    fn untinted(&self, part: &DimmedPart) -> DVec3 {
        let ([a, b], [from, to]) = (part.t, part.optical_depths);
        if from.min(to) > f64::from(DARK) || !(a < b) {
            return DVec3::ZERO;
        }
        if from == to {
            return (-from).exp() * self.light.interval(a, b);
        }
        match part.between {
            Between::Exponential => self.light.fading_interval(a, b, from, (to - from) / (b - a)),
            // Of the largest channel: no share of a pixel that could be seen.
            Between::Linear => self.light.dimmed_interval(a, b, 0.0, &mut |t| (-part.at(t)).exp()),
        }
    }
}
