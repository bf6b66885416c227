//! One lit interval of a view ray near a lamp: the airlight integral, exact in f64 for every phase function.
//!
//! With t₀ the ray parameter of the closest approach, h that distance and d the distance to the lamp,
//!
//! ```text
//!     ∫ₐᵇ p(cosθ)·C·exp(−σ(t + d))/d² dt
//! ```
//!
//! is taken in `p = (t − t₀) + d`, the length that Pegoraro and Parker 2009 (and Sun 2005, as h·tan ξ) build on.
//! There dt/d² = 2 dp/(p² + h²), t + d = t₀ + p and cosθ = (h² − p²)/(h² + p²), so all that is left is
//!
//! ```text
//!     ∫ 2p/(p² + h²) · e^{−σ(t₀+p)} · phase · C  d(ln p)
//! ```
//!
//! and **in ln p every factor but the exponential has its singularities at distance π/2 from the real axis, wherever
//! h is and whatever g is** (tanh and sech, and Henyey-Greenstein's denominator `1 + g² + 2g·tanh`, whose zeros lie
//! on the same lines). So Gauss-Legendre panels of at most unit length in ln p converge at one rate for all inputs:
//! half a panel against π/2 gives a Bernstein ellipse of 6.4, and 10 points leave 6.4⁻²⁰ < 1e-15. Panels shrink
//! where the exponential falls fast, and stop where it has fallen by e⁻⁴⁵.
//!
//! The depths of the panel ends are differences that cancel nothing: `ln p_b − ln p_a = 2·atanh((b−a)/(d_a+d_b))`.
//! This replaces the exponential integral (Pegoraro and Slusallek 2011), which knows the isotropic case alone, and
//! Sun's table, which cancels behind the lamp.

use glam::DVec3;

use crate::light::SpotLight;
use crate::medium::Medium;
use crate::phase::Phase;

/// Points of a panel: 6.4⁻²⁰ is below f64's rounding; one less leaves 1e-14.
pub(crate) const POINTS: usize = 10;
/// Longest panel in ln p. Longer ones need more points, by the rate above.
const LONGEST_PANEL: f64 = 1.0;
/// How far the exponent may fall in a panel: e⁻³ᵘ on [0, 1] is resolved to 1e-15 by 10 points.
const PANEL_OPTICAL_DEPTH: f64 = 3.0;
/// A ray that passes closer than this share of the eye's distance to the lamp is taken at it (MODEL.md).
pub(crate) const CLOSEST_SHARE: f64 = 1e-6;
/// Where the rest is dropped, as an optical depth behind the interval's start: e⁻⁴⁵ = 3e-20.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 45.0;

/// Where a lamp is, seen from a view ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampRay {
    /// Ray parameter of the closest approach; may be negative.
    pub closest: f64,
    /// Distance of the closest approach, clamped as the model says: at least 1e-6 of the eye's distance to the
    /// lamp, and at least the lamp's radius. > 0.
    pub distance: f64,
}

/// The spot cone along a view ray: `cos(axis angle) = along·tanh w + across·sech w`, w = asinh((t − t₀)/h).
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConeOnRay {
    pub(crate) along: f64,
    pub(crate) across: f64,
    pub(crate) cos_outer: f64,
    cos_full: f64,
    pub(crate) slope: f64,
}

/// The airlight integral along one view ray, ready for any number of intervals.
#[derive(Debug, Clone)]
pub struct LampIntegral<'a> {
    ray: LampRay,
    cone: Option<ConeOnRay>,
    medium: &'a Medium,
    /// Whether one exponential serves all three channels.
    grey: bool,
}

impl LampRay {
    /// For a ray from `origin` in the unit direction `direction`, with the lamp at `lamp`, both relative to the eye.
    ///
    /// `radius` ≥ 0 is the lamp's. The lamp must not be at the eye (a frame refuses that).
    pub fn new(origin: DVec3, direction: DVec3, lamp: DVec3, radius: f64) -> Self {
        let to_lamp = lamp - origin;
        let closest = to_lamp.dot(direction);
        // The cross product keeps the digits that √(L² − t₀²) cancels.
        let distance = to_lamp.cross(direction).length();
        Self { closest, distance: distance.max(CLOSEST_SHARE * lamp.length()).max(radius) }
    }

    /// Distance to the lamp at the ray parameter `t`.
    pub fn distance_at(&self, t: f64) -> f64 {
        (t - self.closest).hypot(self.distance)
    }

    /// `p = (t − t₀) + d`, without cancellation before the closest approach.
    pub(crate) fn path(&self, t: f64) -> f64 {
        let x = t - self.closest;
        let d = x.hypot(self.distance);
        if x < 0.0 { self.distance * (self.distance / (d - x)) } else { x + d }
    }

    /// The ray parameter at which ln p has grown by `growth` since `a`, where p is `start`.
    pub(crate) fn parameter_at(&self, [a, start]: [f64; 2], growth: f64) -> f64 {
        // t − t₀ = (p − h²/p)/2, as a difference from the start: that keeps the digits of short intervals.
        let h = self.distance;
        let advance = 0.5 * start * growth.exp_m1() - 0.5 * (h / start) * h * (-growth).exp_m1();
        a + advance
    }

    /// `ln p(b) − ln p(a)`, to rounding for the shortest and the longest interval.
    pub(crate) fn log_path_ratio(&self, a: f64, b: f64) -> f64 {
        if b == f64::INFINITY {
            return f64::INFINITY;
        }
        let ratio = (b - a) / (self.distance_at(a) + self.distance_at(b));
        // Near 1 atanh loses what the quotient of the paths still has.
        if ratio < 0.5 { 2.0 * ratio.atanh() } else { (self.path(b) / self.path(a)).ln() }
    }
}

impl<'a> LampIntegral<'a> {
    /// The integral for a point light. Of a medium with a [`HeightFalloff`](crate::HeightFalloff) it takes the density at the
    /// base height everywhere: in height fog ask a [`RayLight`](crate::RayLight).
    pub fn point(ray: LampRay, medium: &'a Medium) -> Self {
        Self { ray, cone: None, grey: medium.is_grey(), medium }
    }

    /// The integral for a spot light; `lamp` is its position relative to the eye, as in [`LampRay::new`].
    pub fn spot(
        ray: LampRay,
        medium: &'a Medium,
        spot: &SpotLight,
        origin: DVec3,
        direction: DVec3,
        lamp: DVec3,
    ) -> Self {
        Self::with_cone(ray, Some(ConeOnRay::new(spot, ray, origin, direction, lamp)), medium)
    }

    pub(crate) fn with_cone(ray: LampRay, cone: Option<ConeOnRay>, medium: &'a Medium) -> Self {
        Self { cone, ..Self::point(ray, medium) }
    }

    /// `∫ₐᵇ Σ σs·p(cosθ)·C·exp(−σt(t+d))/d² dt` per channel: multiply by the intensity for the in-scattered radiance.
    ///
    /// 0 ≤ a ≤ b ≤ ∞. Relative error ≤ 1e-12 against adaptive quadrature over h/D from 1e-6 to 1, |g| ≤ 0.99 and
    /// σ·D from 0 to 10³ (tests). Cost: 10 evaluations a panel; a short interval is one panel, a ray that passes a
    /// lamp at h = 1e-5 of its length about 25.
    pub fn interval(&self, a: f64, b: f64) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let Some(cone) = self.cone else {
            self.add_panels(a, b, &mut sum);
            return sum;
        };
        cone.smooth_parts(self.ray, [a, b], |a, b| self.add_panels(a, b, &mut sum));
        sum
    }

    pub(crate) fn ray(&self) -> LampRay {
        self.ray
    }

    /// Largest σt of the channels.
    pub(crate) fn thickest(&self) -> f64 {
        self.medium.sigma_t().into_iter().fold(0.0, f64::max)
    }

    pub(crate) fn cone(&self) -> Option<ConeOnRay> {
        self.cone
    }

    /// The ray parameter at which ln p has grown by `growth` since `a`, and the integrand of [`Self::interval`] there, for a
    /// unit of ln p.
    pub(crate) fn integrand(&self, a: f64, growth: f64) -> (f64, DVec3) {
        let h = self.ray.distance;
        let start = self.ray.path(a);
        let t = self.ray.parameter_at([a, start], growth);
        let path = start * growth.exp();
        let (ratio, inverse) = (path / h, h / path);
        let sech = 2.0 / (ratio + inverse);
        let haversine = ratio / (ratio + inverse);
        let cone = self.cone.map_or(1.0, |cone| cone.factor((ratio - inverse) / (ratio + inverse), sech));
        let attenuation = (-DVec3::from(self.medium.sigma_t()) * (t + self.ray.distance_at(t))).exp();
        (t, self.medium.scattering_towards(haversine) * attenuation * (cone * sech / h))
    }

    /// Adds the panels of one smooth interval.
    fn add_panels(&self, a: f64, b: f64, sum: &mut DVec3) {
        if !(b > a) {
            return;
        }
        let h = self.ray.distance;
        let sigma_t = DVec3::from(self.medium.sigma_t());
        let length = self.ray.log_path_ratio(a, b);
        let start_path = self.ray.path(a);
        // exp(−σ(t + d)) at the start; from there on only the growth of p counts.
        let start_depth = a + self.ray.distance_at(a);
        let start_transmittance = (-sigma_t * start_depth).exp();
        // A cone squares its cosine times its slope (up to 1000), which grows fast off the real axis.
        let longest_panel = if self.cone.is_some() { 0.5 * LONGEST_PANEL } else { LONGEST_PANEL };
        let mut done = 0.0;
        while done < length {
            let path = start_path * f64::exp(done);
            // The steepest channel that still counts decides how long a panel may be; none left is the end.
            let counts = |sigma: f64| sigma * (path - start_path) <= NEGLIGIBLE_OPTICAL_DEPTH;
            let Some(steepest) = sigma_t.to_array().into_iter().filter(|&s| counts(s)).reduce(f64::max)
            else {
                break;
            };
            // Without extinction and b = ∞ the integrand falls as 1/p: p = 1e17·h is the end of f64.
            if path > 1e17 * h && path > 1e17 * start_path {
                break;
            }
            let optical_step = (PANEL_OPTICAL_DEPTH / (steepest * path)).ln_1p();
            let step = (length - done).min(longest_panel).min(optical_step);
            self.add_panel(start_path, done, step, start_transmittance, sum);
            // An optical step too small to move `done` would never end; it is beyond all weight then.
            if done + step == done {
                break;
            }
            done += step;
        }
    }

    /// Adds one panel, `[done, done + step]` in ln p from the interval's start.
    fn add_panel(&self, start_path: f64, done: f64, step: f64, start_transmittance: DVec3, sum: &mut DVec3) {
        let h = self.ray.distance;
        let sigma_t = DVec3::from(self.medium.sigma_t());
        for point in 0..POINTS {
            let growth = done + step * (0.5 + 0.5 * NODES[point]);
            let path = start_path * growth.exp();
            let weight = 0.5 * step * WEIGHTS[point];
            // sech(w)/h and the cosine, both from p alone; ratio = p/h may be anything from 1e-17 to 1e17.
            let ratio = path / h;
            let inverse = h / path;
            let sech = 2.0 / (ratio + inverse);
            // sin²(θ/2) = (1 − cosθ)/2 = p²/(p² + h²).
            let haversine = ratio / (ratio + inverse);
            let mut value = weight * sech / h;
            if let Some(cone) = self.cone {
                value *= cone.factor((ratio - inverse) / (ratio + inverse), sech);
            }
            let advance = start_path * growth.exp_m1();
            let attenuation = if self.grey {
                DVec3::splat((-sigma_t.x * advance).exp())
            } else {
                (-sigma_t * advance).exp()
            };
            *sum += self.medium.scattering_towards(haversine) * start_transmittance * attenuation * value;
        }
    }
}

impl ConeOnRay {
    /// The cone of a spot at `lamp` on a ray, both relative to the eye.
    pub(crate) fn new(spot: &SpotLight, ray: LampRay, origin: DVec3, direction: DVec3, lamp: DVec3) -> Self {
        // From the lamp to the foot of the perpendicular on the ray, as a share of the (clamped) distance. The ray's
        // true offset is used: the clamp changes how far the lamp is, not where the cone points.
        let foot = origin + direction * ray.closest - lamp;
        Self {
            along: spot.direction().dot(direction),
            across: spot.direction().dot(foot) / ray.distance,
            cos_outer: spot.cos_outer(),
            cos_full: spot.cos_full(),
            slope: spot.cone_slope(),
        }
    }

    /// Ray parameters, in no order, where the cone leaves 0 or reaches 1; at most four.
    pub(crate) fn kinks(&self, ray: LampRay) -> impl Iterator<Item = f64> + use<> {
        self.crossings(self.cos_outer, ray).chain(self.crossings(self.cos_full, ray))
    }

    /// Calls `each` for the parts of `[a, b]`, in order, in which the cone's factor is above 0 and smooth.
    pub(crate) fn smooth_parts(&self, ray: LampRay, [a, b]: [f64; 2], mut each: impl FnMut(f64, f64)) {
        // Between these parameters the cone is 0, or 1, or smooth.
        let mut kinks = [a; 6];
        let mut count = 1;
        for t in self.kinks(ray) {
            if t > a && t < b {
                kinks[count] = t;
                count += 1;
            }
        }
        kinks[count] = b;
        kinks[..=count].sort_by(f64::total_cmp);
        for pair in kinks[..=count].windows(2) {
            if pair[1] > pair[0] && self.is_lit_between(pair[0], pair[1], ray) {
                each(pair[0], pair[1]);
            }
        }
    }

    /// The cone factor for tanh w and sech w.
    pub(crate) fn factor(&self, tanh: f64, sech: f64) -> f64 {
        ((self.along * tanh + self.across * sech - self.cos_outer) * self.slope).clamp(0.0, 1.0).powi(2)
    }

    /// Cosine between the axis and the way from the lamp to the point at `t`.
    fn cos_at(&self, t: f64, ray: LampRay) -> f64 {
        if t == f64::INFINITY {
            return self.along;
        }
        let (x, h) = (t - ray.closest, ray.distance);
        (self.along * x + self.across * h) / x.hypot(h)
    }

    /// Whether the cone is above zero between two neighbouring kinks.
    fn is_lit_between(&self, a: f64, b: f64, ray: LampRay) -> bool {
        let middle = if b == f64::INFINITY { a.max(ray.closest) + 1e3 * ray.distance } else { 0.5 * (a + b) };
        self.cos_at(middle, ray) > self.cos_outer
    }

    /// Ray parameters where the cosine passes `± cos`: roots of `(along·x + across·h)² = cos²·(x² + h²)`.
    fn crossings(&self, cos: f64, ray: LampRay) -> impl Iterator<Item = f64> + use<> {
        let h = ray.distance;
        let (along, across) = (self.along, self.across);
        let quadratic = along * along - cos * cos;
        let half_linear = along * across;
        let constant = across * across - cos * cos;
        // half_linear² − quadratic·constant, multiplied out: for a cone of 90° (cos = 6e-17) the difference itself is
        // rounding noise, and a double root would be lost.
        let discriminant = cos * cos * (along * along + across * across - cos * cos);
        let mut roots = [f64::NAN; 2];
        if discriminant >= 0.0 {
            // The root that adds, and the other one by Vieta: no cancellation.
            let q = -(half_linear + discriminant.sqrt().copysign(half_linear));
            roots = [q / quadratic, constant / q];
        }
        // Squaring also finds where the cosine passes −cos. A cut there does no harm, and to tell the two apart by a
        // sign would be rounding noise for a cone of 90°.
        roots.into_iter().filter(|y| y.is_finite()).map(move |y| ray.closest + y * h)
    }
}

/// Gauss-Legendre nodes on [−1, 1] (Abramowitz and Stegun, table 25.4, n = 10).
pub(crate) const NODES: [f64; POINTS] = [
    -0.973_906_528_517_171_7,
    -0.865_063_366_688_984_5,
    -0.679_409_568_299_024_4,
    -0.433_395_394_129_247_2,
    -0.148_874_338_981_631_2,
    0.148_874_338_981_631_2,
    0.433_395_394_129_247_2,
    0.679_409_568_299_024_4,
    0.865_063_366_688_984_5,
    0.973_906_528_517_171_7,
];

/// The weights of [`NODES`].
pub(crate) const WEIGHTS: [f64; POINTS] = [
    0.066_671_344_308_688_14,
    0.149_451_349_150_580_6,
    0.219_086_362_515_982_04,
    0.269_266_719_309_996_36,
    0.295_524_224_714_752_87,
    0.295_524_224_714_752_87,
    0.269_266_719_309_996_36,
    0.219_086_362_515_982_04,
    0.149_451_349_150_580_6,
    0.066_671_344_308_688_14,
];

/// The airlight integral without phase function and cone, `∫ₐᵇ exp(−σ(t+d))/d² dt`: what the closed forms by the
/// exponential integral are about. For tests and for isotropic media.
pub fn airlight(sigma: f64, ray: LampRay, a: f64, b: f64) -> f64 {
    let Ok(medium) = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic) else { return f64::NAN };
    if sigma > 0.0 {
        return LampIntegral::point(ray, &medium).interval(a, b).x / (sigma * crate::INV_4PI);
    }
    // Without extinction the integrand is 1/d²: (1/h)·atan2(h(b−a), h² + (a−t₀)(b−t₀)).
    let (x, y, h) = (a - ray.closest, b - ray.closest, ray.distance);
    (h * (y - x)).atan2(h * h + x * y) / h
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray from the eye with a lamp at distance `lamp` and angle `angle` to the view direction.
    fn ray(lamp: f64, angle: f64) -> LampRay {
        LampRay::new(DVec3::ZERO, DVec3::Z, DVec3::new(lamp * angle.sin(), 0.0, lamp * angle.cos()), 0.0)
    }

    #[test]
    fn the_published_values_come_out() {
        // K = ∫ e^(−σ(x+d))/d² dx for (σ, D, angle, a, b).
        let cases: [(f64, f64, f64, f64, f64, f64); 9] = [
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
        for (sigma, lamp, angle, a, b, exact) in cases {
            let value = airlight(sigma, ray(lamp, angle), a, b);
            // Ten digits are printed: half a unit of the last one.
            assert!(
                (value / exact - 1.0).abs() < 5e-10,
                "({sigma}, {lamp}, {angle}, {a}, {b}): {value} {exact}"
            );
        }
    }

    #[test]
    fn without_extinction_the_integral_is_an_angle() {
        for (lamp, angle) in [(10.0, 0.5), (3.0, 1e-5), (3.0, 3.0), (1e4, 1e-6)] {
            let ray = ray(lamp, angle);
            let tiny = airlight(1e-30, ray, 0.3, 2.5 * lamp);
            let exact = airlight(0.0, ray, 0.3, 2.5 * lamp);
            assert!((tiny / exact - 1.0).abs() < 1e-13, "{lamp} {angle}: {tiny} {exact}");
        }
    }

    #[test]
    fn adjacent_intervals_add_up_for_spots_and_lobes() {
        let medium = Medium::new(
            vec![
                crate::Scattering { sigma_s: [0.3, 0.2, 0.1], phase: Phase::HenyeyGreenstein { g: 0.95 } },
                crate::Scattering { sigma_s: [0.1; 3], phase: Phase::Rayleigh },
            ],
            [0.01, 0.0, 0.02],
        )
        .unwrap();
        let crate::Light::Spot(spot) =
            crate::Light::spot([1.0, 2.0, -6.0], [-0.2, -1.0, 0.1], [1.0; 3], 20.0, 35.0, 0.0).unwrap()
        else {
            unreachable!()
        };
        let lamp = spot.lamp().position();
        let direction = DVec3::new(0.1, 0.05, -1.0).normalize();
        let ray = LampRay::new(DVec3::ZERO, direction, lamp, 0.0);
        let integral = LampIntegral::spot(ray, &medium, &spot, DVec3::ZERO, direction, lamp);
        let whole = integral.interval(0.0, 40.0);
        let parts: DVec3 =
            (0..4000).map(|i| integral.interval(f64::from(i) * 0.01, f64::from(i + 1) * 0.01)).sum();
        assert!(whole.min_element() > 0.0);
        assert!(((parts - whole) / whole).abs().max_element() < 1e-12, "{parts} {whole}");
    }

    /// `∫ₐᵇ` by the midpoint rule in t of the integrand as MODEL.md writes it: slow, and independent.
    fn midpoint(
        light: &crate::Light,
        medium: &Medium,
        direction: DVec3,
        a: f64,
        b: f64,
        count: u32,
    ) -> DVec3 {
        let lamp = light.position().unwrap();
        let step = (b - a) / f64::from(count);
        (0..count)
            .map(|i| {
                let t = a + (f64::from(i) + 0.5) * step;
                let x = direction * t;
                let d = x.distance(lamp);
                let travel = (x - lamp) / d;
                let cone = match light {
                    crate::Light::Spot(spot) => spot.cone(spot.direction().dot(travel)),
                    _ => 1.0,
                };
                let cos_theta = travel.dot(-direction);
                let scattering: DVec3 =
                    medium.components().iter().map(|c| DVec3::from(c.sigma_s) * c.phase.at(cos_theta)).sum();
                let sigma_t = DVec3::from(medium.sigma_t());
                scattering * (-sigma_t * (t + d)).exp() * (cone / (d * d)) * step
            })
            .sum()
    }

    #[test]
    fn the_panels_agree_with_the_integrand_as_the_model_writes_it() {
        let direction = DVec3::new(0.2, -0.1, -1.0).normalize();
        for g in [-0.9, 0.0, 0.6, 0.95] {
            let phase = Phase::HenyeyGreenstein { g };
            let medium = Medium::homogeneous([0.2, 0.05, 1.0], [0.02, 0.0, 0.3], phase).unwrap();
            let position = [1.0, 0.5, -4.0];
            for light in [
                crate::Light::point(position, [1.0; 3], 0.0).unwrap(),
                crate::Light::spot(position, [-0.3, -1.0, 0.4], [1.0; 3], 15.0, 50.0, 0.0).unwrap(),
                crate::Light::spot(position, [0.2, -0.3, 1.0], [1.0; 3], 30.0, 30.0, 0.0).unwrap(),
            ] {
                let ray = LampRay::new(DVec3::ZERO, direction, position.into(), 0.0);
                let integral = match &light {
                    crate::Light::Spot(spot) => {
                        LampIntegral::spot(ray, &medium, spot, DVec3::ZERO, direction, position.into())
                    }
                    _ => LampIntegral::point(ray, &medium),
                };
                let (a, b) = (0.25, 11.0);
                let exact = midpoint(&light, &medium, direction, a, b, 400_000);
                let value = integral.interval(a, b);
                // Midpoint: (Δt)²/24·(b−a)·max f'' with Δt = 2.7e-5; the cone's kinks are steepest (s = 1000).
                let error = ((value - exact) / exact.max(DVec3::splat(1e-12))).abs().max_element();
                assert!(error < 2e-6, "g {g}, {light:?}: {value} {exact}");
            }
        }
    }

    #[test]
    fn each_channel_is_as_exact_beside_others_as_alone() {
        // Extinctions a thousandfold apart: the panels must resolve the middle one after the first has faded.
        let sigmas = [1e3, 1.0, 1e-3];
        let phase = Phase::HenyeyGreenstein { g: 0.5 };
        let together = Medium::homogeneous(sigmas, [0.0; 3], phase).unwrap();
        for angle in [1e-4, 0.3, 2.0] {
            let ray = ray(2.0, angle);
            let value = LampIntegral::point(ray, &together).interval(0.1, 60.0);
            for (channel, &sigma) in sigmas.iter().enumerate() {
                let alone = Medium::homogeneous([sigma; 3], [0.0; 3], phase).unwrap();
                let exact = LampIntegral::point(ray, &alone).interval(0.1, 60.0).x;
                let error = (value[channel] - exact).abs();
                assert!(error <= 1e-12 * exact, "{angle} {sigma}: {} {exact}", value[channel]);
            }
        }
    }

    #[test]
    fn nothing_is_ever_nan_or_negative_and_the_integral_grows_with_its_end() {
        let medium = |sigma: f64| {
            Medium::homogeneous([sigma; 3], [0.0; 3], Phase::HenyeyGreenstein { g: -0.99 }).unwrap()
        };
        for sigma in [1e-9, 1e-3, 1.0, 1e3] {
            let medium = medium(sigma);
            for angle in [0.0, 1e-9, 1e-3, 1.0, 3.0, std::f64::consts::PI] {
                let integral = LampIntegral::point(ray(7.0, angle), &medium);
                let mut last = 0.0;
                for b in [0.0, 1e-9, 0.5, 6.999, 7.0, 7.001, 50.0, 1e6, f64::INFINITY] {
                    let value = integral.interval(0.0, b).x;
                    // To rounding: the panels of two ends differ.
                    assert!(
                        value.is_finite() && value >= last * (1.0 - 1e-13),
                        "{sigma} {angle} {b}: {value} {last}"
                    );
                    last = value;
                }
            }
        }
    }

    #[test]
    fn a_ray_through_the_lamp_is_taken_at_a_millionth_of_its_distance() {
        let through = ray(10.0, 0.0);
        assert!((through.distance / 1e-5 - 1.0).abs() < 1e-15);
        // π/h less the two ends: ∫ dt/(t²+h²) over [−10, 10].
        let exact = 2.0 * (10.0f64 / 1e-5).atan() / 1e-5;
        assert!((airlight(1e-30, through, 0.0, 20.0) / exact - 1.0).abs() < 1e-12);
    }
}
