//! What a part of a view ray scatters towards the eye while the light's transmittance changes along it.

use glam::DVec3;
use scatter_core::{Frame, LightTexture, RayLight, ViewRay};

use crate::curve::{Between, DARK};

/// A light along one view ray; f64.
pub struct DimmedLight<'a> {
    light: RayLight<'a>,
    texture: Option<&'a LightTexture<'a>>,
    eye: DVec3,
    ray: ViewRay,
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
    /// Of a frame's light along a ray.
    pub fn new(frame: &Frame<'a>, ray: &ViewRay) -> Self {
        let eye = frame.camera().eye();
        let light = RayLight::new(frame.light(), frame.medium(), eye, ray);
        Self { light, texture: frame.texture(), eye, ray: *ray }
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
