//! One lit interval near a lamp in f32: the airlight integral for techniques, without a libm call.
//!
//! The same integral and the same variable as the exact form (`lamp_interval.rs`), `r = p/h = ((t−t₀)+d)/h`:
//!
//! ```text
//!     (1/h) ∫ 2/(1 + r²) · e^{−σh·r} · phase(sin²(θ/2) = r²/(1+r²)) · C dr
//! ```
//!
//! cut in two at the optical depth that one panel resolves. Before it, Gauss-Legendre panels of equal length ≤ 1 in
//! ln r, whose nodes follow from each other by a product: no exponential a node but the attenuation. Behind it, panels
//! of equal optical depth in r, whose attenuation follows by a product too; they end where e⁻¹⁸ is left.
//!
//! Four points a panel: an ellipse of 6.4 gives 6.4⁻⁸ = 4e-7 of a panel, which is what f32 can hold.

use glam::{DVec3, Vec3};

use crate::camera::ViewRay;
use crate::lamp_interval::{ConeOnRay, LampRay};
use crate::light::Light;
use crate::medium::Medium;
use crate::sun_interval::exp_f32;

/// Gauss-Legendre nodes on [0, 1] (Abramowitz and Stegun, table 25.4, n = 4).
const NODES: [f32; 4] = [0.069_431_84, 0.330_009_5, 0.669_990_5, 0.930_568_16];
/// Their weights; they add up to 1.
const WEIGHTS: [f32; 4] = [0.173_927_42, 0.326_072_57, 0.326_072_57, 0.173_927_42];
/// Optical depth of a panel: 4 points resolve e⁻²ᵘ to 3e-7.
const PANEL_OPTICAL_DEPTH: f32 = 2.0;
/// Where the rest is dropped: e⁻¹⁸ = 1.5e-8.
const NEGLIGIBLE_OPTICAL_DEPTH: f32 = 18.0;

/// The airlight integral along one view ray, for any number of intervals.
///
/// Measured over h/D from 1e-5 to 1, |g| ≤ 0.99 and σ·D from 1e-6 to 30, for rays that start before, at and behind
/// the lamp: error ≤ 2e-5 of the value (`the_bound_holds_over_the_stated_range`), less than half of which is the
/// quadrature's; the rest is the rounding of `σ·(t + d)` and of the interval's ends to f32.
///
/// A spot's intervals are cut at the kinks of its cone, found in f64 once a ray; its error is ≤ `8·2⁻²⁴·s` of the
/// lamp without its cone, s the cone's slope (1/s = cos inner − cos outer), on top: the cosine is a sum of two rounded
/// products less a rounded number (4·2⁻²⁴), and the factor is its square.
#[derive(Debug, Clone)]
pub struct LampIntegralF32<'a> {
    closest: f32,
    distance: f32,
    sigma_t: Vec3,
    grey: bool,
    /// Intensity over h.
    strength: Vec3,
    cone: Option<Cone>,
    medium: &'a Medium,
}

#[derive(Debug, Clone, Copy)]
struct Cone {
    along: f32,
    across: f32,
    cos_outer: f32,
    slope: f32,
    /// Ray parameters, ascending, between which the cone is 0, 1 or smooth; NaN where there are fewer.
    kinks: [f32; 4],
}

impl<'a> LampIntegralF32<'a> {
    /// For a ray of a camera whose eye is at `eye` (world space); `None` for a directional light.
    pub fn new(light: &Light, medium: &'a Medium, eye: DVec3, ray: &ViewRay) -> Option<Self> {
        let (lamp, spot) = match light {
            Light::Directional(_) => return None,
            Light::Point(lamp) => (lamp, None),
            Light::Spot(spot) => (spot.lamp(), Some(spot)),
        };
        let relative = lamp.position() - eye;
        let LampRay { closest, distance } = LampRay::new(ray.origin, ray.direction, relative, lamp.radius());
        let lamp_ray = LampRay { closest, distance };
        let cone = spot.map(|spot| {
            let on_ray = ConeOnRay::new(spot, lamp_ray, ray.origin, ray.direction, relative);
            let mut kinks = [f32::NAN; 4];
            for (kink, t) in kinks.iter_mut().zip(on_ray.kinks(lamp_ray)) {
                *kink = t as f32;
            }
            kinks.sort_by(f32::total_cmp);
            Cone {
                along: on_ray.along as f32,
                across: on_ray.across as f32,
                cos_outer: on_ray.cos_outer as f32,
                slope: on_ray.slope as f32,
                kinks,
            }
        });
        Some(Self {
            closest: closest as f32,
            distance: distance as f32,
            sigma_t: DVec3::from(medium.sigma_t()).as_vec3(),
            grey: medium.is_grey(),
            strength: (DVec3::from(lamp.intensity()) / distance).as_vec3(),
            cone,
            medium,
        })
    }

    /// In-scattered radiance of the lit interval `[a, b]`, 0 ≤ a ≤ b ≤ ∞.
    ///
    /// Cost: four evaluations for a short interval, about 60 for a whole ray that passes at h = 1e-3 of its length.
    pub fn interval(&self, a: f32, b: f32) -> Vec3 {
        let Some(cone) = &self.cone else { return self.smooth_interval(a, b) };
        let mut sum = Vec3::ZERO;
        let mut begin = a;
        for &kink in cone.kinks.iter().filter(|&&kink| kink > a && kink < b) {
            sum += self.smooth_interval(begin, kink);
            begin = kink;
        }
        sum + self.smooth_interval(begin, b)
    }

    /// An interval without a kink of the cone inside.
    fn smooth_interval(&self, a: f32, b: f32) -> Vec3 {
        if !(b > a) {
            return Vec3::ZERO;
        }
        let start = self.reduced_path(a);
        // σ·h by channel; exponents count from the interval's start.
        let kappa = self.sigma_t * self.distance;
        let (weakest, strongest) = (kappa.min_element(), kappa.max_element());
        let mut end = if b == f32::INFINITY { 1e9 * (1.0 + start) } else { self.reduced_path(b) };
        // Short intervals: the difference of the ends in r is (b−a)·(dr/dt) to second order, without cancellation.
        let ratio = (b - a) / (self.distance_at(a) + self.distance_at(b));
        let mut log_length = if ratio < 0.1 { short_log(ratio) } else { ln_f32(end / start) };
        if weakest * (end - start) > NEGLIGIBLE_OPTICAL_DEPTH {
            end = start + NEGLIGIBLE_OPTICAL_DEPTH / weakest;
            log_length = log_length.min(ln_f32(end / start));
        }
        let distance_a = self.distance_at(a);
        let start_transmittance = self.exp(self.sigma_t * -(a + distance_a));
        // The part with equal panels in ln r: all of it, or up to the optical depth of one panel.
        let resolved = start + PANEL_OPTICAL_DEPTH / strongest;
        let mut sum = Vec3::ZERO;
        if strongest * (end - start) <= PANEL_OPTICAL_DEPTH {
            self.log_panels(start, log_length, kappa, &mut sum);
        } else {
            self.log_panels(start, ln_f32(resolved / start), kappa, &mut sum);
            self.optical_panels(start, resolved, end, kappa, &mut sum);
        }
        sum * start_transmittance * self.strength
    }

    fn distance_at(&self, t: f32) -> f32 {
        let x = t - self.closest;
        (x * x + self.distance * self.distance).sqrt()
    }

    /// `r = ((t−t₀)+d)/h` without cancellation before the closest approach.
    fn reduced_path(&self, t: f32) -> f32 {
        let x = t - self.closest;
        let d = self.distance_at(t);
        if x < 0.0 { self.distance / (d - x) } else { (x + d) / self.distance }
    }

    fn exp(&self, exponent: Vec3) -> Vec3 {
        if self.grey {
            Vec3::splat(exp_f32(exponent.x))
        } else {
            Vec3::new(exp_f32(exponent.x), exp_f32(exponent.y), exp_f32(exponent.z))
        }
    }

    /// Panels of equal length in ln r.
    fn log_panels(&self, start: f32, log_length: f32, kappa: Vec3, sum: &mut Vec3) {
        // A cone squares its cosine times its slope, which grows fast off the real axis: half the length for it.
        let panels_a_unit = if self.cone.is_some() { 2.0 } else { 1.0 };
        let count = (log_length * panels_a_unit).ceil().max(1.0);
        let step = log_length / count;
        let growth = NODES.map(|x| exp_f32(step * x));
        // e^{step·x} − 1 keeps its digits for short intervals; it is the way from the start of the first panel.
        let advance = NODES.map(|x| expm1_small(step * x));
        let panel_growth = exp_f32(step);
        let mut r = start;
        for panel in 0..count as u32 {
            for node in 0..4 {
                let here = r * growth[node];
                let behind = if panel == 0 { r * advance[node] } else { here - start };
                let weight = WEIGHTS[node] * step * here;
                *sum += self.integrand(here) * self.exp(-kappa * behind) * weight;
            }
            r *= panel_growth;
        }
    }

    /// Panels in r, each at most [`PANEL_OPTICAL_DEPTH`] of the steepest channel that still counts, and at most an
    /// octave.
    fn optical_panels(&self, start: f32, from: f32, to: f32, kappa: Vec3, sum: &mut Vec3) {
        let to = to.max(from);
        let mut r = from;
        while r < to {
            let counts = |kappa: f32| kappa * (r - start) <= NEGLIGIBLE_OPTICAL_DEPTH;
            let Some(steepest) = kappa.to_array().into_iter().filter(|&k| counts(k)).reduce(f32::max) else {
                break;
            };
            let step = (to - r).min(PANEL_OPTICAL_DEPTH / steepest).min(r);
            for node in 0..4 {
                let here = r + step * NODES[node];
                *sum += self.integrand(here) * self.exp(-kappa * (here - start)) * (WEIGHTS[node] * step);
            }
            let next = r + step;
            if next <= r {
                break;
            }
            r = next;
        }
    }

    /// `2/(1+r²)·phase·C`, RGB by the components' σs.
    #[inline]
    fn integrand(&self, r: f32) -> Vec3 {
        let cos_sq = 1.0 / (1.0 + r * r);
        let sin_sq = r * r * cos_sq;
        let mut factor = 2.0 * cos_sq;
        if let Some(cone) = self.cone {
            let (tanh, sech) = (sin_sq - cos_sq, 2.0 * r * cos_sq);
            let cos_axis = cone.along * tanh + cone.across * sech;
            let share = ((cos_axis - cone.cos_outer) * cone.slope).clamp(0.0, 1.0);
            factor *= share * share;
        }
        let mut scattering = Vec3::ZERO;
        for component in self.medium.components() {
            scattering +=
                DVec3::from(component.sigma_s).as_vec3() * component.phase.at_haversine_f32(sin_sq, cos_sq);
        }
        scattering * factor
    }
}

/// `2·atanh(q)` for 0 ≤ q < 0.1: the first term left out is 2q⁹/9 < 3e-10.
fn short_log(q: f32) -> f32 {
    let q_sq = q * q;
    2.0 * q * (1.0 + q_sq * (1.0 / 3.0 + q_sq * (1.0 / 5.0 + q_sq * (1.0 / 7.0))))
}

/// `ln x` for normal x > 0, relative error ≤ 2e-7 away from 1.
fn ln_f32(x: f32) -> f32 {
    // Mantissa in [√½, √2): the series below is in s² ≤ 0.0295.
    let bits = x.to_bits().wrapping_sub(std::f32::consts::FRAC_1_SQRT_2.to_bits());
    let exponent = (bits as i32) >> 23;
    let mantissa = f32::from_bits(x.to_bits().wrapping_sub((exponent as u32) << 23));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s_sq = s * s;
    let log =
        2.0 * s * (1.0 + s_sq * (1.0 / 3.0 + s_sq * (1.0 / 5.0 + s_sq * (1.0 / 7.0 + s_sq * (1.0 / 9.0)))));
    exponent as f32 * std::f32::consts::LN_2 + log
}

/// `eˣ − 1` for 0 ≤ x ≤ 1; Taylor for small x, where the subtraction would cancel.
fn expm1_small(x: f32) -> f32 {
    if x < 0.25 {
        x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x / 720.0)))))
    } else {
        exp_f32(x) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::Phase;
    use crate::ray_light::RayLight;

    #[test]
    fn the_bound_holds_over_the_stated_range() {
        let mut worst = (0.0f64, String::new());
        for g in [-0.99, -0.5, 0.0, 0.7, 0.99] {
            for sigma_d in [1e-6f64, 0.1, 1.0, 5.0, 30.0] {
                for h in [1e-5, 1e-3, 0.03, 0.3, 1.0] {
                    for closest in [-0.5, 0.25, 0.5, 1.5] {
                        let phase = Phase::HenyeyGreenstein { g };
                        let medium = Medium::homogeneous([sigma_d; 3], [0.0; 3], phase).unwrap();
                        // f32 inputs, so that the exact form sees the same ray: D = 1.
                        let h = f64::from(h as f32);
                        let lamp = [h, 0.0, -closest];
                        let light = Light::point(lamp, [1.0; 3], 0.0).unwrap();
                        let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
                        let exact = RayLight::new(&light, &medium, DVec3::ZERO, &ray);
                        let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO, &ray).unwrap();
                        for (a, b) in
                            [(0.0f32, 1.0f32), (0.0, 0.125), (0.375, 0.75), (0.5, 0.50390625), (0.875, 1.0)]
                        {
                            let reference = exact.interval(a.into(), b.into()).x;
                            let error = (f64::from(fast.interval(a, b).x) / reference - 1.0).abs();
                            if error > worst.0 {
                                worst = (error, format!("g {g} σD {sigma_d} h {h} t₀ {closest} [{a}, {b}]"));
                            }
                        }
                    }
                }
            }
        }
        println!("LampIntegralF32: worst relative error {:.2e} at {}", worst.0, worst.1);
        assert!(worst.0 < 2e-5, "{worst:?}");
    }

    #[test]
    fn coloured_air_and_endless_rays_agree_with_the_exact_form() {
        let medium = Medium::new(
            vec![
                crate::Scattering { sigma_s: [0.05, 0.4, 3.0], phase: Phase::Rayleigh },
                crate::Scattering { sigma_s: [0.1; 3], phase: Phase::HenyeyGreenstein { g: 0.8 } },
            ],
            [0.0, 0.1, 0.0],
        )
        .unwrap();
        let light = Light::point([0.25, 0.5, -2.0], [3.0, 2.0, 1.0], 0.0).unwrap();
        let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
        let exact = RayLight::new(&light, &medium, DVec3::ZERO, &ray);
        let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO, &ray).unwrap();
        for (a, b) in [(0.0f32, f32::INFINITY), (0.0, 100.0), (1.5, 40.0), (8.0, 9.0)] {
            let (value, reference) = (fast.interval(a, b).as_dvec3(), exact.interval(a.into(), b.into()));
            let error = ((value - reference) / reference).abs().max_element();
            // The blue channel behind 8 units has e⁻⁴⁵ left: its exponent alone is rounded by 45·2⁻²⁴ = 3e-6.
            assert!(error < 3e-5, "[{a}, {b}]: {value} {reference}");
        }
    }

    #[test]
    fn cones_agree_with_the_exact_form_wherever_their_edges_fall() {
        let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let mut worst = 0.0f64;
        for n in 0..500 {
            let a = f64::from(n);
            let axis = [a.sin(), (1.7 * a).cos(), (0.6 * a).sin()];
            let outer = 5.0 + 80.0 * (0.5 + 0.5 * (0.9 * a).sin());
            let light = Light::spot([a.cos(), 1.0, -3.0], axis, [1.0; 3], 0.5 * outer, outer, 0.0).unwrap();
            let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
            let exact = RayLight::new(&light, &medium, DVec3::ZERO, &ray);
            let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO, &ray).unwrap();
            let bare = Light::point([a.cos(), 1.0, -3.0], [1.0; 3], 0.0).unwrap();
            let bare = RayLight::new(&bare, &medium, DVec3::ZERO, &ray);
            for (from, to) in [(0.0f32, 10.0f32), (1.0, 2.5), (2.5, 3.5)] {
                let error =
                    (f64::from(fast.interval(from, to).x) - exact.interval(from.into(), to.into()).x).abs();
                let Light::Spot(spot) = &light else { unreachable!() };
                let bound = 2e-5 + 8.0 * 2f64.powi(-24) * spot.cone_slope();
                worst = worst.max(error / bare.interval(from.into(), to.into()).x / bound);
            }
        }
        println!("LampIntegralF32: worst error with cones {worst:.2} of its bound");
        assert!(worst < 1.0, "{worst}");
    }
}
