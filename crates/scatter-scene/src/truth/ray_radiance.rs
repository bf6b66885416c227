//! The radiance of pieces of one view ray, through the light's texture if it has one.

use glam::DVec3;
use scatter_core::{Frame, RayLight, ViewRay};

/// One view ray in its light.
#[derive(Clone)]
pub(super) struct RayRadiance<'a> {
    frame: &'a Frame<'a>,
    ray: &'a ViewRay,
    light: RayLight<'a>,
    /// Of the ray up to its end, as if nothing shadowed it and no texture stood before the light; 0 where nobody asked.
    pub whole: DVec3,
}

impl<'a> RayRadiance<'a> {
    pub fn new(frame: &'a Frame<'a>, ray: &'a ViewRay) -> Self {
        let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), ray);
        Self { frame, ray, light, whole: DVec3::ZERO }
    }

    /// The same with [`Self::whole`] known.
    pub fn with_whole(self, end: f64) -> Self {
        Self { whole: self.light.interval(0.0, end), ..self }
    }

    /// In-scattered radiance of the lit interval `[a, b]`.
    pub fn lit(&self, a: f64, b: f64) -> DVec3 {
        if self.frame.texture().is_none() {
            return self.light.interval(a, b);
        }
        self.coloured(a, b, &mut |a, b| self.light.interval(a, b))
    }

    /// The same to 1e-7 of its value: for the thousands of short pieces between strands.
    pub fn lit_piece(&self, a: f64, b: f64) -> DVec3 {
        let piece = |a, b| self.light.short_interval(a, b).unwrap_or_else(|| self.light.interval(a, b));
        if self.frame.texture().is_none() { piece(a, b) } else { self.coloured(a, b, &mut { piece }) }
    }

    /// The same where light keeps `transmittance(t)` on its way to the point at t ([`RayLight::dimmed_interval`]).
    pub fn dimmed(
        &self,
        a: f64,
        b: f64,
        negligible: f64,
        transmittance: &mut dyn FnMut(f64) -> f64,
    ) -> DVec3 {
        if self.frame.texture().is_none() {
            return self.light.dimmed_interval(a, b, negligible, transmittance);
        }
        self.coloured(a, b, &mut |a, b| self.light.dimmed_interval(a, b, negligible, transmittance))
    }

    /// The sum over the texels of the texture.
    fn coloured(&self, a: f64, b: f64, radiance: &mut dyn FnMut(f64, f64) -> DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let Some(texture) = self.frame.texture() else { return radiance(a, b) };
        texture.pieces(
            self.frame.camera().eye(),
            self.ray.origin,
            self.ray.direction,
            [a, b],
            |a, b, colour| {
                if colour != [0.0; 3] {
                    sum += radiance(a, b) * DVec3::from(colour.map(f64::from));
                }
            },
        );
        sum
    }
}
