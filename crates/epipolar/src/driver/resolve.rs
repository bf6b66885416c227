//! From shares to radiance: each pixel's unoccluded closed form times the share that its slices found lit.
//!
//! The share is a quotient of two sums with the same factors, so that an unoccluded pixel gets the closed form to the
//! last bit and a dark one gets 0, at any rank. The phase function of a sun is constant along a ray and comes in here,
//! exactly and at no cost for the sums.

use glam::{DVec3, Vec3};
use scatter_core::{
    Camera, DirectionalLight, Frame, LampIntegralF32, Level, Light, Medium, RayLanes, Window, exp_f32,
    walked_radiance,
};

use super::shares::Shares;

/// Pixels that are resolved side by side.
const LANES: usize = RayLanes::COUNT;

/// A number for each of them.
type Lanes = [f32; LANES];

/// What turns shares into an image.
pub struct Resolve<'a> {
    frame: &'a Frame<'a>,
    /// Shares of the pixels and their channels; `None` if nothing casts a shadow.
    shares: Option<(&'a Shares, usize)>,
    source: Source<'a>,
    level: Level,
    sigma_t: [f32; 3],
    grey: bool,
}

/// The unoccluded light.
enum Source<'a> {
    Sun(SunLight<'a>),
    Lamp(LampIntegralF32<'a>),
}

impl<'a> Resolve<'a> {
    /// For a frame whose slices have left their shares, one or three channels.
    pub fn new(frame: &'a Frame<'a>, shares: Option<(&'a Shares, usize)>, level: Level) -> Self {
        let (medium, eye) = (frame.medium(), frame.camera().eye());
        let source = match frame.light() {
            Light::Directional(sun) => Source::Sun(SunLight::new(frame, sun)),
            Light::Point(lamp) => Source::Lamp(LampIntegralF32::point(lamp, medium, eye)),
            Light::Spot(spot) => Source::Lamp(LampIntegralF32::spot(spot, medium, eye)),
        };
        let sigma_t = medium.sigma_t().map(|sigma| sigma as f32);
        Self { frame, shares, source, level, sigma_t, grey: medium.is_grey() }
    }

    /// Fills image row `y`; returns how many of its pixels no slice had answered.
    #[inline(always)]
    pub fn row(&self, y: u32, inscattered: &mut [[f32; 3]], transmittance: &mut [[f32; 3]]) -> u64 {
        let width = inscattered.len();
        let first_pixel = y as usize * width;
        let depth = &self.frame.depth().texels()[first_pixel..first_pixel + width];
        let limit = self.frame.max_distance() as f32;
        let mut walked = 0;
        for x in (0..width).step_by(LANES) {
            let lanes = LANES.min(width - x);
            let mut ends = [0.0f32; LANES];
            for lane in 0..lanes {
                ends[lane] = depth[x + lane].min(limit);
            }
            let through = self.transmittances(&ends);
            let mut radiance = self.unoccluded(x as u32, y, &ends, &through);
            let mut left_out = 0u32;
            if let Some((slots, channels)) = self.shares {
                let mut shares = [1.0f32; LANES];
                for (channel, values) in radiance.iter_mut().enumerate() {
                    if channel < channels {
                        slots.read(first_pixel + x, channel, &mut shares[..lanes]);
                        for (lane, &share) in shares.iter().enumerate() {
                            left_out |= u32::from(share < 0.0) << lane;
                        }
                    }
                    for lane in 0..LANES {
                        values[lane] *= shares[lane];
                    }
                }
            }
            for lane in 0..lanes {
                inscattered[x + lane] = std::array::from_fn(|channel| radiance[channel][lane]);
            }
            while left_out != 0 {
                let lane = left_out.trailing_zeros();
                left_out &= left_out - 1;
                let exact = walked_radiance(self.frame, x as u32 + lane, y);
                inscattered[x + lane as usize] = exact.as_vec3().to_array();
                walked += 1;
            }
            for lane in 0..lanes {
                transmittance[x + lane] = std::array::from_fn(|channel| through[channel][lane]);
            }
        }
        walked
    }

    /// Transmittances of sixteen pixels whose rays end at `ends`.
    #[inline(always)]
    fn transmittances(&self, ends: &Lanes) -> [Lanes; 3] {
        let mut through = [[1.0f32; LANES]; 3];
        for (channel, &sigma) in self.sigma_t.iter().enumerate() {
            if channel > 0 && self.grey {
                through[channel] = through[0];
                continue;
            }
            for lane in 0..LANES {
                through[channel][lane] = transmittance_of(sigma, ends[lane]);
            }
        }
        through
    }

    /// Radiance of sixteen pixels without any shadow.
    #[inline(always)]
    fn unoccluded(&self, x: u32, y: u32, ends: &Lanes, through: &[Lanes; 3]) -> [Lanes; 3] {
        match &self.source {
            Source::Sun(sun) => sun.radiance(x, y, ends, through),
            Source::Lamp(lamp) => {
                let rays = RayLanes::of_pixels(self.frame.camera(), x, y);
                lamp.intervals(self.level, &rays, &[0.0; LANES], ends)
            }
        }
    }
}

/// `e^{−σd}`; 1 where σ = 0 at any distance.
#[inline(always)]
fn transmittance_of(sigma: f32, end: f32) -> f32 {
    let through = exp_f32(-sigma * end);
    if sigma == 0.0 { 1.0 } else { through }
}

/// The unoccluded in-scattering of a sun along the view rays of one image.
pub struct SunLight<'a> {
    medium: &'a Medium,
    sigma_t: [f32; 3],
    grey: bool,
    irradiance: DVec3,
    /// Against the light's travel.
    to_light: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    window: [f64; 4],
    size: [f64; 2],
    /// `E·Σ σs·p` if no phase function depends on the angle.
    constant: Option<Vec3>,
}

impl<'a> SunLight<'a> {
    /// Of a frame with a perspective camera.
    pub fn new(frame: &Frame<'a>, sun: &DirectionalLight) -> Self {
        let (camera, medium): (&Camera, _) = (frame.camera(), frame.medium());
        let Window { left, right, bottom, top } = camera.window();
        let isotropic = medium.components().iter().all(|component| component.phase.is_isotropic());
        let irradiance = DVec3::from(sun.irradiance());
        Self {
            medium,
            sigma_t: medium.sigma_t().map(|sigma| sigma as f32),
            grey: medium.is_grey(),
            irradiance,
            to_light: (-sun.direction()).as_vec3(),
            forward: camera.forward().as_vec3(),
            right: camera.right().as_vec3(),
            up: camera.up().as_vec3(),
            window: [left, right, bottom, top],
            size: frame.size().map(f64::from),
            constant: isotropic.then(|| (irradiance * medium.scattering_towards(0.0)).as_vec3()),
        }
    }

    /// Radiance of sixteen pixels from `(x, y)` on whose rays end at `ends`, with those transmittances.
    #[inline(always)]
    fn radiance(&self, x: u32, y: u32, ends: &Lanes, through: &[Lanes; 3]) -> [Lanes; 3] {
        let mut radiance = self.source(x, y);
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

    /// `E·Σ σs·p` of sixteen pixels.
    #[inline(always)]
    fn source(&self, x: u32, y: u32) -> [Lanes; 3] {
        if let Some(constant) = self.constant {
            return constant.to_array().map(|value| [value; LANES]);
        }
        let [left, right, bottom, top] = self.window;
        let v = (top + (bottom - top) * ((f64::from(y) + 0.5) / self.size[1])) as f32;
        let (first, step) =
            (left + (right - left) * ((f64::from(x) + 0.5) / self.size[0]), (right - left) / self.size[0]);
        let line = self.forward + self.up * v;
        let (mut towards, mut away) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let u = first as f32 + step as f32 * lane as f32;
            let ray = [line.x + self.right.x * u, line.y + self.right.y * u, line.z + self.right.z * u];
            let shrink = 1.0 / (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt();
            let light = self.to_light.to_array();
            let (mut difference, mut sum) = (0.0f32, 0.0f32);
            for axis in 0..3 {
                let (d, s) = (ray[axis] * shrink - light[axis], ray[axis] * shrink + light[axis]);
                difference += d * d;
                sum += s * s;
            }
            // |v − l|²/4 = sin²(θ/2): light travels against `to_light`, and the camera lies against the ray.
            (towards[lane], away[lane]) = (0.25 * difference, 0.25 * sum);
        }
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
    }
}
