//! Lit intervals to radiance: what a tile's pixels add up, and in which of four ways.
//!
//! Under a sun in a uniform medium a pixel adds up lit lengths, `∫ e^{−σt} dt`, one a channel where the extinction is
//! coloured; everything else is constant along a ray and waits for the end. Near a lamp and in height fog it adds up radiance.
//!
//! The paper adds `±L(0, x)` for every crossing, in whatever order (Billeter et al. 2010, Eq. 3). Sorted crossings give lit
//! intervals, each of which is integrated for itself, so that nothing large cancels: the default. The sums of signed terms are
//! here to be measured: in f32 and f64, and as shares `F(x) = L(0, x)/L(0, D)` in units of 2⁻³⁰, which integers add up in any
//! order without a rounding of their own (and may overflow on the way, since the sum lies in [0, 1]).

use fearless_simd::Simd;
use glam::DVec3;
use scatter_core::{
    Frame, Light, LightIntegralF32, Projection, RayLanes, RayLight, ViewRay, exp_f32, sun_interval,
};

use crate::options::Accumulate;

/// Pixels that are worked on side by side.
pub const LANES: usize = 16;

/// A share of 1 as an integer.
const WHOLE_SHARE: f32 = (1u32 << 30) as f32;

/// A lit interval of a pixel of a tile.
#[derive(Debug, Clone, Copy, Default)]
pub struct Run {
    /// The pixel's number in its tile.
    pub pixel: u32,
    /// The camera's depth where it starts and where it ends.
    pub ends: [f64; 2],
}

/// The integral of the frame's light.
#[expect(
    clippy::large_enum_variant,
    reason = "one a frame, on the stack: a box would be an allocation a frame"
)]
enum Kind<'a> {
    /// Lit lengths under a sun in a uniform medium; RGB extinction.
    Lengths {
        /// σt by channel.
        sigma_t: [f32; 3],
        /// Channels that differ: 1 or 3.
        channels: usize,
    },
    /// Radiance of any light.
    Radiance(LightIntegralF32<'a>),
}

/// What is added up, and how.
pub struct Integrand<'a> {
    kind: Kind<'a>,
    accumulate: Accumulate,
}

/// Where a tile is in the image, and its pixels' sums.
#[derive(Debug, Clone, Default)]
pub struct TileSums {
    /// The first pixel.
    pub origin: [u32; 2],
    /// Pixels a row.
    pub width: u32,
    /// Channel by channel, a number a pixel.
    pub channels: [Vec<f32>; 3],
    /// How long a unit of the camera's depth is on each pixel's ray.
    pub stretch: Vec<f32>,
    /// The camera's depth where each pixel's ray ends.
    pub ends: Vec<f32>,
    /// Where the light of lamps and of fog is added up: each pixel's ray, starts and then ways, and where the lamp is on it.
    rays: [Vec<f64>; 6],
    lamp: [Vec<f64>; 2],
    /// Sums of shares, and of radiances in f64, where they are asked for.
    shares: [Vec<i32>; 3],
    signed: [Vec<f64>; 3],
}

impl TileSums {
    /// Zeroes for a tile of that many pixels.
    pub fn clear(&mut self, origin: [u32; 2], width: u32, pixels: usize, accumulate: Accumulate) {
        (self.origin, self.width) = (origin, width);
        for values in self.channels.iter_mut().chain([&mut self.stretch, &mut self.ends]) {
            values.clear();
            values.resize(pixels, 0.0);
        }
        for (shares, signed) in self.shares.iter_mut().zip(&mut self.signed) {
            shares.clear();
            shares.resize(if accumulate == Accumulate::Shares { pixels } else { 0 }, 0);
            signed.clear();
            signed.resize(if accumulate == Accumulate::Signed { pixels } else { 0 }, 0.0);
        }
    }

    /// Sixteen rays.
    #[inline(always)]
    fn rays_of(&self, pixels: &[u32; LANES]) -> RayLanes {
        let mut rays = RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3] };
        for axis in 0..3 {
            for (lane, &pixel) in pixels.iter().enumerate() {
                rays.origin[axis][lane] = self.rays[axis][pixel as usize];
                rays.direction[axis][lane] = self.rays[3 + axis][pixel as usize];
            }
        }
        rays
    }

    /// Column and row in the image of a pixel of the tile.
    pub fn place(&self, pixel: u32) -> [u32; 2] {
        [self.origin[0] + pixel % self.width, self.origin[1] + pixel / self.width]
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let reals: usize = self.channels.iter().chain([&self.stretch, &self.ends]).map(Vec::capacity).sum();
        let shares: usize = self.shares.iter().map(Vec::capacity).sum();
        let signed: usize = self.signed.iter().map(Vec::capacity).sum();
        let rays: usize = self.rays.iter().chain(&self.lamp).map(Vec::capacity).sum();
        (4 * (reals + shares) + 8 * (signed + rays)) as u64
    }
}

impl<'a> Integrand<'a> {
    /// Of a frame, which has no texture.
    pub fn of(frame: &Frame<'a>, accumulate: Accumulate) -> Self {
        let medium = frame.medium();
        let is_sun = matches!(frame.light(), Light::Directional(_));
        let kind = if is_sun && medium.height_falloff().is_none() {
            let channels = if medium.is_grey() { 1 } else { 3 };
            Kind::Lengths { sigma_t: medium.sigma_t().map(|sigma| sigma as f32), channels }
        } else {
            Kind::Radiance(LightIntegralF32::new(frame.setup()))
        };
        Self { kind, accumulate }
    }

    /// Writes down the rays of a tile's pixels, if they are asked for one by one.
    #[inline(always)]
    pub fn set_up(&self, frame: &Frame<'_>, sums: &mut TileSums) {
        if matches!(self.kind, Kind::Lengths { .. }) {
            return;
        }
        let camera = frame.camera();
        let lamp = frame.light().position().map(|lamp| lamp - camera.eye());
        sums.rays.iter_mut().chain(&mut sums.lamp).for_each(Vec::clear);
        let pixels = sums.stretch.len() as u32;
        for first in (0..pixels).step_by(LANES) {
            let [x, y] = sums.place(first);
            let rays = RayLanes::of_pixels(camera, x, y);
            for axis in 0..3 {
                sums.rays[axis].extend_from_slice(&rays.origin[axis]);
                sums.rays[3 + axis].extend_from_slice(&rays.direction[axis]);
            }
            let Some(lamp) = lamp else { continue };
            let (mut closest, mut distance) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let way = DVec3::from(rays.direction.map(|axis| axis[lane]));
                let to_lamp = lamp - DVec3::from(rays.origin.map(|axis| axis[lane]));
                closest[lane] = to_lamp.dot(way);
                distance[lane] = to_lamp.cross(way).length();
            }
            sums.lamp[0].extend_from_slice(&closest);
            sums.lamp[1].extend_from_slice(&distance);
        }
    }

    /// How crossings become radiance.
    pub fn accumulate(&self) -> Accumulate {
        self.accumulate
    }

    /// Channels that differ.
    pub fn channels(&self) -> usize {
        match self.kind {
            Kind::Lengths { channels, .. } => channels,
            Kind::Radiance(_) => 3,
        }
    }

    /// Whether the sums are lengths: to be multiplied by what does not change along a ray.
    pub fn adds_lengths(&self) -> bool {
        matches!(self.kind, Kind::Lengths { .. })
    }

    /// Adds lit intervals.
    #[inline(always)]
    pub fn add<S: Simd>(&self, simd: S, frame: &Frame<'_>, runs: &[Run], sums: &mut TileSums) {
        for runs in runs.chunks(LANES) {
            match self.accumulate {
                Accumulate::Intervals => self.add_intervals(simd, frame, runs, sums),
                Accumulate::Shares => self.add_shares(simd, runs, sums),
                Accumulate::SignedSingle => self.add_signed_single(simd, runs, sums),
                Accumulate::Signed => {
                    for run in runs {
                        let [to, from] = [run.ends[1], run.ends[0]]
                            .map(|end| self.exactly(frame, run.pixel, [0.0, end], sums));
                        for channel in 0..3 {
                            sums.signed[channel][run.pixel as usize] += to[channel] - from[channel];
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn add_intervals<S: Simd>(&self, simd: S, frame: &Frame<'_>, runs: &[Run], sums: &mut TileSums) {
        let (mut pixels, mut starts, mut lengths) = ([0u32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        for (lane, run) in runs.iter().enumerate() {
            pixels[lane] = run.pixel;
            starts[lane] = run.ends[0] as f32;
            lengths[lane] = (run.ends[1] - run.ends[0]) as f32;
        }
        if matches!(self.kind, Kind::Radiance(_)) && frame.light().position().is_some() {
            for (lane, run) in runs.iter().enumerate() {
                let pixel = run.pixel as usize;
                let stretch = f64::from(sums.stretch[pixel]);
                let lamp = [sums.lamp[0][pixel], sums.lamp[1][pixel]];
                if run.ends.iter().any(|&depth| is_at_the_lamp(lamp, depth * stretch)) {
                    self.add_exactly(frame, run.pixel, run.ends, sums);
                    lengths[lane] = 0.0;
                }
            }
        }
        let added = self.integrals(simd, &pixels, &starts, &lengths, sums);
        for (channel, added) in added.iter().enumerate().take(self.channels()) {
            for lane in 0..runs.len() {
                sums.channels[channel][pixels[lane] as usize] += added[lane];
            }
        }
    }

    /// Of sixteen pixels, from the camera's depth `starts` on: lit lengths in units of its depth, or radiance.
    #[inline(always)]
    fn integrals<S: Simd>(
        &self,
        simd: S,
        pixels: &[u32; LANES],
        starts: &[f32; LANES],
        lengths: &[f32; LANES],
        sums: &TileSums,
    ) -> [[f32; LANES]; 3] {
        let mut stretch = [0.0; LANES];
        for lane in 0..LANES {
            stretch[lane] = sums.stretch[pixels[lane] as usize];
        }
        match &self.kind {
            Kind::Lengths { sigma_t, channels } => {
                let mut found = [[0.0; LANES]; 3];
                for (found, sigma) in found.iter_mut().zip(sigma_t).take(*channels) {
                    for lane in 0..LANES {
                        found[lane] = lit_length(stretch[lane] * sigma, starts[lane], lengths[lane]);
                    }
                }
                found
            }
            Kind::Radiance(light) => {
                let rays = sums.rays_of(pixels);
                let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
                for lane in 0..LANES {
                    a[lane] = starts[lane] * stretch[lane];
                    b[lane] = (starts[lane] + lengths[lane]) * stretch[lane];
                }
                light.intervals(simd.level(), &rays, &a, &b)
            }
        }
    }

    /// `L(0, x)` of the starts and of the ends of runs.
    #[inline(always)]
    fn ends_of<S: Simd>(
        &self,
        simd: S,
        runs: &[Run],
        sums: &TileSums,
    ) -> ([u32; LANES], [[[f32; LANES]; 3]; 2]) {
        let mut pixels = [0u32; LANES];
        let mut ends = [[0.0f32; LANES]; 2];
        for (lane, run) in runs.iter().enumerate() {
            pixels[lane] = run.pixel;
            for (ends, end) in ends.iter_mut().zip(run.ends) {
                ends[lane] = end as f32;
            }
        }
        (pixels, ends.map(|ends| self.integrals(simd, &pixels, &[0.0; LANES], &ends, sums)))
    }

    #[inline(always)]
    fn add_signed_single<S: Simd>(&self, simd: S, runs: &[Run], sums: &mut TileSums) {
        let (pixels, [from, to]) = self.ends_of(simd, runs, sums);
        for channel in 0..self.channels() {
            for lane in 0..runs.len() {
                let sum = &mut sums.channels[channel][pixels[lane] as usize];
                *sum -= from[channel][lane];
                *sum += to[channel][lane];
            }
        }
    }

    #[inline(always)]
    fn add_shares<S: Simd>(&self, simd: S, runs: &[Run], sums: &mut TileSums) {
        let (pixels, [from, to]) = self.ends_of(simd, runs, sums);
        let mut ends = [0.0; LANES];
        for lane in 0..LANES {
            ends[lane] = sums.ends[pixels[lane] as usize];
        }
        let whole = self.integrals(simd, &pixels, &[0.0; LANES], &ends, sums);
        for channel in 0..self.channels() {
            for lane in 0..runs.len() {
                let share = |part: f32| {
                    let share = part / whole[channel][lane];
                    // Of no light at all there is no share. At 1 the sum is exact, whatever was rounded before.
                    if share >= 0.0 { (share.min(1.0) * WHOLE_SHARE) as i32 } else { 0 }
                };
                let sum = &mut sums.shares[channel][pixels[lane] as usize];
                *sum = sum.wrapping_sub(share(from[channel][lane])).wrapping_add(share(to[channel][lane]));
            }
        }
    }

    /// Turns what was added up into the channels' sums.
    #[inline(always)]
    pub fn finish<S: Simd>(&self, simd: S, sums: &mut TileSums) {
        match self.accumulate {
            Accumulate::Intervals => {}
            Accumulate::SignedSingle => {
                // What rounding leaves of a dark pixel has either sign; there is no light below none.
                for value in sums.channels.iter_mut().flatten() {
                    *value = value.max(0.0);
                }
            }
            Accumulate::Signed => {
                for (values, signed) in sums.channels.iter_mut().zip(&sums.signed) {
                    for (value, sum) in values.iter_mut().zip(signed) {
                        *value += sum.max(0.0) as f32;
                    }
                }
            }
            Accumulate::Shares => {
                for first in (0..sums.stretch.len()).step_by(LANES) {
                    let pixels = std::array::from_fn(|lane| (first + lane) as u32);
                    let mut ends = [0.0; LANES];
                    ends.copy_from_slice(&sums.ends[first..first + LANES]);
                    let whole = self.integrals(simd, &pixels, &[0.0; LANES], &ends, sums);
                    for (channel, whole) in whole.iter().enumerate().take(self.channels()) {
                        for (lane, whole) in whole.iter().enumerate() {
                            let share = sums.shares[channel][first + lane].max(0) as f32 / WHOLE_SHARE;
                            sums.channels[channel][first + lane] += share * whole;
                        }
                    }
                }
            }
        }
    }

    /// Adds a lit part of one pixel's ray \[the camera's depth\] in f64.
    pub fn add_exactly(&self, frame: &Frame<'_>, pixel: u32, part: [f64; 2], sums: &mut TileSums) {
        let added = self.exactly(frame, pixel, part, sums);
        for (values, added) in sums.channels.iter_mut().zip(added).take(self.channels()) {
            values[pixel as usize] += added as f32;
        }
    }

    fn exactly(&self, frame: &Frame<'_>, pixel: u32, [from, to]: [f64; 2], sums: &TileSums) -> [f64; 3] {
        if !(from < to) {
            return [0.0; 3];
        }
        let ray = ray_of(frame, sums, pixel);
        let along = along_ray(frame, &ray);
        let [from, to] = [from * along, to * along];
        match &self.kind {
            Kind::Lengths { sigma_t, .. } => {
                sigma_t.map(|sigma| (sun_interval(sigma.into(), from, to) / along).min(1e30))
            }
            Kind::Radiance(_) => {
                let eye = frame.camera().eye();
                let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
                light.interval(from, to).to_array()
            }
        }
    }
}

/// The ray of a pixel of a tile.
#[inline(always)]
fn ray_of(frame: &Frame<'_>, sums: &TileSums, pixel: u32) -> ViewRay {
    let [x, y] = sums.place(pixel);
    frame.camera().pixel_ray(x, y)
}

/// How long a unit of a ray's parameter is, in f64: of the depth of a perspective camera.
pub fn along_ray(frame: &Frame<'_>, ray: &ViewRay) -> f64 {
    match frame.camera().projection() {
        Projection::Perspective => 1.0 / ray.direction.dot(frame.camera().forward()),
        Projection::Orthographic => 1.0,
    }
}

/// Whether an interval of a lamp that ends at `t` must be integrated in f64: rounding t to f32 shifts the end by 2⁻²⁴·t,
/// where the light is as 1/d² and all of the ray has about 1/h, so the share that is lost is 2⁻²⁴·t·h/d²; a millionth is
/// allowed. `lamp` is where the ray is closest to the lamp, and how close.
#[inline(always)]
fn is_at_the_lamp([closest, distance]: [f64; 2], t: f64) -> bool {
    const MOST: f64 = 16.0;
    t * distance > MOST * (distance * distance + (t - closest) * (t - closest))
}

/// `∫ e^{−σs} ds` over the `length` ≥ 0 behind `start` ≥ 0, relative error ≤ 1e-6 + σ·start·2⁻²⁴: `e^{−σ·start}·length·φ(x)`,
/// `φ(x) = (1 − e^{−x})/x`, x = σ·length.
#[inline(always)]
fn lit_length(sigma: f32, start: f32, length: f32) -> f32 {
    // An endless ray: e^{−x} is 0, and length/x is 1/σ. 0·∞ of clear air is nothing that is extinguished.
    let (start, length) = (start.min(1e30), length.min(1e30));
    let x = sigma * length;
    // The series below ½: the first term left out is x⁸/9! < 1.1e-8.
    let mut phi = -1.0 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        phi = phi * x + coefficient;
    }
    let long = (1.0 - exp_f32(-x)) / x;
    exp_f32(-sigma * start) * (length * if x >= 0.5 { long } else { phi })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lit_lengths_are_those_of_the_exact_form() {
        let mut worst = 0.0f64;
        for sigma in [0.0f32, 1e-7, 0.01, 0.4, 3.0, 100.0] {
            for start in [0.0f32, 1e-3, 2.0, 11.0] {
                for length in [1e-6f32, 0.01, 0.7, 1.2, 5.0, 300.0, f32::INFINITY] {
                    if sigma == 0.0 && length == f32::INFINITY {
                        continue;
                    }
                    let found = lit_length(sigma, start, length);
                    let (sigma, start) = (f64::from(sigma), f64::from(start));
                    let exact = sun_interval(sigma, 0.0, length.into()) * (-sigma * start).exp();
                    if exact > 1e-30 {
                        let error = (f64::from(found) / exact - 1.0).abs();
                        worst = worst.max(error / (1e-6 + sigma * start * 2f64.powi(-24)));
                    }
                }
            }
        }
        println!("worst share of the bound {worst:.2}");
        assert!(worst <= 1.0, "{worst}");
    }
}
