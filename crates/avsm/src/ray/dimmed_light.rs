//! What a part of a view ray scatters towards the eye while the light's transmittance changes along it.
//!
//! ```text
//! transmittance e^{−τ} constant        T·(closed form of the lit interval)
//! sun, τ linear                        ∫ e^{−σt − τ(t)} dt: the closed form with a larger extinction
//! sun, T linear                        ∫ e^{−σt}·(T_a + s·(t − a)) dt: two closed forms
//! lamps and height fog                 exact lit intervals of halves of the part, weighed by T: adaptive
//! ```

use glam::DVec3;
use scatter_core::{Frame, Light, LightTexture, RayLight, ViewRay};

use crate::curve::{Between, DARK};

/// A light along one view ray; f64.
pub struct DimmedLight<'a> {
    light: RayLight<'a>,
    sun: Option<Sun>,
    texture: Option<&'a LightTexture<'a>>,
    eye: DVec3,
    ray: ViewRay,
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
    /// Ray parameters \[world units\], the first one smaller.
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
        let (eye, medium) = (frame.camera().eye(), frame.medium());
        let sun = match frame.light() {
            Light::Directional(sun) if medium.height_falloff().is_none() => {
                let haversine = 0.25 * (sun.direction() + ray.direction).length_squared();
                Some(Sun {
                    source: DVec3::from(sun.irradiance()) * medium.scattering_towards(haversine),
                    sigma_t: medium.sigma_t().into(),
                    grey: medium.is_grey(),
                })
            }
            _ => None,
        };
        Self {
            light: RayLight::new(frame.light(), medium, eye, ray),
            sun,
            texture: frame.texture(),
            eye,
            ray: *ray,
        }
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

    /// RGB radiance of a part that is reached by what `e^{−τ}` leaves of the light. For lamps and in height fog the adaptive
    /// sum is right to 1e-4 of the part's own value where τ runs exponentially over its whole length, and to rounding where it
    /// is constant.
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
        match &self.sun {
            Some(sun) => sun.integral(part),
            None => self.halves(part, self.light.interval(a, b), MOST_HALVINGS),
        }
    }

    /// `∫ T·f dt` for the light's radiance f, whose integrals over both halves are exact: with the differences of the halves, f
    /// is taken as a line, and T as a parabola through its ends and its middle. Halved until both are nearly so.
    fn halves(&self, part: &DimmedPart, whole: DVec3, halvings: u32) -> DVec3 {
        let [a, b] = part.t;
        if whole == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let middle = 0.5 * (a + b);
        let first = self.light.interval(a, middle);
        let second = (whole - first).max(DVec3::ZERO);
        let tilt = second - first;
        let is_smooth = tilt.abs().max_element() <= 0.25 * whole.max_element();
        let [from, to] = part.optical_depths;
        if halvings > 0 && !(is_smooth && (to - from).abs() <= 0.5) && a < middle && middle < b {
            let [left, right] = [[a, middle], [middle, b]].map(|t| part.cut(t));
            return self.halves(&left, first, halvings - 1) + self.halves(&right, second, halvings - 1);
        }
        let [start, centre, end] = [from, part.at(middle), to].map(|depth| (-depth).exp());
        let (linear, square) = (4.0 * centre - 3.0 * start - end, 2.0 * (start + end) - 4.0 * centre);
        // ∫ s·f and ∫ s²·f over s in 0 … 1.
        let (once, twice) = (0.5 * whole + tilt / 3.0, (whole + tilt) / 3.0);
        let sum = start * whole + linear * once + square * twice;
        sum.clamp(start.min(end) * whole, start.max(end) * whole)
    }
}

/// Most halvings of a part: beside a lamp radiance falls as 1/d², so each gains a factor of four.
const MOST_HALVINGS: u32 = 20;

impl Sun {
    fn integral(&self, part: &DimmedPart) -> DVec3 {
        let ([a, b], [from, to]) = (part.t, part.optical_depths);
        let length = b - a;
        let of = |sigma: f64| match part.between {
            Between::Exponential => {
                (-sigma * a - from).exp() * length * mean_of_exponential(sigma * length + (to - from))
            }
            Between::Linear => {
                let x = sigma * length;
                let [start, end] = [from, to].map(|depth| (-depth).exp());
                (-sigma * a).exp()
                    * length
                    * (start * mean_of_exponential(x) + (end - start) * first_moment(x))
            }
        };
        if self.grey {
            self.source * of(self.sigma_t.x)
        } else {
            self.source * DVec3::from(self.sigma_t.to_array().map(of))
        }
    }
}

/// `∫₀¹ e^{−xu} du`, x of any sign.
fn mean_of_exponential(x: f64) -> f64 {
    if x.abs() < 1e-9 { 1.0 - 0.5 * x } else { -(-x).exp_m1() / x }
}

/// `∫₀¹ u·e^{−xu} du` for x ≥ 0: (1 − e^{−x}(1 + x))/x², by its series where that cancels.
fn first_moment(x: f64) -> f64 {
    if x < 0.1 {
        // Σ (−x)ⁿ/(n!·(n+2)): the next term is 1e-8 of x⁰'s.
        0.5 - x
            * (1.0 / 3.0
                - x * (1.0 / 8.0 - x * (1.0 / 30.0 - x * (1.0 / 144.0 - x * (1.0 / 840.0 - x / 5760.0)))))
    } else {
        (1.0 - (-x).exp() * (1.0 + x)) / (x * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_what_sums_over_many_points_are() {
        let count = 200_000;
        let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
            (0..count).map(|n| f((f64::from(n) + 0.5) / f64::from(count))).sum::<f64>() / f64::from(count)
        };
        for x in [0.0, 1e-12, 1e-8, 1e-3, 0.09, 0.11, 0.7, 5.0, 40.0] {
            let (mean, moment) = (sum(&|u| (-x * u).exp()), sum(&|u| u * (-x * u).exp()));
            assert!((mean_of_exponential(x) / mean - 1.0).abs() < 1e-8, "{x}");
            assert!((first_moment(x) / moment - 1.0).abs() < 1e-8, "{x}");
        }
        assert!((mean_of_exponential(-1.0) - sum(&f64::exp)).abs() < 1e-9);
    }
}
