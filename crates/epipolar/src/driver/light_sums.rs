//! What lit runs scatter towards the eye, in closed form, as shares of what the whole ray would (Yusov 2012, Eq. 16).
//!
//! Under a sun in a uniform medium a run is a difference of transmittances, summed at once. In height fog and around lamps
//! runs are collected and integrated sixteen at a time by core's lanes. A share is a quotient of two sums with the same
//! factors, so that a sun's phase function and irradiance cancel: they come in with the closed form of the pixel, last
//! (Yusov 2012, Section 6.8).
//!
//! Departure from Eq. 16: a run's integral is never a difference of two antiderivatives.

use glam::DVec3;
use scatter_core::{
    Frame, Level, Light, LightIntegralF32, Medium, RayLanes, ViewRay, at_level, sun_interval_f32,
};

const LANES: usize = RayLanes::COUNT;

/// The light of a frame along view rays.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one a frame, on the stack: a box would be an allocation")]
pub enum FrameLight<'a> {
    /// A sun in a uniform medium: what is left is `∫ e^{−σt} dt`.
    Sun {
        /// σt of each channel.
        sigma_t: [f32; 3],
        /// Whether all channels are alike.
        grey: bool,
    },
    /// Anything else.
    Lanes(LightIntegralF32<'a>),
}

impl<'a> FrameLight<'a> {
    /// Of a frame.
    pub fn new(frame: &Frame<'a>) -> Self {
        let medium = frame.medium();
        match frame.light() {
            Light::Directional(_) if medium.height_falloff().is_none() => {
                Self::Sun { sigma_t: medium.sigma_t().map(|sigma| sigma as f32), grey: medium.is_grey() }
            }
            _ => Self::Lanes(LightIntegralF32::new(frame.setup())),
        }
    }
}

/// Channels whose shares differ: one where all three see the same medium by the same phase functions. A sun's phase is no
/// part of a share.
pub fn channels_of(light: &Light, medium: &Medium) -> usize {
    let alike = |sigma: [f64; 3]| sigma[0] == sigma[1] && sigma[1] == sigma[2];
    let components = medium.components();
    let scatters_alike = matches!(light, Light::Directional(_))
        || components.len() == 1
        || components.iter().all(|component| alike(component.sigma_s));
    if medium.is_grey() && scatters_alike { 1 } else { 3 }
}

/// One ray's sums.
#[derive(Debug, Clone, Copy, Default)]
struct RaySum {
    direction: DVec3,
    end: f32,
    lit: [f32; 3],
    whole: [f32; 3],
    /// Whether all of it, white, is lit.
    all: bool,
}

/// A run that waits for fifteen others.
#[derive(Debug, Clone, Copy, Default)]
struct Run {
    ray: usize,
    ends: [f32; 2],
    colour: [f32; 3],
    whole: bool,
}

/// Sums of the lit runs of some rays; a buffer.
#[derive(Debug, Default)]
pub struct LightSums {
    rays: Vec<RaySum>,
    runs: [Run; LANES],
    waiting: usize,
    /// Lit runs that were integrated.
    pub integrated: u64,
}

impl LightSums {
    /// Room for so many rays at a time.
    pub fn reserve(&mut self, rays: usize) {
        self.rays.clear();
        self.rays.reserve(rays);
    }

    /// Forgets all rays.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.waiting = 0;
    }

    /// Begins the next ray, of a unit direction and an end.
    #[inline(always)]
    pub fn begin(&mut self, direction: DVec3, end: f32) {
        self.rays.push(RaySum { direction, end, ..RaySum::default() });
    }

    /// Adds a lit run of the last ray, in white light; the run that is the whole ray is not integrated.
    #[inline(always)]
    pub fn add(&mut self, light: &FrameLight<'_>, simd: Level, [from, to]: [f64; 2]) {
        if let Some(ray) = self.rays.last_mut()
            && from == 0.0
            && to as f32 >= ray.end
        {
            ray.all = true;
            return;
        }
        self.add_coloured(light, simd, [from, to], [1.0; 3]);
    }

    /// Adds a lit run of the last ray in light of a colour.
    #[inline(always)]
    pub fn add_coloured(
        &mut self,
        light: &FrameLight<'_>,
        simd: Level,
        [from, to]: [f64; 2],
        colour: [f32; 3],
    ) {
        let ends = [from as f32, to as f32];
        self.integrated += 1;
        match light {
            FrameLight::Sun { sigma_t, grey } => {
                let Some(ray) = self.rays.last_mut() else { return };
                let lengths = if *grey {
                    [sun_interval_f32(sigma_t[0], ends[0], ends[1]); 3]
                } else {
                    sigma_t.map(|sigma| sun_interval_f32(sigma, ends[0], ends[1]))
                };
                for ((lit, colour), length) in ray.lit.iter_mut().zip(colour).zip(lengths) {
                    *lit += colour * length;
                }
            }
            FrameLight::Lanes(light) => {
                self.wait(light, simd, Run { ray: self.rays.len() - 1, ends, colour, whole: false });
            }
        }
    }

    /// Integrates what every ray would have without a shadow, and what still waits. Rays that are dark, or lit all along,
    /// are left out if `all_wholes` is not set.
    #[inline(never)]
    pub fn finish(&mut self, light: &FrameLight<'_>, simd: Level, all_wholes: bool) {
        for index in 0..self.rays.len() {
            let ray = &mut self.rays[index];
            if !all_wholes && (ray.all || (ray.lit == [0.0; 3] && matches!(light, FrameLight::Sun { .. }))) {
                continue;
            }
            match light {
                FrameLight::Sun { sigma_t, grey } => {
                    ray.whole = if *grey {
                        [sun_interval_f32(sigma_t[0], 0.0, ray.end); 3]
                    } else {
                        sigma_t.map(|sigma| sun_interval_f32(sigma, 0.0, ray.end))
                    };
                }
                FrameLight::Lanes(light) => {
                    let ends = [0.0, ray.end];
                    self.wait(light, simd, Run { ray: index, ends, colour: [1.0; 3], whole: true });
                }
            }
        }
        if let FrameLight::Lanes(light) = light {
            self.flush(light, simd);
        }
    }

    #[inline(always)]
    fn wait(&mut self, light: &LightIntegralF32<'_>, simd: Level, run: Run) {
        self.runs[self.waiting] = run;
        self.waiting += 1;
        if self.waiting == LANES {
            self.flush(light, simd);
        }
    }

    /// Integrates the runs that wait.
    #[inline(never)]
    fn flush(&mut self, light: &LightIntegralF32<'_>, simd: Level) {
        if self.waiting == 0 {
            return;
        }
        // What is not filled repeats the first, without length.
        let run = |lane: usize| &self.runs[if lane < self.waiting { lane } else { 0 }];
        let lanes = RayLanes::from_fn(|lane| ViewRay {
            origin: DVec3::ZERO,
            direction: self.rays[run(lane).ray].direction,
        });
        let (mut from, mut to) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..self.waiting {
            [from[lane], to[lane]] = self.runs[lane].ends;
        }
        let radiance = at_level!(simd, light.intervals(simd, &lanes, &from, &to));
        for lane in 0..self.waiting {
            let run = &self.runs[lane];
            let ray = &mut self.rays[run.ray];
            for (channel, radiance) in radiance.iter().enumerate() {
                if run.whole {
                    ray.whole[channel] = radiance[lane];
                } else {
                    ray.lit[channel] += run.colour[channel] * radiance[lane];
                }
            }
        }
        self.waiting = 0;
    }

    /// Light of a ray's lit runs and of the whole ray, in their own unit, after [`Self::finish`] with `all_wholes`; of
    /// `channels` channels, 1 or 3.
    #[inline(always)]
    pub fn light(&self, ray: usize, channel: usize, channels: usize) -> [f32; 2] {
        let ray = &self.rays[ray];
        let whole = in_channel(&ray.whole, channel, channels);
        [if ray.all { whole } else { in_channel(&ray.lit, channel, channels) }, whole]
    }

    /// The share of a ray that is lit, ≥ 0; at most 1 in white light.
    #[inline(always)]
    pub fn share(&self, ray: usize, channel: usize, channels: usize, white: bool) -> f32 {
        let ray = &self.rays[ray];
        if ray.all {
            return 1.0;
        }
        let (lit, whole) =
            (in_channel(&ray.lit, channel, channels), in_channel(&ray.whole, channel, channels));
        if lit == 0.0 && !(whole > 0.0) {
            // A ray that is dark, or without light, which has no shadow.
            return if matches!(ray.lit, [0.0, 0.0, 0.0]) { 0.0 } else { 1.0 };
        }
        let share = lit / whole;
        // Two infinite sums of an endless ray through a vacuum: it scatters nothing.
        let share = if share.is_finite() { share } else { 1.0 };
        if white { share.min(1.0) } else { share }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.rays.capacity() * size_of::<RaySum>()
    }
}

/// The value of a channel, or of all together where they differ in nothing but their strength: the light may lack any.
#[inline(always)]
fn in_channel(values: &[f32; 3], channel: usize, channels: usize) -> f32 {
    if channels == 1 { values[0] + values[1] + values[2] } else { values[channel] }
}
