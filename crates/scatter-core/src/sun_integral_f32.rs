//! Lit intervals under a directional light in f32, sixteen rays at a time: the twin of
//! [`LampIntegralF32`](crate::LampIntegralF32).
//!
//! `E·Σ σs·p · e^{−σa}·∫₀^{b−a} e^{−σt} dt` (MODEL.md): the phase function is constant along a ray, so it is taken once a
//! ray, from differences of unit vectors that keep their digits in a lobe. Loops over lanes without a branch or a libm
//! call; the compiler makes vectors of them.

use glam::{DVec3, Vec3};

use crate::camera::{Camera, Projection, Window};
use crate::fog_lanes::FogExtinction;
use crate::light::DirectionalLight;
use crate::medium::Medium;
use crate::ray_lanes::{LANES, RayLanes};
use crate::setup::Setup;
use crate::sun_interval::exp_f32;

/// A number for each ray.
type Lanes = [f32; LANES];

/// The in-scattering of a sun along the view rays of one camera.
///
/// Error, relative to the exact form ([`RayLight`](crate::RayLight)), measured over |g| ≤ 0.99 and σ·b from 1e-7 to 80
/// (test `intervals_keep_their_bound_against_the_exact_form`): ≤ 1e-5 where σ·a is small, of which the interval is 1e-6;
/// the rounding of σ·a adds `σ·a·2⁻²⁴`, that of `b − a` adds `2⁻²⁴·b/(b − a)`. In a lobe the difference of two rounded
/// unit vectors adds `3e-7·√g/(1−g)` of its value. No value is NaN or infinite.
///
/// In height fog the same closed form is taken over the optical depth of the thickest channel instead of the length; the
/// error is that of the depths ([`FogLanes`](crate::FogLanes)) on top.
#[derive(Debug, Clone)]
pub struct SunIntegralF32<'a> {
    medium: &'a Medium,
    camera: &'a Camera,
    fog: Option<FogExtinction>,
    sigma_t: [f32; 3],
    grey: bool,
    /// E; in height fog E over σt of the thickest channel.
    irradiance: DVec3,
    /// Against the light's travel.
    to_light: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    window: [f64; 4],
    shear: f64,
    size: [f64; 2],
    parallel_rays: bool,
    /// `E·Σ σs·p` if no phase function depends on the angle.
    constant: Option<Vec3>,
}

impl<'a> SunIntegralF32<'a> {
    /// Of a sun, for a camera's rays.
    pub fn new(sun: &DirectionalLight, medium: &'a Medium, camera: &'a Camera) -> Self {
        let Window { left, right, bottom, top } = camera.window();
        let isotropic = medium.components().iter().all(|component| component.phase.is_isotropic());
        let fog = FogExtinction::new(medium, camera.eye());
        let irradiance = DVec3::from(sun.irradiance());
        let irradiance = match &fog {
            None => irradiance,
            Some(fog) if fog.thickest > 0.0 => irradiance / fog.thickest,
            // Without extinction nothing scatters.
            Some(_) => DVec3::ZERO,
        };
        Self {
            medium,
            camera,
            fog,
            sigma_t: medium.sigma_t().map(|sigma| sigma as f32),
            grey: medium.is_grey(),
            irradiance,
            to_light: (-sun.direction()).as_vec3(),
            forward: camera.parallel_direction().unwrap_or(camera.forward()).as_vec3(),
            right: camera.right().as_vec3(),
            up: camera.up().as_vec3(),
            window: [left, right, bottom, top],
            shear: camera.shear(),
            size: camera.size().map(f64::from),
            parallel_rays: camera.projection() == Projection::Orthographic,
            constant: isotropic.then(|| (irradiance * medium.scattering_towards(0.0)).as_vec3()),
        }
    }

    /// In-scattered radiance of the lit intervals `[a, b]` of sixteen rays, 0 ≤ a ≤ b ≤ ∞, as `[channel][ray]`.
    /// Cost: two exponentials a ray and channel (grey media: a ray), and a phase function a component.
    #[inline(always)]
    pub fn intervals(&self, rays: &RayLanes, a: &Lanes, b: &Lanes) -> [Lanes; 3] {
        let mut radiance = self.source_of_rays(rays);
        if let Some(fog) = &self.fog {
            let before = fog.depths(rays, &[0.0; LANES], a);
            let between = fog.depths(rays, a, b);
            for (values, share) in radiance.iter_mut().zip(fog.shares) {
                for lane in 0..LANES {
                    values[lane] *=
                        lit_length_behind(share, between[lane], transmittance_of(share, before[lane]));
                }
            }
            return radiance;
        }
        let mut lengths = [0.0f32; LANES];
        for (channel, values) in radiance.iter_mut().enumerate() {
            if channel == 0 || !self.grey {
                let sigma = self.sigma_t[channel];
                for lane in 0..LANES {
                    lengths[lane] = lit_length_between(sigma, a[lane], b[lane]);
                }
            }
            for lane in 0..LANES {
                values[lane] *= lengths[lane];
            }
        }
        radiance
    }

    /// Radiance of sixteen pixels from `(x, y)` on whose whole rays are lit, to where they end, with the transmittances
    /// that the rays have there (`[channel][ray]`, [`transmittances_f32`]): cheaper than [`Self::intervals`], for the
    /// exponential is at hand.
    #[inline(always)]
    pub fn whole_rays(&self, x: u32, y: u32, ends: &Lanes, through: &[Lanes; 3]) -> [Lanes; 3] {
        let mut radiance = self.source_of_pixels(x, y);
        if let Some(fog) = &self.fog {
            let depths = fog.depths(&RayLanes::of_pixels(self.camera, x, y), &[0.0; LANES], ends);
            for ((values, share), through) in radiance.iter_mut().zip(fog.shares).zip(through) {
                for lane in 0..LANES {
                    values[lane] *= lit_length(share, depths[lane], through[lane]);
                }
            }
            return radiance;
        }
        let mut lengths = [0.0f32; LANES];
        for (channel, values) in radiance.iter_mut().enumerate() {
            if channel == 0 || !self.grey {
                for lane in 0..LANES {
                    lengths[lane] = lit_length(self.sigma_t[channel], ends[lane], through[channel][lane]);
                }
            }
            for lane in 0..LANES {
                values[lane] *= lengths[lane];
            }
        }
        radiance
    }

    /// `E·Σ σs·p` of sixteen pixels from `(x, y)` on, `[channel][ray]`: times a lit length `∫ₐᵇ e^{−σt} dt` it is the
    /// in-scattered radiance. (In height fog over the extinction of the thickest channel.)
    #[inline(always)]
    pub fn source_of_pixels(&self, x: u32, y: u32) -> [Lanes; 3] {
        if let Some(constant) = self.constant {
            return constant.to_array().map(|value| [value; LANES]);
        }
        let [left, right, bottom, top] = self.window;
        let down = (f64::from(y) + 0.5) / self.size[1];
        let v = (top + (bottom - top) * down) as f32;
        let first = left + (right - left) * ((f64::from(x) + 0.5) / self.size[0]) + self.shear * down;
        let step = (right - left) / self.size[0];
        let line = if self.parallel_rays { self.forward } else { self.forward + self.up * v };
        let across = if self.parallel_rays { Vec3::ZERO } else { self.right };
        let (mut towards, mut away) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let u = first as f32 + step as f32 * lane as f32;
            let ray = [line.x + across.x * u, line.y + across.y * u, line.z + across.z * u];
            let shrink = 1.0 / (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt();
            let way = ray.map(|axis| axis * shrink);
            (towards[lane], away[lane]) = haversines(way, self.to_light.to_array());
        }
        self.source(&towards, &away)
    }

    /// The same of any rays.
    #[inline(always)]
    fn source_of_rays(&self, rays: &RayLanes) -> [Lanes; 3] {
        if let Some(constant) = self.constant {
            return constant.to_array().map(|value| [value; LANES]);
        }
        let (mut towards, mut away) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let way = [0, 1, 2].map(|axis| rays.direction[axis][lane] as f32);
            (towards[lane], away[lane]) = haversines(way, self.to_light.to_array());
        }
        self.source(&towards, &away)
    }

    #[inline(always)]
    fn source(&self, towards: &Lanes, away: &Lanes) -> [Lanes; 3] {
        let mut source = [[0.0f32; LANES]; 3];
        for component in self.medium.components() {
            let strength = (self.irradiance * DVec3::from(component.sigma_s)).as_vec3().to_array();
            for lane in 0..LANES {
                let phase = component.phase.at_haversine_f32(towards[lane], away[lane]);
                for channel in 0..3 {
                    source[channel][lane] += strength[channel] * phase;
                }
            }
        }
        source
    }
}

/// `sin²(θ/2)` and `cos²(θ/2)` of the phase angle: |v − l|²/4, since light travels against `to_light` and the camera lies
/// against the ray.
#[inline(always)]
fn haversines(way: [f32; 3], to_light: [f32; 3]) -> (f32, f32) {
    let (mut difference, mut sum) = (0.0f32, 0.0f32);
    for axis in 0..3 {
        let (d, s) = (way[axis] - to_light[axis], way[axis] + to_light[axis]);
        difference += d * d;
        sum += s * s;
    }
    (0.25 * difference, 0.25 * sum)
}

/// Transmittances of sixteen pixels from `(x, y)` on whose rays end at `ends`, `[channel][ray]`, in any medium: those of
/// [`transmittances_f32`] in a uniform one. In height fog the error is `τ` times that of [`FogLanes`](crate::FogLanes).
#[inline(always)]
pub fn transmittances_of_pixels_f32(
    setup: &Setup<'_>,
    (x, y): (u32, u32),
    ends: &[f32; RayLanes::COUNT],
) -> [[f32; RayLanes::COUNT]; 3] {
    let (medium, camera) = (setup.medium(), setup.camera());
    let Some(fog) = FogExtinction::new(medium, camera.eye()) else {
        return transmittances_f32(medium, ends);
    };
    let depths = fog.depths(&RayLanes::of_pixels(camera, x, y), &[0.0; LANES], ends);
    fog.shares.map(|share| depths.map(|depth| transmittance_of(share, depth)))
}

/// Transmittances of sixteen rays that end at `ends`, in a uniform medium, `[channel][ray]`; relative error ≤ 2.5e-7 + σd·2⁻²⁴.
#[inline(always)]
pub fn transmittances_f32(medium: &Medium, ends: &[f32; RayLanes::COUNT]) -> [[f32; RayLanes::COUNT]; 3] {
    let sigma_t = medium.sigma_t().map(|sigma| sigma as f32);
    let mut through = [[1.0f32; LANES]; 3];
    for (channel, &sigma) in sigma_t.iter().enumerate() {
        if channel > 0 && medium.is_grey() {
            through[channel] = through[0];
            continue;
        }
        for lane in 0..LANES {
            through[channel][lane] = transmittance_of(sigma, ends[lane]);
        }
    }
    through
}

/// `e^{−σd}`; 1 where σ = 0 at any distance.
#[inline(always)]
fn transmittance_of(sigma: f32, end: f32) -> f32 {
    let through = exp_f32(-sigma * end);
    if sigma == 0.0 { 1.0 } else { through }
}

/// `∫ₐᵇ e^{−σt} dt`; 0 where b is not greater than a.
#[inline(always)]
fn lit_length_between(sigma: f32, a: f32, b: f32) -> f32 {
    let length = b - a;
    // Also where a and b are ∞ and their difference is NaN.
    let length = if length > 0.0 { length } else { 0.0 };
    lit_length_behind(sigma, length, transmittance_of(sigma, a))
}

/// `∫₀ˡ e^{−σt} dt`, of which `before` is left on the way to it.
#[inline(always)]
fn lit_length_behind(sigma: f32, length: f32, before: f32) -> f32 {
    before * lit_length(sigma, length, transmittance_of(sigma, length))
}

/// `∫₀ᵈ e^{−σt} dt`, of which `through` = `e^{−σd}` is known. Relative error ≤ 1e-6 (test). d may be ∞ where σ > 0.
#[inline(always)]
fn lit_length(sigma: f32, end: f32, through: f32) -> f32 {
    let x = sigma * end;
    // φ(x) = (1 − e^{−x})/x by its series below ½: the first term left out is x⁸/9! < 1.1e-8.
    let mut series = -1.0f32 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series * x + coefficient;
    }
    let long = (1.0 - through) / sigma;
    // σ = 0 and d = ∞ scatters nothing, and must not become NaN.
    let short = end.min(f32::MAX) * series;
    if x >= 0.5 {
        long
    } else if sigma == 0.0 {
        end.min(f32::MAX)
    } else {
        short
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ViewRay;
    use crate::light::Light;
    use crate::phase::Phase;
    use crate::ray_light::RayLight;

    #[test]
    fn lit_lengths_are_exact_to_a_millionth_from_vacuum_to_soot() {
        // Optical depths from 1e-30 to 1e4, a hundred a decade, and the same at lengths from a hair to a planet.
        let mut worst = (0.0, 0.0, 0.0);
        for step in -3000..400 {
            let depth = 10f64.powf(f64::from(step) / 100.0);
            for end in [1e-6f32, 0.37, 1.0, 913.0, 1.3e7] {
                let sigma = (depth / f64::from(end)) as f32;
                let exact = -(-f64::from(sigma) * f64::from(end)).exp_m1() / f64::from(sigma);
                let fast = f64::from(lit_length(sigma, end, transmittance_of(sigma, end)));
                let error = (fast - exact).abs() / exact;
                // Where σ itself is below what f32 holds with all its digits the length is the ray's.
                if sigma >= f32::MIN_POSITIVE && error > worst.0 {
                    worst = (error, f64::from(sigma), f64::from(end));
                }
            }
        }
        println!(
            "worst relative error {:.1e} at σ {:.2e}, d {:.2e} (allowed 1e-6)",
            worst.0, worst.1, worst.2
        );
        assert!(worst.0 <= 1e-6);
        // Rays that never end, and clear air.
        assert_eq!(lit_length(0.5, f32::INFINITY, transmittance_of(0.5, f32::INFINITY)), 2.0);
        assert_eq!(lit_length(0.0, 7.0, transmittance_of(0.0, 7.0)), 7.0);
        assert_eq!(lit_length(0.0, f32::INFINITY, transmittance_of(0.0, f32::INFINITY)), f32::MAX);
        assert_eq!(lit_length_between(0.5, f32::INFINITY, f32::INFINITY), 0.0);
        assert_eq!(lit_length_between(0.0, 3.0, 2.0), 0.0);
    }

    fn camera() -> Camera {
        Camera::perspective([1e3, 2.0, -3.0], [1.1e3, 40.0, 20.0], [0.0, 1.0, 0.0], 70.0, [48, 3]).unwrap()
    }

    /// Isotropic haze, Rayleigh's air, lobes to both sides, and a sum of all.
    fn media() -> Vec<Medium> {
        let one = |phase| Medium::homogeneous([0.3, 0.2, 0.1], [0.0, 0.0, 0.4], phase).unwrap();
        let mut media = vec![
            Medium::homogeneous([0.4; 3], [0.1; 3], Phase::Isotropic).unwrap(),
            Medium::homogeneous([0.0, 2e-3, 1e-7], [0.0; 3], Phase::Rayleigh).unwrap(),
        ];
        media.extend([0.99, -0.99, 0.5].map(|g| one(Phase::HenyeyGreenstein { g })));
        let parts = media.iter().flat_map(|medium| medium.components().to_vec());
        media.push(Medium::new(parts.collect(), [0.05; 3]).unwrap());
        media
    }

    /// The share of what the documentation allows; 1 is the bound.
    fn off(value: f32, exact: f64, (sigma, a, b): (f64, f32, f32), g: f64) -> f64 {
        let (a, b) = (f64::from(a), f64::from(b));
        let ulp = 0.5f64.powi(24);
        let shortened = if b.is_finite() { ulp * b / (b - a) } else { 0.0 };
        let lobe = 3e-7 * g.sqrt() / (1.0 - g);
        let allowed = 1e-5 + sigma * a * ulp + 2.0 * shortened + lobe;
        (f64::from(value) - exact).abs() / (exact * allowed + 1e-36)
    }

    #[test]
    fn intervals_keep_their_bound_against_the_exact_form() {
        let camera = camera();
        let mut worst = 0.0f64;
        for medium in &media() {
            let lobes = medium.components().iter().map(|part| match part.phase {
                Phase::HenyeyGreenstein { g } => g.abs(),
                _ => 0.0,
            });
            let g = lobes.fold(0.0, f64::max);
            for turn in 0..40 {
                // Straight into the rays, straight along them, and everywhere between.
                let ray = camera.pixel_ray(20, 1).direction;
                let angle = f64::from(turn) * 0.16;
                let side = ray.any_orthonormal_vector();
                let direction = match turn {
                    0 => -ray,
                    1 => ray,
                    2 => (-ray + 1e-3 * side).normalize(),
                    _ => angle.cos() * ray + angle.sin() * side,
                };
                let light = Light::directional(direction.to_array(), [5.0, 2.0, 1.0]).unwrap();
                let Light::Directional(sun) = &light else { unreachable!() };
                let fast = SunIntegralF32::new(sun, medium, &camera);
                let rays = RayLanes::of_pixels(&camera, 16, 1);
                let a: Lanes = std::array::from_fn(|lane| [0.0, 1e-3, 0.7, 40.0][lane % 4]);
                let b: Lanes =
                    std::array::from_fn(|lane| a[lane] + [1e-4, 0.9, 30.0, f32::INFINITY][lane / 4]);
                let values = fast.intervals(&rays, &a, &b);
                for lane in 0..LANES {
                    let ray: ViewRay = camera.pixel_ray(16 + lane as u32, 1);
                    let exact = RayLight::new(&light, medium, camera.eye(), &ray);
                    let exact = exact.interval(a[lane].into(), b[lane].into());
                    for channel in 0..3 {
                        let value = values[channel][lane];
                        let sigma = medium.sigma_t()[channel];
                        assert!(value.is_finite(), "{direction} {lane}");
                        worst = worst.max(off(value, exact[channel], (sigma, a[lane], b[lane]), g));
                    }
                }
            }
        }
        println!("worst share of the bound: {worst:.3}");
        assert!(worst <= 1.0, "{worst}");
    }

    #[test]
    fn whole_rays_are_the_intervals_that_start_at_the_eye() {
        let sizes = [48, 3];
        let (eye, target, up) = ([0.0, 2.0, -3.0], [1.0, 4.0, 20.0], [0.0, 1.0, 0.0]);
        let cameras = [
            camera(),
            Camera::orthographic(eye, target, up, 5.0, sizes).unwrap(),
            crate::engine_matrices::sheared_camera(sizes),
            crate::engine_matrices::oblique_camera(sizes),
        ];
        for camera in &cameras {
            for medium in &media() {
                let light = Light::directional([0.3, -0.2, -1.0], [5.0, 2.0, 1.0]).unwrap();
                let Light::Directional(sun) = &light else { unreachable!() };
                let fast = SunIntegralF32::new(sun, medium, camera);
                let ends: Lanes = std::array::from_fn(|lane| 0.1 * 2f32.powi(lane as i32));
                let through = transmittances_f32(medium, &ends);
                let whole = fast.whole_rays(16, 2, &ends, &through);
                let parts = fast.intervals(&RayLanes::of_pixels(camera, 16, 2), &[0.0; LANES], &ends);
                for (whole, part) in whole.as_flattened().iter().zip(parts.as_flattened()) {
                    // Directions in f32 and in f64: in a lobe of 0.99 three roundings of a hundredth.
                    assert!((whole - part).abs() <= 4e-5 * part.abs(), "{whole} {part}");
                }
            }
        }
    }
}
