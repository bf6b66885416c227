//! Height fog along sixteen view rays in f32: the twin of [`FogRay`](crate::FogRay), without a branch or a libm call.
//!
//! What cancels stays in f64: the logarithm of the density at the denser end of a stretch, which may be the difference of
//! a height of many scale heights and a way of as many. What leaves here are optical depths, which cancel nothing.

use glam::DVec3;

use crate::height_falloff::HeightFalloff;
use crate::medium::Medium;
use crate::ray_lanes::{LANES, RayLanes};
use crate::sun_interval::exp_f32;

/// A number for each ray.
type Lanes = [f32; LANES];

/// Largest |slope|, and the scale beyond which all of a fog lies in one step of f32: products with it stay finite.
const STEEPEST: f64 = 1e30;

/// The density along sixteen rays: `ln ρ(t) = log_density − slope·t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FogLanes {
    /// `ln ρ` where each ray starts.
    pub log_density: [f64; LANES],
    /// `−d(ln ρ)/dt` of each ray \[1/length\].
    pub slope: [f64; LANES],
}

impl FogLanes {
    /// Along rays of a camera whose eye is at `eye` (world space).
    #[inline(always)]
    pub fn new(falloff: &HeightFalloff, eye: DVec3, rays: &RayLanes) -> Self {
        let up = falloff.up();
        // A finite reciprocal: scale heights below 1e-30 are as good as that.
        let inverse = (1.0 / falloff.scale_height()).min(f64::MAX);
        let at_eye = up.dot(eye) - falloff.base_height();
        let along = |way: &[[f64; LANES]; 3], lane: usize| {
            up.x * way[0][lane] + up.y * way[1][lane] + up.z * way[2][lane]
        };
        let mut lanes = Self { log_density: [0.0; LANES], slope: [0.0; LANES] };
        for lane in 0..LANES {
            let height = at_eye + along(&rays.origin, lane);
            lanes.log_density[lane] = (-height * inverse).clamp(-f64::MAX, f64::MAX);
            lanes.slope[lane] = (along(&rays.direction, lane) * inverse).clamp(-STEEPEST, STEEPEST);
        }
        lanes
    }

    /// `∫ₐᵇ ρ` of each ray times a coefficient σ whose logarithm is `log_sigma` (−∞ for 0), 0 ≤ a, b ≤ ∞; 0 where b is not
    /// greater than a. At most `f32::MAX`.
    ///
    /// Relative error ≤ 4e-6 for depths from 1e-30 to 1e30 (test; 2.4e-6 measured), the rounding of `a` and `b` adds: `|slope|·2⁻²⁴·b`.
    /// Cost: two exponentials and a division a ray.
    #[inline(always)]
    pub fn optical_depths(&self, log_sigma: f64, a: &Lanes, b: &Lanes) -> Lanes {
        let mut depths = [0.0f32; LANES];
        for lane in 0..LANES {
            let (slope, from, to) = (self.slope[lane], a[lane], b[lane].min(f32::MAX));
            let length = to - from;
            // Also where a and b are ∞.
            let length = if length > 0.0 { length } else { 0.0 };
            let dense_end = if slope > 0.0 { from.min(f32::MAX) } else { to };
            let log_depth = self.log_density[lane] - slope * f64::from(dense_end) + log_sigma;
            let steepness = slope.abs() as f32;
            let x = steepness * length;
            let long = (1.0 - exp_f32(-x)) / steepness;
            let dense = if x >= 0.5 { long } else { length * phi_series(x) };
            // Of two factors of which one may be very large and the other very small; the exponent that is left over
            // is multiplied in last.
            let exponent = log_depth.clamp(-160.0, 160.0);
            let first = exponent.clamp(-80.0, 80.0);
            let depth = exp_f32(first as f32) * dense * exp_f32((exponent - first) as f32);
            depths[lane] = depth.min(f32::MAX);
        }
        depths
    }
}

/// Extinction as lanes take it: that of the thickest channel as a logarithm, and the others as shares of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FogExtinction {
    pub(crate) falloff: HeightFalloff,
    pub(crate) eye: DVec3,
    /// σt of the thickest channel \[1/length\]; 0 without extinction.
    pub(crate) thickest: f64,
    /// Its logarithm; −∞ without extinction.
    pub(crate) log_thickest: f64,
    /// Of each channel, 0 to 1.
    pub(crate) shares: [f32; 3],
}

impl FogExtinction {
    /// Of a medium, seen from `eye`; `None` in a uniform one.
    pub(crate) fn new(medium: &Medium, eye: DVec3) -> Option<Self> {
        let falloff = *medium.height_falloff()?;
        let thickest = medium.sigma_t().into_iter().fold(0.0, f64::max);
        let share = |sigma: f64| if thickest > 0.0 { (sigma / thickest) as f32 } else { 0.0 };
        let shares = medium.sigma_t().map(share);
        Some(Self { falloff, eye, thickest, log_thickest: thickest.ln(), shares })
    }

    /// Optical depths of the thickest channel between two points of each ray.
    #[inline(always)]
    pub(crate) fn depths(&self, rays: &RayLanes, a: &Lanes, b: &Lanes) -> Lanes {
        FogLanes::new(&self.falloff, self.eye, rays).optical_depths(self.log_thickest, a, b)
    }
}

/// `φ(x) = (1 − e^{−x})/x` for 0 ≤ x < ½: the first term left out is x⁸/9! < 1.1e-8.
#[inline(always)]
fn phi_series(x: f32) -> f32 {
    let mut series = -1.0f32 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series * x + coefficient;
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fog_ray::FogRay;

    fn lanes(log_density: f64, slope: f64) -> FogLanes {
        FogLanes { log_density: [log_density; LANES], slope: [slope; LANES] }
    }

    #[test]
    fn depths_are_those_of_the_exact_form() {
        let mut worst = 0.0f64;
        for log_density in [-2000.0, -300.0, -88.5, -3.0, 0.0, 4.0] {
            for slope in [0.0, 1e-12, -1e-6, 0.01, -0.4, 2.0, -30.0, 1e5] {
                for sigma in [1e-9f64, 0.02, 30.0] {
                    let exact = FogRay::from_parts(log_density, slope);
                    let a: Lanes =
                        std::array::from_fn(|lane| if lane % 3 == 0 { 0.0 } else { 0.3 * lane as f32 });
                    let b: Lanes = std::array::from_fn(|lane| a[lane] + 0.001 * 3f32.powi(lane as i32));
                    let depths = lanes(log_density, slope).optical_depths(sigma.ln(), &a, &b);
                    for lane in 0..LANES {
                        let (from, to) = (f64::from(a[lane]), f64::from(b[lane]));
                        let expected = exact.optical_depth_between(sigma, from, to);
                        let found = f64::from(depths[lane]);
                        if (1e-30..1e30).contains(&expected) {
                            // b − a is rounded to f32.
                            let rounding = 2f64.powi(-24) * to / (to - from);
                            worst = worst.max((found / expected - 1.0).abs() - rounding);
                        } else {
                            assert!(found < 2e-30 || found > 5e29, "{found:e} for {expected:e}");
                        }
                    }
                }
            }
        }
        println!("FogLanes: worst relative error {worst:.2e}");
        // Two exponentials of 2.5e-7, one of an exponent up to 80 (80·2⁻²⁵ = 2.4e-6), four products.
        assert!(worst < 4e-6, "{worst}");
    }

    #[test]
    fn nothing_is_nan_and_endless_rays_have_their_limits() {
        let numbers = [0.0, 1e-300, 1e-30, 1e-3, 1.0, 88.0, 800.0, 1e6, 1e300, f64::MAX];
        let ends = [0.0, 1e-30, 1e-6, 1.0, 1e6, 1e30, f32::MAX, f32::INFINITY];
        for log_density in numbers.into_iter().flat_map(|x| [x, -x]) {
            for slope in numbers.into_iter().flat_map(|x| [x.min(STEEPEST), -x.min(STEEPEST)]) {
                for log_sigma in [f64::NEG_INFINITY, -700.0, -20.0, 0.0, 12.0] {
                    for from in ends {
                        let b: Lanes = std::array::from_fn(|lane| ends[lane % ends.len()]);
                        let depths = lanes(log_density, slope).optical_depths(log_sigma, &[from; LANES], &b);
                        assert!(depths.iter().all(|depth| *depth >= 0.0 && depth.is_finite()), "{depths:?}");
                    }
                }
            }
        }
        let whole = |slope| lanes(0.5, slope).optical_depths(0.0, &[0.0; LANES], &[f32::INFINITY; LANES])[3];
        assert!((f64::from(whole(2.0)) / (0.5 * 0.5f64.exp()) - 1.0).abs() < 1e-6);
        assert!(whole(0.0) > 1e30 && whole(-1e-9) > 1e30 && whole(-3.0) > 1e30);
    }
}
