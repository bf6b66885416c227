//! What height fog does to a lamp's light at a sample of each ray of a packet: `ρ·exp(−σ(F + G))`, F and G the columns of
//! fog along the view ray and from the lamp, both in closed form (MODEL.md), in f32.
//!
//! `ln ρ` is counted from the foot of the perpendicular, near which the light is, so that an eye many scale heights away
//! costs no digits. Four exponentials and three divisions a sample.

use fearless_simd::prelude::*;
use scatter_core::{FogRay, LampRay};

use super::lanes::{LANES, Lanes, exp, load, splat};
use super::lookups::LampSamples;

/// Largest `ln ρ` that is told from larger ones: such fog is opaque, and its density times f32's other numbers finite.
const DENSEST: f64 = 60.0;
/// Largest column: what is behind it is dark.
const DEEPEST: f32 = 1e30;

/// Fog along the rays of a packet, and at the lamp.
#[derive(Debug, Clone, Copy)]
pub struct FogLampLanes {
    /// `ln ρ` at the foot of the perpendicular from the lamp.
    at_foot: [f32; LANES],
    /// How much it falls over the lamp's distance from the ray.
    fall: [f32; LANES],
    /// |m| \[1/length\].
    steepness: [f32; LANES],
    /// 1 where the ray climbs, else 0.
    climbs: [f32; LANES],
    /// ρ where the ray starts.
    start: [f32; LANES],
    closest: [f32; LANES],
    distance: [f32; LANES],
    /// `ln ρ` at the lamp, and ρ.
    lamp: [f32; 2],
    sigma_t: [f32; 3],
}

impl FogLampLanes {
    /// Of a lamp at which `ln ρ` is `at_lamp`; [`Self::set`] adds the rays.
    pub fn new(at_lamp: f64, sigma_t: [f64; 3]) -> Self {
        let zero = [0.0; LANES];
        let at_lamp = at_lamp.clamp(-1e30, DENSEST);
        Self {
            at_foot: zero,
            fall: zero,
            steepness: zero,
            climbs: zero,
            start: zero,
            closest: zero,
            distance: zero,
            lamp: [at_lamp as f32, at_lamp.exp() as f32],
            sigma_t: sigma_t.map(|sigma| sigma as f32),
        }
    }

    /// The fog along one ray.
    pub fn set(&mut self, lane: usize, fog: &FogRay, ray: &LampRay) {
        let within = |value: f64| value.clamp(-1e30, 1e30) as f32;
        self.at_foot[lane] = within(fog.log_density_at(ray.closest));
        self.fall[lane] = within(fog.slope() * ray.distance);
        self.steepness[lane] = within(fog.slope().abs());
        self.climbs[lane] = f32::from(u8::from(fog.slope() > 0.0));
        self.start[lane] = fog.log_density().min(DENSEST).exp() as f32;
        self.closest[lane] = within(ray.closest);
        self.distance[lane] = within(ray.distance);
    }

    /// `ρ·exp(−σ(F + G))` at a sample, per channel.
    #[inline(always)]
    pub fn weights<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        sample: LampSamples<S>,
    ) -> [Lanes<S>; CHANNELS] {
        let zero = splat(simd, 0.0);
        // t − t₀ = h·tan φ, d = h/cos φ.
        let inverse = splat(simd, 1.0) / sample.cos;
        let tan = sample.sin * inverse;
        let h = load(simd, &self.distance);
        let farthest = splat(simd, 1e30);
        let t = tan.mul_add(h, load(simd, &self.closest)).max(zero).min(farthest);
        let d = (h * inverse).min(farthest);
        let log_density = (load(simd, &self.at_foot) - tan * load(simd, &self.fall))
            .max(splat(simd, -1e30))
            .min(splat(simd, DENSEST as f32));
        // As good for positive exponents, as long as powers of two stay in f32.
        let density = exp(simd, log_density);

        let steepness = load(simd, &self.steepness);
        let climbs = load(simd, &self.climbs).simd_gt(splat(simd, 0.5));
        let dense = climbs.select(load(simd, &self.start), density);
        let view = dense * stretch(simd, steepness, t);

        let lamp = splat(simd, self.lamp[0]);
        let lower = log_density.simd_gt(lamp).select(density, splat(simd, self.lamp[1]));
        let difference = (log_density - lamp).abs().min(splat(simd, 1e30));
        let way = lower * (d * stretch(simd, difference, splat(simd, 1.0)));

        let column = (view + way).min(splat(simd, DEEPEST));
        std::array::from_fn(|channel| density * exp(simd, column * -self.sigma_t[channel]))
    }
}

/// `(1 − e^{−mx})/m` = `x·φ(mx)`, m, x ≥ 0.
#[inline(always)]
fn stretch<S: Simd>(simd: S, m: Lanes<S>, x: Lanes<S>) -> Lanes<S> {
    let y = m * x;
    // φ below ½ by its series: the first term left out is y⁸/9! < 1.1e-8.
    let mut series = splat(simd, -1.0 / 40320.0);
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series.mul_add(y, splat(simd, coefficient));
    }
    let long = (splat(simd, 1.0) - exp(simd, -y)) / m;
    y.simd_lt(splat(simd, 0.5)).select(x * series, long)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use scatter_core::{HeightFalloff, Level, ViewRay, at_level};

    /// A sample at the ray parameter `t`, and what the closed forms in f64 say there.
    fn weight(
        eye_height: f64,
        lamp: DVec3,
        direction: DVec3,
        sigma: f64,
        t: f64,
        level: Level,
    ) -> (f64, f64, f64) {
        let falloff = HeightFalloff::new([0.0, 1.0, 0.0], -eye_height, 1.0).unwrap();
        let ray = ViewRay { origin: DVec3::ZERO, direction };
        let fog = FogRay::new(&falloff, DVec3::ZERO, &ray);
        let lamp_ray = LampRay::new(DVec3::ZERO, direction, lamp, 0.0);
        let at_lamp = falloff.log_density(DVec3::ZERO, lamp);
        let mut lanes = FogLampLanes::new(at_lamp, [sigma; 3]);
        lanes.set(3, &fog, &lamp_ray);
        let angle = ((t - lamp_ray.closest) / lamp_ray.distance).atan();
        let (cos, sin) = (angle.cos() as f32, angle.sin() as f32);
        let found: [f32; LANES] = at_level!(level, simd => {
            let sample = LampSamples { cos: splat(simd, cos), sin: splat(simd, sin) };
            lanes.weights::<_, 1>(simd, sample)[0].into()
        });
        // The sample's own place, after rounding of sine and cosine.
        let tan = f64::from(sin) / f64::from(cos);
        let t = lamp_ray.closest + lamp_ray.distance * tan;
        let point = direction * t;
        let way = point - lamp;
        let d = lamp_ray.distance / f64::from(cos);
        let leg = FogRay::new(&falloff, DVec3::ZERO, &ViewRay { origin: lamp, direction: way.normalize() });
        let depth = fog.optical_depth(sigma, t) + leg.optical_depth(sigma, d);
        (found[3].into(), (fog.log_density_at(t) - depth).exp(), depth)
    }

    #[test]
    fn weights_are_the_closed_forms() {
        let mut worst = 0.0f64;
        for level in [Level::new(), Level::baseline()] {
            for eye_height in [0.0, 5.0, 40.0, -2.0] {
                for direction in [DVec3::X, DVec3::new(0.8, -0.6, 0.0), DVec3::new(0.28, 0.96, 0.0)] {
                    for below in [0.3, 4.0] {
                        let lamp = direction * 9.0 + DVec3::new(0.5, -below, 1.0);
                        for sigma in [1e-6, 0.05, 1.5] {
                            for t in [0.01, 3.0, 8.9, 9.1, 20.0] {
                                let (found, exact, depth) =
                                    weight(eye_height, lamp, direction, sigma, t, level);
                                if exact > 1e-30 {
                                    // Rounding of ln ρ (up to 60 here) and of the optical depth.
                                    let error = (found / exact - 1.0).abs() / (1.0 + depth);
                                    assert!(
                                        error < 3e-5,
                                        "{eye_height} {direction} {sigma} {t}: {found} {exact}"
                                    );
                                    worst = worst.max(error);
                                } else {
                                    assert!((0.0..1e-29).contains(&found), "{found} {exact}");
                                }
                            }
                        }
                    }
                }
            }
        }
        println!("a lamp's weight in height fog: worst relative error {worst:.1e} over 1 + τ");
    }

    #[test]
    fn nothing_is_nan_far_above_and_deep_below() {
        for eye_height in [-1e9, -700.0, 88.5, 1e4, 1e12] {
            for lamp in [DVec3::new(1.0, -eye_height, 2.0), DVec3::new(0.0, 3.0, 1e-9), DVec3::splat(1e8)] {
                for direction in [DVec3::X, DVec3::Y, DVec3::NEG_Y] {
                    for sigma in [0.0, 1e-12, 1e9] {
                        for t in [0.0, 1.0, 1e6] {
                            let (found, ..) = weight(eye_height, lamp, direction, sigma, t, Level::new());
                            assert!(found >= 0.0 && found.is_finite(), "{eye_height} {lamp} {sigma} {t}");
                        }
                    }
                }
            }
        }
    }
}
