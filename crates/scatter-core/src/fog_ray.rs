//! Height fog along one view ray: optical depths and the lit intervals of a sun, in closed form. f64.

use glam::DVec3;

use crate::camera::ViewRay;
use crate::height_falloff::HeightFalloff;

/// The density along a ray, `ρ(t) = exp(log_density − slope·t)`, and its integrals.
///
/// With `φ(x) = (1 − e^{−x})/x`, φ(0) = 1 (MODEL.md, height fog):
///
/// ```text
/// ∫ₐᵇ ρ dt           = ρ(a)·(b−a)·φ(m(b−a)) = ρ(b)·(b−a)·φ(−m(b−a)),   m = slope
/// τ(b) − τ(a)        = σ·∫ₐᵇ ρ dt
/// ∫ₐᵇ ρ·e^{−τ(t)} dt = e^{−τ(a)}·(1 − e^{−(τ(b)−τ(a))})/σ
/// ```
///
/// Of the two forms of the first line the one at the denser end is taken, where φ's argument is not negative: the density
/// at the eye may underflow (88 scale heights up in f32, 708 in f64) and φ(m·t) overflow, but their product does neither.
/// Exponents are added before an exponential is taken, and τ is `∞` only where it is larger than any f64. A uniform medium
/// is `log_density = slope = 0`, to rounding.
///
/// Endless rays: `τ(∞) = σ·ρ(0)/m` for m > 0, else ∞.
///
/// Relative error of all three: a few ulp times `1 + |ln ρ|` at the denser end, and `τ(a)` times that for the last one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FogRay {
    log_density: f64,
    slope: f64,
}

impl FogRay {
    /// A uniform medium of density 1.
    pub const UNIFORM: Self = Self { log_density: 0.0, slope: 0.0 };

    /// Along a ray of a camera whose eye is at `eye` (world space); `ray.origin` is relative to it.
    pub fn new(falloff: &HeightFalloff, eye: DVec3, ray: &ViewRay) -> Self {
        Self { log_density: falloff.log_density(eye, ray.origin), slope: falloff.slope(ray.direction) }
    }

    /// Of `ln ρ` at t = 0 and `m = −d(ln ρ)/dt`, both finite.
    pub fn from_parts(log_density: f64, slope: f64) -> Self {
        Self { log_density, slope }
    }

    /// `ln ρ` at the ray's start.
    pub fn log_density(&self) -> f64 {
        self.log_density
    }

    /// `m = −d(ln ρ)/dt = up·v/scale_height` \[1/length\]: > 0 where the ray climbs out of the fog.
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// `ln ρ` at the ray parameter `t`, 0 ≤ t ≤ ∞; ±∞ at the end of an endless ray that is not horizontal.
    pub fn log_density_at(&self, t: f64) -> f64 {
        // 0·∞ is no climb at all.
        if self.slope == 0.0 { self.log_density } else { self.log_density - self.slope * t }
    }

    /// `τ(t) = σ·∫₀ᵗ ρ`, 0 to ∞.
    pub fn optical_depth(&self, sigma: f64, t: f64) -> f64 {
        self.optical_depth_between(sigma, 0.0, t)
    }

    /// `τ(b) − τ(a) = σ·∫ₐᵇ ρ` for 0 ≤ a ≤ b ≤ ∞ and σ ≥ 0: never a difference of two depths.
    pub fn optical_depth_between(&self, sigma: f64, a: f64, b: f64) -> f64 {
        if sigma == 0.0 {
            return 0.0;
        }
        let (log_density, length) = self.dense_end(a, b);
        // 0·∞ has no depth, ∞ is no length of a dense end that is finite.
        if length == 0.0 { 0.0 } else { scaled_exp(sigma, log_density, length) }
    }

    /// `e^{−τ(t)}`.
    pub fn transmittance(&self, sigma: f64, t: f64) -> f64 {
        (-self.optical_depth(sigma, t)).exp()
    }

    /// `∫ₐᵇ ρ·e^{−τ} dt` for 0 ≤ a ≤ b ≤ ∞ and σ ≥ 0: times `E·Σσs·p` it is the in-scattered radiance of a lit interval
    /// under a sun. Infinite only where σ = 0, for an endless ray or a density beyond f64.
    pub fn sun_interval(&self, sigma: f64, a: f64, b: f64) -> f64 {
        let (log_density, length) = self.dense_end(a, b);
        if length == 0.0 {
            return 0.0;
        }
        let depth = if sigma == 0.0 { 0.0 } else { scaled_exp(sigma, log_density, length) };
        // Below 1e-300 the quotient loses σ to underflow; there φ = 1 to the last bit.
        let integral =
            if depth < 1e-300 { scaled_exp(1.0, log_density, length) } else { -(-depth).exp_m1() / sigma };
        let before = self.transmittance(sigma, a);
        // Nothing comes through, of however much there is.
        if before == 0.0 { 0.0 } else { before * integral }
    }

    /// The ray parameter at which τ reaches `depth` > 0; ∞ where it never does. The inverse of [`Self::optical_depth`].
    pub fn reach(&self, sigma: f64, depth: f64) -> f64 {
        if sigma == 0.0 {
            return f64::INFINITY;
        }
        let m = self.slope;
        // depth·|m|/(σρ) as a logarithm: the density at the eye may underflow.
        let log_share = depth.ln() - sigma.ln() - self.log_density;
        let log_ratio = log_share + m.abs().ln();
        if log_ratio < -36.0 {
            // The density does not change on the way: 1 ± e⁻³⁶ is 1.
            return log_share.exp();
        }
        if m > 0.0 {
            // −ln(1 − ratio)/m
            let ratio = log_ratio.exp();
            if ratio < 1.0 { -(-ratio).ln_1p() / m } else { f64::INFINITY }
        } else if log_ratio > 36.0 {
            log_ratio / -m
        } else {
            log_ratio.exp().ln_1p() / -m
        }
    }

    /// `ln ρ` at the denser end of `[a, b]` and the length `(b−a)·φ(|m|·(b−a))` of fog of that density in it.
    fn dense_end(&self, a: f64, b: f64) -> (f64, f64) {
        let length = b - a;
        if !(length > 0.0) {
            // Also a = b = ∞, where the difference is NaN.
            return (0.0, 0.0);
        }
        let steepness = self.slope.abs();
        let x = steepness * length;
        // Below 1e-300 the quotient loses digits to underflow; there φ = 1 to the last bit.
        let dense = if x < 1e-300 || steepness == 0.0 { length } else { -(-x).exp_m1() / steepness };
        (self.log_density_at(if self.slope > 0.0 { a } else { b }), dense)
    }
}

/// `factor·eˣ·length`, where `eˣ` alone may leave the range of f64 and the product not. `factor` and `length` are > 0.
fn scaled_exp(factor: f64, x: f64, length: f64) -> f64 {
    if x.abs() < 600.0 {
        let value = factor * x.exp() * length;
        if value > 0.0 && value < f64::INFINITY {
            return value;
        }
    }
    (x + factor.ln() + length.ln()).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sun_interval::sun_interval;

    fn near(value: f64, exact: f64, tolerance: f64) {
        assert!((value - exact).abs() <= tolerance * exact.abs(), "{value:e} for {exact:e}");
    }

    #[test]
    fn without_a_slope_the_fog_is_the_uniform_medium() {
        for sigma in [0.0, 1e-9, 0.3, 20.0, 1e4] {
            for (a, b) in [(0.0, 1e-6), (0.7, 1.9), (3.0, 31.0), (2.0, f64::INFINITY), (5.0, 5.0)] {
                // Slopes so small that nothing changes over the interval, and none at all.
                for slope in [0.0, 1e-22, -1e-22, 1e-310] {
                    if b == f64::INFINITY && (slope != 0.0 || sigma == 0.0) {
                        continue;
                    }
                    let fog = FogRay::from_parts(0.0, slope);
                    // τ(a) has three roundings more than σ·a.
                    let tolerance = (4.0 + 2.0 * sigma * a) * f64::EPSILON;
                    near(fog.sun_interval(sigma, a, b), sun_interval(sigma, a, b), tolerance);
                    near(fog.transmittance(sigma, a), (-sigma * a).exp(), tolerance);
                }
            }
        }
    }

    #[test]
    fn depths_add_up_and_do_not_depend_on_the_way_of_travel() {
        for slope in [0.0, 1e-12, -1e-3, 0.4, -2.5, 40.0, -700.0] {
            let fog = FogRay::from_parts(-3.0, slope);
            let (a, m, b) = (0.2, 0.31, 0.9);
            let sigma = 0.7;
            let parts = fog.optical_depth_between(sigma, a, m) + fog.optical_depth_between(sigma, m, b);
            near(parts, fog.optical_depth_between(sigma, a, b), 1e-12);
            // The same stretch from its other end.
            let back = FogRay::from_parts(fog.log_density_at(1.0), -slope);
            near(
                back.optical_depth_between(sigma, 1.0 - b, 1.0 - a),
                fog.optical_depth_between(sigma, a, b),
                1e-12,
            );
            let lit = fog.sun_interval(sigma, a, m) + fog.sun_interval(sigma, m, b);
            near(lit, fog.sun_interval(sigma, a, b), 1e-12);
        }
    }

    #[test]
    fn a_thousand_scale_heights_above_the_fog_its_ground_is_still_seen() {
        // Straight down from 1000 scale heights up onto ground of density 1: ρ(eye) = e⁻¹⁰⁰⁰ is 0 in f64.
        let fog = FogRay::from_parts(-1000.0, -1.0);
        near(fog.optical_depth(0.5, 1000.0), 0.5, 1e-12);
        near(fog.sun_interval(0.5, 0.0, 1000.0), -(-0.5f64).exp_m1() / 0.5, 1e-12);
        // And on, into fog that no light leaves.
        assert_eq!(fog.optical_depth(0.5, 3000.0), f64::INFINITY);
        near(fog.sun_interval(0.5, 0.0, 3000.0), 2.0, 1e-12);
        assert_eq!(fog.sun_interval(0.5, 2000.0, 3000.0), 0.0);
    }

    #[test]
    fn endless_rays_have_their_limits() {
        let up = FogRay::from_parts(0.5, 2.0);
        near(up.optical_depth(0.3, f64::INFINITY), 0.15 * 0.5f64.exp(), 1e-15);
        near(up.sun_interval(0.3, 0.0, f64::INFINITY), -(-0.15 * 0.5f64.exp()).exp_m1() / 0.3, 1e-15);
        for slope in [0.0, -1e-9, -2.0] {
            let fog = FogRay::from_parts(-900.0, slope);
            assert_eq!(fog.optical_depth(0.3, f64::INFINITY), f64::INFINITY);
            near(fog.sun_interval(0.3, 0.0, f64::INFINITY), 1.0 / 0.3, 1e-15);
            assert_eq!(fog.optical_depth(0.0, f64::INFINITY), 0.0);
            assert_eq!(fog.sun_interval(0.3, f64::INFINITY, f64::INFINITY), 0.0);
        }
    }

    #[test]
    fn nothing_is_nan_and_radiance_never_exceeds_what_the_fog_can_scatter() {
        let numbers = [0.0, 1e-320, 1e-30, 1e-3, 1.0, 88.0, 800.0, 1e6, 1e300, f64::MAX];
        for sigma in [0.0, 1e-308, 1e-9, 1.0, 1e4, 1e300] {
            for density in numbers.into_iter().flat_map(|x| [x, -x]) {
                for slope in numbers.into_iter().flat_map(|x| [x, -x]) {
                    let fog = FogRay::from_parts(density, slope);
                    for a in [0.0, 1e-6, 1.0, 1e6, f64::INFINITY] {
                        for length in [0.0, 1e-9, 1.0, 1e6, f64::INFINITY] {
                            let depth = fog.optical_depth_between(sigma, a, a + length);
                            assert!(depth >= 0.0, "{sigma} {fog:?} {a} {length}: {depth}");
                            let lit = fog.sun_interval(sigma, a, a + length);
                            assert!(lit >= 0.0, "{sigma} {fog:?} {a} {length}: {lit}");
                            assert!(sigma == 0.0 || lit * sigma <= 1.0 + 1e-12, "{sigma} {fog:?}: {lit}");
                        }
                    }
                    assert!(fog.reach(sigma, 17.0) >= 0.0, "{sigma} {fog:?}");
                }
            }
        }
    }

    #[test]
    fn the_reach_of_a_depth_is_its_inverse() {
        for density in [-900.0, -80.0, -1.0, 0.0, 5.0] {
            for slope in [0.0, 1e-20, 1e-3, -1e-3, 0.5, -0.5, -30.0] {
                if density < -700.0 && slope == 0.0 {
                    // Farther than any f64.
                    continue;
                }
                let fog = FogRay::from_parts(density, slope);
                let reach = fog.reach(0.2, 17.0);
                if reach == f64::INFINITY {
                    assert!(fog.optical_depth(0.2, f64::INFINITY) <= 17.0 * (1.0 + 1e-12), "{fog:?}");
                } else {
                    // Far rays have ln ρ to 900 ulp, and τ falls with m·t.
                    near(fog.optical_depth(0.2, reach), 17.0, 1e-11);
                }
            }
        }
    }
}
