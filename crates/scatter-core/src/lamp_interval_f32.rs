//! Lit intervals near a lamp in f32, sixteen rays at a time: the airlight integral for techniques, without a libm call.
//!
//! The same integral and the same variable as the exact form (`lamp_interval.rs`), `r = p/h = ((t−t₀)+d)/h`:
//!
//! ```text
//!     (1/h) ∫ 2/(1 + r²) · e^{−σh·r} · phase(sin²(θ/2) = r²/(1+r²)) · C dr
//! ```
//!
//! Departures from the exact form:
//!
//! 1. Panels are not cut in ln r, but in a quotient that follows it (`lamp_panels.rs`): no logarithm and no exponential
//!    but the attenuation.
//! 2. They have 4, 6, 8 or 12 points by what the longest interval of the sixteen needs, and intervals that are too long
//!    for one are cut into panels of 8, or 12 where a cone fades. Lanes that need fewer panels add zeros, so that no lane
//!    depends on another but for the choice of the rule.
//! 3. A spot's interval is cut where the cone starts, is full, is full no longer, and ends (in f64): three pieces, of which
//!    the middle one is a point light's. The exact form cuts at the mirrored cone as well, which does no harm.
//! 4. Behind an optical depth of [`NEGLIGIBLE_OPTICAL_DEPTH`] the rest is dropped.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd};
use glam::{DVec3, Vec3};

use crate::at_level;
use crate::camera::ViewRay;
use crate::lamp_panels::{Even, Fading, Lanes, Lobe, Mixed, Panel, RULES, Rule, Scatter, exp2};
use crate::light::{Light, PointLight, SpotLight};
use crate::medium::Medium;
use crate::phase::{INV_4PI, Phase};
use crate::ray_lanes::{LANES, LampLanes, LampPlace, RayLanes};
use crate::ray_light::RayLight;

/// The rules of intervals that are longer than one panel, without and with a cone that fades: the fewest points for what
/// most of them need.
const MANY: [&Rule; 2] = [&RULES[2], &RULES[3]];

/// Where the rest is dropped: e⁻¹⁶ = 1.1e-7.
const NEGLIGIBLE_OPTICAL_DEPTH: f32 = 16.0;

/// How far endless rays reach, in units of `1 + r`: what is behind has 1e-9 of the integral, 2e-7 of it in a lobe of
/// g = −0.99.
const ENDLESS: f32 = 1e9;

/// Largest r: its square times a few fits into f32.
const FARTHEST: f32 = 1e18;

/// Panels of one interval at most: [`ENDLESS`] needs 14 from the closest start, and each channel's extinction 3 more.
const MOST_PANELS: usize = 40;

/// Largest σ·h. Products with it stay in f32's range, and such air is opaque at any distance.
const THICKEST: f32 = 1e18;

/// The airlight integral of a lamp along the view rays of a frame.
///
/// Measured over h/D from 1e-5 to 1, |g| ≤ 0.99 and σ·D from 1e-6 to 1e3, for rays that start before, at and behind the
/// lamp, of any length: error ≤ 1.2e-5 of the value, 5.9e-6 at the worst of all tests. No value is NaN or infinite.
///
/// A spot's error is ≤ `8·2⁻²⁴·s` of the lamp without its cone, s the cone's slope (1/s = cos inner − cos outer), on top:
/// the cosine is a sum of two rounded products less a rounded number (4·2⁻²⁴), and the factor is its square.
///
/// In height fog the exact form ([`RayLight`]) is taken ray by ray: right, and slow. No technique has a use for more.
#[derive(Debug, Clone)]
pub struct LampIntegralF32<'a> {
    place: LampPlace,
    sigma_t: [f32; 3],
    grey: bool,
    /// Times all that does not depend on the ray.
    intensity: Vec3,
    air: Air<'a>,
}

/// How the medium scatters.
#[derive(Debug, Clone)]
enum Air<'a> {
    /// Isotropic particles of one kind in grey air.
    Even,
    /// Henyey and Greenstein's of one kind in grey air.
    Lobe(Lobe),
    /// Anything.
    Mixed(Mixed<'a>),
    /// Height fog: the exact form, ray by ray.
    Fog { light: Light, medium: &'a Medium, eye: DVec3 },
}

impl<'a> LampIntegralF32<'a> {
    /// For a light and a camera whose eye is at `eye` (world space); `None` for a directional light.
    pub fn new(light: &Light, medium: &'a Medium, eye: DVec3) -> Option<Self> {
        match light {
            Light::Directional(_) => None,
            Light::Point(lamp) => Some(Self::point(lamp, medium, eye)),
            Light::Spot(spot) => Some(Self::spot(spot, medium, eye)),
        }
    }

    /// For a lamp that shines to all sides.
    pub fn point(lamp: &PointLight, medium: &'a Medium, eye: DVec3) -> Self {
        Self::of(lamp, None, medium, eye)
    }

    /// For a lamp with a cone.
    pub fn spot(spot: &SpotLight, medium: &'a Medium, eye: DVec3) -> Self {
        Self::of(spot.lamp(), Some(spot), medium, eye)
    }

    fn of(lamp: &PointLight, spot: Option<&SpotLight>, medium: &'a Medium, eye: DVec3) -> Self {
        let fog_light = || match spot {
            Some(spot) => Light::Spot(spot.clone()),
            None => Light::Point(lamp.clone()),
        };
        let (air, factor) = match medium.components() {
            _ if medium.height_falloff().is_some() => {
                (Air::Fog { light: fog_light(), medium, eye }, DVec3::ONE)
            }
            [only] if medium.is_grey() && only.phase.is_isotropic() => {
                (Air::Even, DVec3::from(only.sigma_s) * INV_4PI)
            }
            [only] if medium.is_grey() && only.phase != Phase::Rayleigh => {
                let Phase::HenyeyGreenstein { g } = only.phase else { unreachable!("there are three") };
                (Air::Lobe(Lobe::new(g)), DVec3::from(only.sigma_s) * Lobe::strength(g))
            }
            _ => (Air::Mixed(Mixed::new(medium)), DVec3::ONE),
        };
        Self {
            place: LampPlace::new(lamp, spot, eye),
            sigma_t: medium.sigma_t().map(|sigma| sigma as f32),
            grey: medium.is_grey(),
            intensity: (DVec3::from(lamp.intensity()) * factor).as_vec3(),
            air,
        }
    }

    /// In-scattered radiance of the lit intervals `[a, b]` of sixteen rays, 0 ≤ a ≤ b ≤ ∞, as `[channel][ray]`.
    ///
    /// Cost: 4 to 12 evaluations for intervals that are short, or pass the lamp at a fifth of their length; about 60 where
    /// they pass at 1e-3 of it. A cone doubles or trebles that. The longest of the sixteen counts.
    pub fn intervals(
        &self,
        simd: Level,
        rays: &RayLanes,
        a: &[f32; LANES],
        b: &[f32; LANES],
    ) -> [[f32; LANES]; 3] {
        if let Air::Fog { light, medium, eye } = &self.air {
            return exact_intervals(light, medium, *eye, rays, a, b);
        }
        at_level!(simd, vectors => self.intervals_on(vectors, rays, a, b))
    }

    #[inline(always)]
    fn intervals_on<S: Simd>(
        &self,
        simd: S,
        rays: &RayLanes,
        a: &[f32; LANES],
        b: &[f32; LANES],
    ) -> [[f32; LANES]; 3] {
        let sums = match &self.air {
            Air::Even => [self.integrate(simd, &Even, rays, a, b)[0]; 3],
            Air::Lobe(lobe) => [self.integrate(simd, lobe, rays, a, b)[0]; 3],
            Air::Mixed(mixed) => self.integrate(simd, mixed, rays, a, b),
            Air::Fog { .. } => unreachable!("height fog has a way of its own"),
        };
        let mut radiance = [[0.0; LANES]; 3];
        for (channel, values) in radiance.iter_mut().enumerate() {
            let value = sums[channel] * self.intensity[channel];
            value.min(Lanes::splat(simd, f32::MAX)).store_slice(values);
        }
        radiance
    }

    /// The integrals without the intensity.
    #[inline(always)]
    fn integrate<S: Simd, const C: usize>(
        &self,
        simd: S,
        air: &impl Scatter<C>,
        rays: &RayLanes,
        a: &[f32; LANES],
        b: &[f32; LANES],
    ) -> [Lanes<S>; C] {
        let at = self.place.on(rays);
        let ends = [at.points(a), at.points(b)];
        let along = Along::new(simd, self, &at);
        let mut sums = [Lanes::splat(simd, 0.0); C];
        if let Some(cone) = self.place.cone_on(rays, &at, &ends) {
            let fading = Fading {
                along: narrow(simd, &cone.along),
                across: narrow(simd, &cone.across),
                cos_outer: cone.cos_outer as f32,
                slope: cone.slope as f32,
            };
            let ([lit, end], [full, full_end]) = (&cone.lit, &cone.full);
            along.add_piece(air, [full, full_end], None, &mut sums);
            for piece in [[lit, full], [full_end, end]] {
                along.add_piece(air, piece, Some(&fading), &mut sums);
            }
        } else {
            along.add_piece(air, [&ends[0], &ends[1]], None, &mut sums);
        }
        let inverse = narrow(simd, &at.inverse).min(Lanes::splat(simd, f32::MAX));
        for sum in &mut sums {
            *sum *= inverse;
        }
        sums
    }
}

fn exact_intervals(
    light: &Light,
    medium: &Medium,
    eye: DVec3,
    rays: &RayLanes,
    a: &[f32; LANES],
    b: &[f32; LANES],
) -> [[f32; LANES]; 3] {
    let mut radiance = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let axis = |way: &[[f64; LANES]; 3]| DVec3::from([way[0][lane], way[1][lane], way[2][lane]]);
        let ray = ViewRay { origin: axis(&rays.origin), direction: axis(&rays.direction) };
        let value = RayLight::new(light, medium, eye, &ray).interval(a[lane].into(), b[lane].into());
        for (channel, values) in radiance.iter_mut().enumerate() {
            values[lane] = (value[channel] as f32).min(f32::MAX);
        }
    }
    radiance
}

/// What the pieces of sixteen rays have in common.
struct Along<'a, S: Simd> {
    simd: S,
    at: &'a LampLanes,
    /// h.
    distance: Lanes<S>,
    sigma_t: [f32; 3],
    /// σ·h by channel.
    kappa: [Lanes<S>; 3],
    grey: bool,
}

impl<'a, S: Simd> Along<'a, S> {
    #[inline(always)]
    fn new(simd: S, integral: &LampIntegralF32<'_>, at: &'a LampLanes) -> Self {
        let distance = narrow(simd, &at.distance);
        let thickest = Lanes::splat(simd, THICKEST);
        let mut kappa = [distance; 3];
        for (kappa, sigma) in kappa.iter_mut().zip(integral.sigma_t) {
            *kappa = (distance * sigma).min(thickest);
        }
        Self { simd, at, distance, sigma_t: integral.sigma_t, kappa, grey: integral.grey }
    }

    #[inline(always)]
    fn splat(&self, value: f32) -> Lanes<S> {
        Lanes::splat(self.simd, value)
    }

    /// Adds the integrals between two points of each ray, without a kink of the cone between them.
    #[inline(always)]
    fn add_piece<const C: usize>(
        &self,
        air: &impl Scatter<C>,
        [from, to]: [&[f64; LANES]; 2],
        fading: Option<&Fading<S>>,
        sums: &mut [Lanes<S>; C],
    ) {
        let simd = self.simd;
        let mut length = [0.0; LANES];
        for lane in 0..LANES {
            length[lane] = to[lane] - from[lane];
        }
        let length = narrow(simd, &length);
        let is_lit = length.simd_gt(self.splat(0.0));
        if !is_lit.any_true() {
            return;
        }
        // Points in units of h, and their distances to the lamp: d = h·√(1 + y²).
        let (near, far) = (narrow(simd, from), narrow(simd, to));
        let near_distance = (near * near + 1.0).sqrt();
        let far_distance = (far * far + 1.0).sqrt();
        let start = reduced_path(simd, near, near_distance);
        let end = reduced_path(simd, far, far_distance);
        // tanh of half the interval in ln r is its length over the sum of the distances: short ones do not cancel.
        let sum = near_distance + far_distance;
        let short = start * (length + length) / (sum - length);
        let reach = length.simd_lt(sum * 0.5).select(short, end - start);
        let [r, g, b] = self.kappa;
        let weakest = if self.grey { r } else { r.min(g).min(b) };
        let reach = reach
            .min((start + 1.0) * ENDLESS)
            .min(self.splat(FARTHEST))
            .min(NEGLIGIBLE_OPTICAL_DEPTH / weakest);
        let reach = is_lit.select(reach, self.splat(0.0));

        let mut integrals = [self.splat(0.0); C];
        self.add_panels(air, start, reach, fading, &mut integrals);

        // t + d at the start: two terms ≥ 0.
        let mut t = [0.0; LANES];
        for lane in 0..LANES {
            t[lane] = self.at.closest[lane] + from[lane] * self.at.distance[lane];
        }
        let path = (narrow(simd, &t) + near_distance * self.distance).min(self.splat(f32::MAX));
        let mut through = self.splat(0.0);
        for c in 0..C {
            if c == 0 || !self.grey {
                let exponent = path * (self.sigma_t[c] * -std::f32::consts::LOG2_E);
                through = exponent.simd_gt(self.splat(-125.0)).select(exp2(simd, exponent), self.splat(0.0));
            }
            sums[c] = integrals[c] * through + sums[c];
        }
    }

    /// Adds the panels from `start` to `start + reach` in r.
    #[inline(always)]
    fn add_panels<const C: usize>(
        &self,
        air: &impl Scatter<C>,
        start: Lanes<S>,
        reach: Lanes<S>,
        fading: Option<&Fading<S>>,
        sums: &mut [Lanes<S>; C],
    ) {
        let simd = self.simd;
        let zero = self.splat(0.0);
        let [r, g, b] = self.kappa;
        let strongest = if self.grey { r } else { r.max(g).max(b) };
        let mut exponents = [zero; C];
        for (exponent, kappa) in exponents.iter_mut().zip(self.kappa) {
            *exponent = kappa * -std::f32::consts::LOG2_E;
        }
        let fades = fading.is_some();
        let only = rule_for(simd, fades, reach / start, strongest * reach);
        let rule = only.unwrap_or(MANY[usize::from(fades)]);
        let (mut from, mut rest) = (zero, reach);
        for _ in 0..MOST_PANELS {
            let mut step = rest;
            if only.is_none() {
                let mut steepest = strongest;
                if !self.grey {
                    // The steepest channel that still counts decides how long a panel may be.
                    steepest = zero;
                    for kappa in self.kappa {
                        let counts = (kappa * from).simd_le(self.splat(NEGLIGIBLE_OPTICAL_DEPTH));
                        steepest = steepest.max(counts.select(kappa, zero));
                    }
                }
                step = step.min((start + from) * rule.growth(fades)).min(rule.optical_depth / steepest);
            }
            let panel = Panel { simd, start, from, step };
            rule.add(&panel, air, &exponents, self.grey, fading, sums);
            (from, rest) = (from + step, rest - step);
            if !rest.simd_gt(zero).any_true() {
                return;
            }
        }
        debug_assert!(false, "more than {MOST_PANELS} panels");
    }
}

/// The rule that does with one panel, if there is one.
#[inline(always)]
fn rule_for<S: Simd>(
    simd: S,
    fades: bool,
    growth: Lanes<S>,
    optical_depth: Lanes<S>,
) -> Option<&'static Rule> {
    for rule in &RULES {
        let too_long = growth.simd_gt(Lanes::splat(simd, rule.growth(fades)));
        let too_thick = optical_depth.simd_gt(Lanes::splat(simd, rule.optical_depth));
        if !(too_long | too_thick).any_true() {
            return Some(rule);
        }
    }
    None
}

/// `r = y + √(1 + y²)`, without cancellation before the closest approach.
#[inline(always)]
fn reduced_path<S: Simd>(simd: S, y: Lanes<S>, distance: Lanes<S>) -> Lanes<S> {
    let sum = y.abs() + distance;
    y.simd_lt(Lanes::splat(simd, 0.0)).select(1.0 / sum, sum)
}

/// Rounded to f32.
#[inline(always)]
fn narrow<S: Simd>(simd: S, wide: &[f64; LANES]) -> Lanes<S> {
    let mut narrow = [0.0; LANES];
    for lane in 0..LANES {
        narrow[lane] = wide[lane] as f32;
    }
    Lanes::from_slice(simd, &narrow)
}

#[cfg(test)]
mod tests;
