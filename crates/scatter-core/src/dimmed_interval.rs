//! The in-scattered radiance of an interval whose light is dimmed on its way: the integral of [`RayLight`] with a
//! transmittance under it, by adaptive quadrature in f64.
//!
//! Light through smoke has no closed form along a view ray: the chord of a shadow ray in a sphere is a square root that
//! begins at 0 where the shadow does. So the caller cuts the ray where the transmittance has a kink, and each piece is taken
//! in a variable that has no square root left at either end: with x along the piece (t for a sun, `ln p` of
//! `lamp_interval.rs` for a lamp, in which a lamp's own factors are smooth), `x = L·(1 − cos πs)/2`, so that √x and √(L − x)
//! are sines of s. Gauss-Kronrod rules of 7 points on halved stretches of s then converge at once.

use glam::DVec3;

use crate::ray_light::{Kind, RayLight};

/// Difference of the two rules, as a share of a piece's value, that is accepted. The rule of 7 points is right to its third
/// power or so where that of 3 is right to this.
const RELATIVE: f64 = 1e-5;
/// Most halvings of a piece: 2⁻¹⁶ of it, where even a jump has no weight left.
const DEEPEST: u32 = 16;
/// Where a lamp's piece without an end is cut, as a share of the path at its begin or the lamp's distance: what is left
/// behind is as much of the light, at the transmittance at the cut.
const FARTHEST: f64 = 1e9;

/// Kronrod's extension of the Gauss-Legendre rule of 3 points to 7 (Piessens et al. 1983, QUADPACK's method).
const NODES: [f64; 4] = [0.960_491_268_708_020_3, 0.774_596_669_241_483_4, 0.434_243_749_346_802_55, 0.0];
const KRONROD: [f64; 4] =
    [0.104_656_226_026_467_27, 0.268_488_089_868_333_44, 0.401_397_414_775_962_2, 0.450_916_538_658_474_14];
const GAUSS: [f64; 4] = [0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0];

impl RayLight<'_> {
    /// In-scattered RGB radiance \[W/(m²·sr)\] of the interval `[a, b]`, 0 ≤ a ≤ b, whose light keeps `transmittance(t)`,
    /// 0 to 1, on its way to the point at the ray parameter t. `b` may be ∞ around a lamp; under a sun it is finite.
    ///
    /// The transmittance is smooth between the ends, or begins and ends as a square root does: the caller cuts at every
    /// kink and jump. Absolute error: `negligible` (of the largest channel) or 1e-5 of the value a halving, whichever is
    /// larger; measured against closed forms, 1e-9 of the value where the transmittance has square roots (tests).
    /// Cost: 7 evaluations of the transmittance at least, twice as many for every halving.
    pub fn dimmed_interval(
        &self,
        a: f64,
        b: f64,
        negligible: f64,
        transmittance: &mut dyn FnMut(f64) -> f64,
    ) -> DVec3 {
        if !(b > a) {
            return DVec3::ZERO;
        }
        match self.cone() {
            None => self.dimmed_piece(a, b, negligible, transmittance),
            Some((cone, ray)) => {
                let mut sum = DVec3::ZERO;
                cone.smooth_parts(ray, [a, b], |a, b| {
                    sum += self.dimmed_piece(a, b, negligible, transmittance);
                });
                sum
            }
        }
    }

    /// In-scattered RGB radiance of the interval `[a, b]` whose light keeps `exp(−depth − rate·(t − a))`: what is left of it
    /// where the optical depth of translucent occluders is linear along the ray, as in one texel of a map. `rate` may be
    /// negative, as long as the depth stays ≥ 0; b < ∞.
    ///
    /// Under a sun in a uniform medium a closed form, `E·Σσs·p·e^{−σa−depth}·(b−a)·φ((σ + rate)(b−a))`; otherwise
    /// [`Self::dimmed_interval`], to 1e-9 of its value.
    pub fn fading_interval(&self, a: f64, b: f64, depth: f64, rate: f64) -> DVec3 {
        if rate == 0.0 {
            return self.interval(a, b) * (-depth).exp();
        }
        match &self.kind {
            Kind::Sun { source, sigma_t, .. } => {
                let length = b - a;
                // From the end at which less has been taken away: what is brightest there is 1, whatever the other end.
                let of_channel = |sigma: f64| {
                    let x = (sigma + rate) * length;
                    let least = if x < 0.0 { sigma * b + depth + rate * length } else { sigma * a + depth };
                    let mean = if x == 0.0 { 1.0 } else { -(-x.abs()).exp_m1() / x.abs() };
                    (-least).exp() * length * mean
                };
                *source * DVec3::from(sigma_t.to_array().map(of_channel))
            }
            _ => self.dimmed_interval(a, b, 0.0, &mut |t| (-depth - rate * (t - a)).exp()),
        }
    }

    /// As [`Self::interval`] for an interval so short that two points of a Gauss rule are right to 1e-7 of its value; `None`
    /// for others. Around a lamp a fifth of the cost.
    pub fn short_interval(&self, a: f64, b: f64) -> Option<DVec3> {
        /// The rule's error is x⁴/4320 times a fourth derivative, which a lamp's factors make 60 at the most where |g| ≤ 0.9.
        const SHORT: f64 = 0.03;
        let ray = self.lamp_ray().filter(|_| self.cone().is_none())?;
        let length = ray.log_path_ratio(a, b);
        if !(length < SHORT && self.optical_length(b - a) < SHORT) {
            return None;
        }
        let node = 0.5 / 3f64.sqrt();
        let at = |share: f64| self.integrand(a, share * length).1;
        Some((at(0.5 - node) + at(0.5 + node)) * (0.5 * length))
    }

    /// Optical depth of a length of a lamp's medium; ∞ where that is not one number.
    fn optical_length(&self, length: f64) -> f64 {
        match &self.kind {
            Kind::Lamp { integral, .. } => integral.thickest() * length,
            _ => f64::INFINITY,
        }
    }

    /// In-scattered RGB radiance \[W/(m²·sr)\] for a unit of length at the ray parameter t, 0 ≤ t < ∞, if all of the light gets
    /// there: the integrand of [`Self::interval`].
    pub fn radiance_at(&self, t: f64) -> DVec3 {
        let (_, value) = self.integrand(t, 0.0);
        // Around a lamp the variable is ln p, which grows by 1/d a unit of length.
        self.lamp_ray().map_or(value, |ray| value / ray.distance_at(t))
    }

    fn dimmed_piece(
        &self,
        a: f64,
        b: f64,
        negligible: f64,
        transmittance: &mut dyn FnMut(f64) -> f64,
    ) -> DVec3 {
        let mut rest = DVec3::ZERO;
        let mut end = b;
        if b == f64::INFINITY {
            end = match self.lamp_ray() {
                Some(ray) => ray.closest + FARTHEST * ray.distance.max(ray.path(a)),
                None => f64::MAX,
            };
            rest = self.interval(end, b) * transmittance(end);
        }
        let piece = Piece { light: self, a, length: self.length(a, end) };
        let mut at = |s: f64| piece.at(s, transmittance);
        let value = halved(&mut at, [0.0, 1.0], negligible, DEEPEST);
        rest + value
    }

    /// The length of `[a, b]` in the variable of the quadrature.
    fn length(&self, a: f64, b: f64) -> f64 {
        self.lamp_ray().map_or(b - a, |ray| ray.log_path_ratio(a, b))
    }
}

struct Piece<'a> {
    light: &'a RayLight<'a>,
    a: f64,
    length: f64,
}

impl Piece<'_> {
    /// The integrand for a unit of s.
    fn at(&self, s: f64, transmittance: &mut dyn FnMut(f64) -> f64) -> DVec3 {
        let (sin, cos) = (std::f64::consts::PI * s).sin_cos();
        // 1 − cos without cancellation near s = 0.
        let share = if s < 0.5 { 0.5 * sin * (sin / (1.0 + cos)) } else { 0.5 * (1.0 - cos) };
        let (t, value) = self.light.integrand(self.a, share * self.length);
        let dimmed = transmittance(t);
        // Nothing comes through, of however much there is.
        if dimmed == 0.0 {
            DVec3::ZERO
        } else {
            value * (dimmed * 0.5 * std::f64::consts::PI * sin * self.length)
        }
    }
}

fn halved(at: &mut dyn FnMut(f64) -> DVec3, [low, high]: [f64; 2], negligible: f64, depth: u32) -> DVec3 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let (mut value, mut coarse) = (DVec3::ZERO, DVec3::ZERO);
    for (index, &node) in NODES.iter().enumerate() {
        let sum = if node == 0.0 { at(middle) } else { at(middle - half * node) + at(middle + half * node) };
        value += sum * (KRONROD[index] * half);
        coarse += sum * (GAUSS[index] * half);
    }
    let error = (value - coarse).abs().max_element();
    if depth == 0 || error <= negligible.max(RELATIVE * value.max_element()) {
        return value;
    }
    halved(at, [low, middle], 0.5 * negligible, depth - 1)
        + halved(at, [middle, high], 0.5 * negligible, depth - 1)
}

impl RayLight<'_> {
    /// The ray parameter at which the quadrature's variable has grown by `x` since `a`, and the radiance for a unit of it.
    fn integrand(&self, a: f64, x: f64) -> (f64, DVec3) {
        match &self.kind {
            Kind::Sun { source, sigma_t, .. } => {
                let t = a + x;
                (t, *source * (-*sigma_t * t).exp())
            }
            Kind::FogSun { source, sigma_t, fog, .. } => {
                let t = a + x;
                let log_density = fog.log_density_at(t);
                let attenuation = sigma_t.to_array().map(|sigma| {
                    let exponent = log_density - fog.optical_depth(sigma, t);
                    if exponent.is_nan() { 0.0 } else { exponent.exp() }
                });
                (t, *source * DVec3::from(attenuation))
            }
            Kind::Lamp { intensity, integral } => {
                let (t, value) = integral.integrand(a, x);
                (t, *intensity * value)
            }
            Kind::FogLamp { intensity, integral } => {
                let (t, value) = integral.integrand(a, x);
                (t, *intensity * value)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ViewRay;
    use crate::height_falloff::HeightFalloff;
    use crate::light::Light;
    use crate::medium::Medium;
    use crate::phase::Phase;

    fn media() -> Vec<Medium> {
        let lobe = Phase::HenyeyGreenstein { g: 0.7 };
        let plain = Medium::homogeneous([0.05, 0.1, 0.2], [0.01; 3], lobe).unwrap();
        let falloff = HeightFalloff::new([0.0, 1.0, 0.0], 0.5, 2.0).unwrap();
        vec![plain.clone(), plain.with_height_falloff(falloff)]
    }

    fn lights() -> Vec<Light> {
        let position = [1.0, 2.0, -3.0];
        vec![
            Light::directional([0.3, -1.0, 0.2], [3.0, 2.0, 1.0]).unwrap(),
            Light::point(position, [3.0, 2.0, 1.0], 0.0).unwrap(),
            Light::spot(position, [-0.2, -1.0, 0.0], [3.0, 2.0, 1.0], 20.0, 40.0, 0.0).unwrap(),
        ]
    }

    const RAY: ViewRay = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };

    #[test]
    fn without_dimming_it_is_the_closed_form_for_every_light_and_medium() {
        let eye = DVec3::new(0.0, 1.0, 0.0);
        let mut worst = 0.0f64;
        for medium in &media() {
            for light in &lights() {
                let light = RayLight::new(light, medium, eye, &RAY);
                for (a, b) in [(0.0, 8.0), (2.9, 3.1), (2.0, 3000.0), (5.0, 5.0 + 1e-9)] {
                    let exact = light.interval(a, b);
                    let value = light.dimmed_interval(a, b, 0.0, &mut |_| 1.0);
                    let error = ((value - exact).abs() / exact.max_element().max(1e-300)).max_element();
                    worst = worst.max(error);
                    // Two rules agree to 1e-5, so that the finer one is far better.
                    assert!(error < 1e-7, "{a} {b}: {value} {exact}");
                }
            }
        }
        let (lights, media) = (lights(), media());
        let endless = RayLight::new(&lights[1], &media[0], eye, &RAY);
        let (value, exact) = (
            endless.dimmed_interval(1.0, f64::INFINITY, 0.0, &mut |_| 0.5),
            endless.interval(1.0, f64::INFINITY),
        );
        assert!((value - 0.5 * exact).abs().max_element() < 1e-7 * exact.max_element());
        println!("largest relative error {worst:.1e}");
    }

    #[test]
    fn a_fading_interval_is_what_the_quadrature_says() {
        let eye = DVec3::new(0.0, 1.0, 0.0);
        for medium in &media() {
            for light in &lights() {
                let light = RayLight::new(light, medium, eye, &RAY);
                for (a, b, depth, rate) in
                    [(1.0, 4.0, 0.2, 0.7), (0.0, 2.0, 3.0, -1.4), (2.0, 2.5, 0.1, 1e-9)]
                {
                    let value = light.fading_interval(a, b, depth, rate);
                    let sum = light.dimmed_interval(a, b, 0.0, &mut |t| (-depth - rate * (t - a)).exp());
                    // Beside a spot's cone both are 0.
                    assert!((value - sum).abs().max_element() <= 1e-8 * sum.max_element(), "{value} {sum}");
                }
            }
        }
    }

    #[test]
    fn short_intervals_of_a_lamp_are_right_and_others_are_refused() {
        let (lights, media) = (lights(), media());
        let lamp = RayLight::new(&lights[1], &media[0], DVec3::new(0.0, 1.0, 0.0), &RAY);
        let mut worst = 0.0f64;
        for index in 0..400 {
            let a = 0.02 * f64::from(index);
            let (value, exact) = (lamp.short_interval(a, a + 0.01).unwrap(), lamp.interval(a, a + 0.01));
            worst = worst.max(((value - exact) / exact).abs().max_element());
        }
        println!("largest relative error {worst:.1e}");
        assert!(worst < 1e-7, "{worst:e}");
        assert!(lamp.short_interval(1.0, 3.0).is_none());
        assert!(RayLight::new(&lights[0], &media[0], DVec3::ZERO, &RAY).short_interval(1.0, 1.01).is_none());
        assert!(RayLight::new(&lights[2], &media[0], DVec3::ZERO, &RAY).short_interval(1.0, 1.01).is_none());
    }

    #[test]
    fn square_roots_at_both_ends_are_resolved() {
        // Without extinction, ∫√(r² − (t − c)²) over the whole disc is πr²/2; a disc is what smoke's chord is.
        let medium = Medium::homogeneous([1e-12; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
        let light = RayLight::new(&sun, &medium, DVec3::ZERO, &RAY);
        let (c, r) = (5.0, 0.25f64);
        let chord = |t: f64| (r * r - (t - c) * (t - c)).max(0.0).sqrt();
        let value = light.dimmed_interval(c - r, c + r, 0.0, &mut |t| chord(t)).x;
        let exact = 1e-12 * crate::INV_4PI * std::f64::consts::PI * r * r / 2.0;
        println!("{:.1e}", (value / exact - 1.0).abs());
        // The medium itself takes 5e-12.
        assert!((value / exact - 1.0).abs() < 1e-8, "{value} {exact}");
    }
}
