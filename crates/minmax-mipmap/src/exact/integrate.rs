//! Lit runs to radiance: what a tile's pixels add up, and how.
//!
//! Under a sun in a uniform medium a pixel adds up lit lengths, `∫ e^{−σt} dt`, one a channel where the extinction is
//! coloured; everything else is constant along a ray and waits for the end. Near a lamp and in height fog it adds up
//! radiance. Behind glass each run is cut where its colour changes.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use scatter_core::{Camera, Frame, Light, LightIntegralF32, Projection, RayFan, RayLanes, RayLight, ViewRay};

use super::glass::{Glass, GlassBlocks, GlassRuns};
use super::lanes::{Reals, lit_length, real};
use super::queues::Runs;
use super::ray_fan::LANES;
use super::segment::{Segment, Start, Word};

/// What is added up.
pub enum Integrand<'a> {
    /// Lit lengths under a sun in a uniform medium; RGB extinction.
    Lengths {
        /// σt by channel.
        sigma_t: [f32; 3],
        /// Channels that differ: 1 or 3.
        channels: usize,
    },
    /// Lit lengths under a sun in a uniform medium behind glass, times the glass' colours: three channels.
    Stained {
        /// σt by channel.
        sigma_t: [f32; 3],
        /// Whether they are the same.
        grey: bool,
        /// The glass.
        glass: Glass<'a>,
    },
    /// Radiance of any light, in f32.
    Radiance(LightIntegralF32<'a>),
    /// Radiance behind any glass, in f64.
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
    /// The pixels' rays, sixteen side by side along a row, if [`Self::lay_rays`] laid them.
    rays: Vec<RayLanes>,
    /// Of a lamp, how far along each pixel's ray no interval that ends there must be integrated in f64.
    safe: Vec<f32>,
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

    /// Lays the pixels' rays, which lamps and height fog ask for once a lit interval; `lamp` is relative to the eye.
    #[inline(always)]
    pub fn lay_rays(&mut self, camera: &Camera, lamp: Option<DVec3>) {
        self.rays.clear();
        self.safe.clear();
        self.safe.reserve(self.stretch.len());
        let count = self.stretch.len() / RayLanes::COUNT;
        self.rays.reserve(count);
        for n in 0..count as u32 {
            let [x, y] = self.place(n * RayLanes::COUNT as u32);
            let rays = RayLanes::of_pixels(camera, x, y);
            if let Some(lamp) = lamp {
                self.safe.extend(safe_lengths(lamp, &rays));
            }
            self.rays.push(rays);
        }
    }

    /// The rays of sixteen pixels.
    #[inline(always)]
    fn rays_of(&self, pixels: &[u32; LANES]) -> RayLanes {
        let mut rays = RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3] };
        for (lane, &pixel) in pixels.iter().enumerate() {
            let pixel = pixel as usize;
            let (laid, place) = (&self.rays[pixel / RayLanes::COUNT], pixel % RayLanes::COUNT);
            for axis in 0..3 {
                rays.origin[axis][lane] = laid.origin[axis][place];
                rays.direction[axis][lane] = laid.direction[axis][place];
            }
        }
        rays
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let numbers: usize = self.channels.iter().chain([&self.stretch]).map(Vec::capacity).sum();
        ((numbers + self.safe.capacity()) * size_of::<f32>() + self.rays.capacity() * size_of::<RayLanes>())
            as u64
    }
}

impl<'a> Integrand<'a> {
    /// For a frame, the rays of whose camera are `fan`; blocks of its glass are built into `blocks`.
    pub fn of(frame: &Frame<'a>, fan: &RayFan, blocks: &'a mut GlassBlocks) -> Self {
        let medium = frame.medium();
        let is_uniform_sun =
            matches!(frame.light(), Light::Directional(_)) && medium.height_falloff().is_none();
        let sigma_t = medium.sigma_t().map(|sigma| sigma as f32);
        match frame.texture() {
            Some(texture) if is_uniform_sun && !texture.projection().is_perspective() => {
                blocks.build(texture);
                let glass = Glass::new(texture, blocks, fan.in_map(texture.projection()));
                Self::Stained { sigma_t, grey: medium.is_grey(), glass }
            }
            Some(_) => Self::Glass,
            None if is_uniform_sun => {
                Self::Lengths { sigma_t, channels: if medium.is_grey() { 1 } else { 3 } }
            }
            None => Self::Radiance(LightIntegralF32::new(frame.setup())),
        }
    }

    /// Whether sums are lengths, to be multiplied by what the sun's light is along each ray.
    pub fn is_length(&self) -> bool {
        matches!(self, Self::Lengths { .. } | Self::Stained { .. })
    }

    /// Whether an interval costs much more than where it lies: one must not be cut in two.
    pub fn is_dear(&self) -> bool {
        !matches!(self, Self::Lengths { .. })
    }

    /// Adds runs of segments, whose starts are `starts` and, in f64, `bases`; `perspective` says what their parameter is.
    #[inline(always)]
    pub fn add_runs<S: Simd>(
        &self,
        simd: S,
        frame: &Frame<'_>,
        (runs, segments, starts, bases, perspective): (&Runs, &[Segment], &[Start], &[f64], bool),
        sums: &mut TileSums,
    ) {
        for at in (0..runs.len()).step_by(LANES) {
            let (numbers, from, to) = runs.sixteen(at);
            let count = (runs.len() - at).min(LANES);
            let (mut pixels, mut depths) = ([0u32; LANES], [0.0f32; LANES]);
            // From a segment's start to the run's, and to its end.
            let (mut behind, mut end) = (from, to);
            for lane in 0..LANES {
                let start = &starts[numbers[lane] as usize];
                (pixels[lane], depths[lane]) = (start.pixel, start.depth);
            }
            if perspective {
                for lane in 0..LANES {
                    let segment = &segments[numbers[lane] as usize];
                    behind[lane] = depth_behind(behind[lane], segment);
                    end[lane] = depth_behind(end[lane], segment);
                }
            }
            let first = Reals::load_array_ref(simd, &behind);
            let mut lengths = (Reals::load_array_ref(simd, &end) - first).to_array();
            let depths = (Reals::load_array_ref(simd, &depths) + first).to_array();
            let stretched =
                |lane: usize| (depths[lane] + lengths[lane]) * sums.stretch[pixels[lane] as usize];
            if let (Self::Radiance(_), Some(lamp)) = (self, frame.light().position())
                && (0..count).any(|lane| !(stretched(lane) < sums.safe[pixels[lane] as usize]))
            {
                let lamp = lamp - frame.camera().eye();
                let rays = sums.rays_of(&pixels);
                let mut ends = [[0.0; LANES]; 2];
                let stretch = along_rays(frame, &rays);
                for lane in 0..LANES {
                    let from = bases[numbers[lane] as usize] + f64::from(behind[lane]);
                    ends[0][lane] = from * stretch[lane];
                    ends[1][lane] = (from + f64::from(lengths[lane])) * stretch[lane];
                }
                let mut exact = at_the_lamp(lamp, &rays, &ends) & ((1u32 << count) - 1);
                while exact != 0 {
                    let lane = exact.trailing_zeros() as usize;
                    exact &= exact - 1;
                    self.add_exactly(frame, pixels[lane], [ends[0][lane], ends[1][lane]], sums);
                    lengths[lane] = 0.0;
                }
            }
            self.add(simd, frame, &pixels, &depths, &lengths, count, sums);
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
            Self::Stained { sigma_t, grey, glass } => {
                let mut runs = GlassRuns { places: [[0.0; LANES]; 2], part: [[0.0; LANES]; 2] };
                let mut stretch = [0.0; LANES];
                for lane in 0..LANES {
                    let [x, y] = sums.place(pixels[lane]);
                    (runs.places[0][lane], runs.places[1][lane]) = (x.into(), y.into());
                    runs.part[0][lane] = starts[lane].into();
                    runs.part[1][lane] = f64::from(starts[lane]) + f64::from(lengths[lane]);
                    stretch[lane] = sums.stretch[pixels[lane] as usize];
                }
                let sigma = sigma_t.map(|sigma| stretch.map(|stretch| stretch * sigma));
                let added = glass.lengths(simd.level(), &runs, &sigma, *grey);
                for (values, added) in sums.channels.iter_mut().zip(added) {
                    for lane in 0..count {
                        values[pixels[lane] as usize] += added[lane];
                    }
                }
            }
            Self::Radiance(light) => {
                let rays = sums.rays_of(pixels);
                let (mut a, mut b) = (*starts, *starts);
                for lane in 0..LANES {
                    let stretch = sums.stretch[pixels[lane] as usize];
                    a[lane] = starts[lane] * stretch;
                    b[lane] = (starts[lane] + lengths[lane]) * stretch;
                }
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
        if let Self::Stained { sigma_t, glass, .. } = self {
            let stretch = f64::from(sums.stretch[at]);
            glass.texture().pieces(eye, ray.origin, ray.direction, [from, to], |a, b, colour| {
                for (channel, values) in sums.channels.iter_mut().enumerate() {
                    let length = scatter_core::sun_interval(sigma_t[channel].into(), a, b) / stretch;
                    values[at] += (length * f64::from(colour[channel])).min(1e30) as f32;
                }
            });
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

/// How long a unit of the rays' parameter is, in f64: of the depth of a perspective camera.
#[inline(always)]
fn along_rays(frame: &Frame<'_>, rays: &RayLanes) -> [f64; LANES] {
    let mut along = [1.0; LANES];
    if frame.camera().projection() == Projection::Perspective {
        let forward = frame.camera().forward();
        let [x, y, z] = &rays.direction;
        for lane in 0..LANES {
            along[lane] = 1.0 / (x[lane] * forward.x + y[lane] * forward.y + z[lane] * forward.z);
        }
    }
    along
}

/// What t·h/d² of an interval's end may be at the most in f32: [`at_the_lamp`].
const MOST: f64 = 16.0;

/// Which intervals of a lamp must be integrated in f64, a bit each, by where they end on their rays: rounding t to f32
/// shifts an end by 2⁻²⁴·t, where the light is as 1/d² and all of the ray has about 1/h, so the share that is lost is
/// 2⁻²⁴·t·h/d²; a millionth is allowed. `lamp` is relative to the eye.
#[inline(always)]
fn at_the_lamp(lamp: DVec3, rays: &RayLanes, ends: &[[f64; LANES]; 2]) -> u32 {
    let mut near = [0u32; LANES];
    for lane in 0..LANES {
        let (closest, distance_sq) = of_lamp(lamp, rays, lane);
        let distance = distance_sq.sqrt();
        let is_near = |t: f64| t * distance > MOST * (distance_sq + (t - closest) * (t - closest));
        near[lane] = u32::from(is_near(ends[0][lane]) | is_near(ends[1][lane])) << lane;
    }
    near.into_iter().fold(0, |all, bit| all | bit)
}

/// How far along rays no interval that ends there is one of [`at_the_lamp`]: that needs t > 16·h, for h the lamp's distance
/// from the ray; a thousandth less, since t is compared in f32.
#[inline(always)]
fn safe_lengths(lamp: DVec3, rays: &RayLanes) -> [f32; LANES] {
    let mut safe = [0.0; LANES];
    for (lane, safe) in safe.iter_mut().enumerate() {
        let (_, distance_sq) = of_lamp(lamp, rays, lane);
        *safe = (0.999 * MOST * distance_sq.sqrt()) as f32;
    }
    safe
}

/// How far along a ray the lamp is closest, and the square of its distance there.
#[inline(always)]
fn of_lamp(lamp: DVec3, rays: &RayLanes, lane: usize) -> (f64, f64) {
    let way = [0, 1, 2].map(|axis| rays.direction[axis][lane]);
    let to_lamp = [0, 1, 2].map(|axis| lamp[axis] - rays.origin[axis][lane]);
    let closest = to_lamp[0] * way[0] + to_lamp[1] * way[1] + to_lamp[2] * way[2];
    let across = [
        to_lamp[1] * way[2] - to_lamp[2] * way[1],
        to_lamp[2] * way[0] - to_lamp[0] * way[2],
        to_lamp[0] * way[1] - to_lamp[1] * way[0],
    ];
    (closest, across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
}

/// The camera's depth behind a segment's start, from the parameter of a perspective map's segment.
#[inline(always)]
fn depth_behind(s: f32, segment: &Segment) -> f32 {
    let [depth, per_depth] = [Word::Depth, Word::PerDepth].map(|word| f32::from_bits(segment[word as usize]));
    s * depth / (1.0 - s / per_depth)
}
