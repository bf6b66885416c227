//! Lit runs to radiance: what a tile's pixels add up, and how.
//!
//! Under a sun in a uniform medium a pixel adds up lit lengths, `∫ e^{−σt} dt`, one a channel where the extinction is
//! coloured; everything else is constant along a ray and waits for the end. Near a lamp and in height fog it adds up
//! radiance, and behind glass each run is cut at the glass' texels first.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use scatter_core::{Frame, Light, LightIntegralF32, RayLanes, RayLight, ViewRay};

use super::lanes::{Reals, lit_length, real};
use super::queues::Runs;
use super::ray_fan::LANES;
use super::segment::{Segment, Word};

/// What is added up.
#[expect(
    clippy::large_enum_variant,
    reason = "one a frame, on the stack: a box would be an allocation a frame"
)]
pub enum Integrand<'a> {
    /// Lit lengths under a sun in a uniform medium; RGB extinction.
    Lengths {
        /// σt by channel.
        sigma_t: [f32; 3],
        /// Channels that differ: 1 or 3.
        channels: usize,
    },
    /// Radiance of any light, in f32.
    Radiance(LightIntegralF32<'a>),
    /// Radiance behind glass, in f64.
    Glass,
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
}

impl TileSums {
    /// Zeroes for a tile of that many pixels.
    pub fn clear(&mut self, origin: [u32; 2], width: u32, pixels: usize) {
        (self.origin, self.width) = (origin, width);
        for values in self.channels.iter_mut().chain([&mut self.stretch]) {
            values.clear();
            values.resize(pixels, 0.0);
        }
    }

    /// Column and row in the image of a pixel of the tile.
    pub fn place(&self, pixel: u32) -> [u32; 2] {
        [self.origin[0] + pixel % self.width, self.origin[1] + pixel / self.width]
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let numbers: usize = self.channels.iter().chain([&self.stretch]).map(Vec::capacity).sum();
        (numbers * size_of::<f32>()) as u64
    }
}

impl<'a> Integrand<'a> {
    /// For a frame.
    pub fn of(frame: &Frame<'a>) -> Self {
        let medium = frame.medium();
        if frame.texture().is_some() {
            Self::Glass
        } else if matches!(frame.light(), Light::Directional(_)) && medium.height_falloff().is_none() {
            let channels = if medium.is_grey() { 1 } else { 3 };
            Self::Lengths { sigma_t: medium.sigma_t().map(|sigma| sigma as f32), channels }
        } else {
            Self::Radiance(LightIntegralF32::new(frame.setup()))
        }
    }

    /// Adds runs of segments; `perspective` says what their parameter is.
    #[inline(always)]
    pub fn add_runs<S: Simd>(
        &self,
        simd: S,
        frame: &Frame<'_>,
        (runs, segments, perspective): (&Runs, &[Segment], bool),
        sums: &mut TileSums,
    ) {
        for at in (0..runs.len()).step_by(LANES) {
            let (numbers, from, to) = runs.sixteen(at);
            let count = (runs.len() - at).min(LANES);
            let (mut pixels, mut starts, mut lengths) = ([0u32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
            for lane in 0..LANES {
                let segment = &segments[numbers[lane] as usize];
                let (mut a, mut b) = (from[lane], to[lane]);
                if perspective {
                    (a, b) = (depth_behind(a, segment), depth_behind(b, segment));
                }
                pixels[lane] = segment[Word::Pixel as usize];
                starts[lane] = f32::from_bits(segment[Word::Base as usize]) + a;
                lengths[lane] = b - a;
            }
            self.add(simd, frame, &pixels, &starts, &lengths, count, sums);
        }
    }

    /// Adds lit stretches of the first `count` of sixteen pixels: the camera's depth at their starts, and how much of it.
    #[expect(clippy::too_many_arguments, reason = "three columns of one table, and what they are added to")]
    #[inline(always)]
    pub fn add<S: Simd>(
        &self,
        simd: S,
        frame: &Frame<'_>,
        pixels: &[u32; LANES],
        starts: &[f32; LANES],
        lengths: &[f32; LANES],
        count: usize,
        sums: &mut TileSums,
    ) {
        match self {
            Self::Lengths { sigma_t, channels } => {
                let mut stretch = [0.0; LANES];
                for lane in 0..LANES {
                    stretch[lane] = sums.stretch[pixels[lane] as usize];
                }
                let stretch = Reals::load_array(simd, stretch);
                let (starts, lengths) =
                    (Reals::load_array_ref(simd, starts), Reals::load_array_ref(simd, lengths));
                for (channel, sigma) in sigma_t.iter().enumerate().take(*channels) {
                    let added = lit_length(simd, stretch * real(simd, *sigma), starts, lengths).to_array();
                    let values = &mut sums.channels[channel];
                    for lane in 0..count {
                        values[pixels[lane] as usize] += added[lane];
                    }
                }
            }
            Self::Radiance(light) => {
                let rays = RayLanes::from_fn(|lane| ray_of(frame, sums, pixels[lane]));
                let along = |lane: usize, depth: f32| depth * sums.stretch[pixels[lane] as usize];
                let a = std::array::from_fn(|lane| along(lane, starts[lane]));
                let b = std::array::from_fn(|lane| along(lane, starts[lane] + lengths[lane]));
                let radiance = light.intervals(simd.level(), &rays, &a, &b);
                for (values, added) in sums.channels.iter_mut().zip(&radiance) {
                    for lane in 0..count {
                        values[pixels[lane] as usize] += added[lane];
                    }
                }
            }
            Self::Glass => {
                for lane in 0..count {
                    let stretch = f64::from(sums.stretch[pixels[lane] as usize]);
                    let from = f64::from(starts[lane]) * stretch;
                    let to = from + f64::from(lengths[lane]) * stretch;
                    self.add_exactly(frame, pixels[lane], [from, to], sums);
                }
            }
        }
    }

    /// Adds a lit part of one pixel's ray \[world units along the ray\] in f64.
    pub fn add_exactly(&self, frame: &Frame<'_>, pixel: u32, [from, to]: [f64; 2], sums: &mut TileSums) {
        if !(from < to) {
            return;
        }
        let eye = frame.camera().eye();
        let ray = ray_of(frame, sums, pixel);
        let at = pixel as usize;
        if let Self::Lengths { sigma_t, channels } = self {
            let stretch = f64::from(sums.stretch[at]);
            for (values, sigma) in sums.channels.iter_mut().zip(sigma_t).take(*channels) {
                let length = scatter_core::sun_interval((*sigma).into(), from, to) / stretch;
                values[at] += length.min(1e30) as f32;
            }
            return;
        }
        let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
        let mut radiance = DVec3::ZERO;
        match frame.texture() {
            None => radiance += light.interval(from, to),
            Some(texture) => texture.pieces(eye, ray.origin, ray.direction, [from, to], |a, b, colour| {
                radiance += light.interval(a, b) * DVec3::from(colour.map(f64::from));
            }),
        }
        for (values, added) in sums.channels.iter_mut().zip(radiance.to_array()) {
            values[at] += added as f32;
        }
    }
}

/// The ray of a pixel of a tile.
fn ray_of(frame: &Frame<'_>, sums: &TileSums, pixel: u32) -> ViewRay {
    let [x, y] = sums.place(pixel);
    frame.camera().pixel_ray(x, y)
}

/// The camera's depth behind a segment's start, from the parameter of a perspective map's segment.
#[inline(always)]
fn depth_behind(s: f32, segment: &Segment) -> f32 {
    let [depth, per_depth] = [Word::Depth, Word::PerDepth].map(|word| f32::from_bits(segment[word as usize]));
    s * depth / (1.0 - s / per_depth)
}
