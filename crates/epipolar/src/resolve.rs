//! From shares to radiance: each pixel's unoccluded closed form times the share that its slices found lit.
//!
//! The share is a quotient of two sums with the same factors, so that an unoccluded pixel gets the closed form to the
//! last bit and a dark one gets 0, at any rank. The phase function of a sun is constant along a ray and comes in here,
//! exactly and at no cost for the sums.

use glam::{DVec3, Vec3};
use scatter_core::{Camera, DirectionalLight, Frame, Medium, Window, exp_f32};

/// Pixels that are resolved side by side.
const LANES: usize = 16;

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
    max_distance: f32,
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
            max_distance: frame.max_distance().min(f64::from(f32::MAX)) as f32,
            constant: isotropic.then(|| (irradiance * medium.scattering_towards(0.0)).as_vec3()),
        }
    }

    /// Fills a part of image row `y`, from pixel 0 on, with unoccluded radiance times `shares`, and transmittance.
    #[inline(always)]
    pub fn row(
        &self,
        y: u32,
        depth: &[f32],
        shares: &[[f32; 3]],
        inscattered: &mut [[f32; 3]],
        transmittance: &mut [[f32; 3]],
    ) {
        let mut x = 0;
        let chunks = depth.chunks(LANES).zip(shares.chunks(LANES));
        let outputs = inscattered.chunks_mut(LANES).zip(transmittance.chunks_mut(LANES));
        for ((depth, shares), (inscattered, transmittance)) in chunks.zip(outputs) {
            let mut ends = [0.0f32; LANES];
            for (end, &depth) in ends.iter_mut().zip(depth) {
                *end = depth.min(self.max_distance);
            }
            let source = self.source(x, y);
            let (mut lengths, mut through) = ([[0.0f32; LANES]; 3], [[0.0f32; LANES]; 3]);
            for channel in 0..if self.grey { 1 } else { 3 } {
                let sigma = self.sigma_t[channel];
                for lane in 0..LANES {
                    (lengths[channel][lane], through[channel][lane]) = lit_length(sigma, ends[lane]);
                }
            }
            if self.grey {
                (lengths[1], lengths[2]) = (lengths[0], lengths[0]);
                (through[1], through[2]) = (through[0], through[0]);
            }
            for lane in 0..depth.len() {
                for channel in 0..3 {
                    inscattered[lane][channel] =
                        source[channel][lane] * lengths[channel][lane] * shares[lane][channel];
                    transmittance[lane][channel] = through[channel][lane];
                }
            }
            x += LANES as u32;
        }
    }

    /// `E·Σ σs·p` of sixteen pixels.
    #[inline(always)]
    fn source(&self, x: u32, y: u32) -> [[f32; LANES]; 3] {
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

/// `∫₀ᵈ e^{−σt} dt` and `e^{−σd}`. Relative error ≤ 1e-6 (test). d may be ∞ where σ > 0.
#[inline(always)]
fn lit_length(sigma: f32, end: f32) -> (f32, f32) {
    let x = sigma * end;
    let through = exp_f32(-x);
    // φ(x) = (1 − e^{−x})/x by its series below ½: the first term left out is x⁸/9! < 1.1e-8.
    let mut series = -1.0f32 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series * x + coefficient;
    }
    let long = (1.0 - through) / sigma;
    // σ = 0 and d = ∞ scatters nothing, and must not become NaN.
    let short = end.min(f32::MAX) * series;
    (if x < 0.5 { short } else { long }, if sigma == 0.0 { 1.0 } else { through })
}
