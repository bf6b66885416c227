//! A sun's light a slice: Hillaire's energy-conserving integral of a slice, `T·(1 − e^{−σΔ})/σ` (2015).
//!
//! `∫ e^{−σt} dt` over the slice, in a form that needs no division by σ. In a uniform medium slices along the rays weigh the same
//! in all columns: one table. In height fog each ray has its own optical depths.

use glam::DVec3;
use scatter_core::{DirectionalLight, FogLanes, Medium, RayLanes, exp_f32, sun_interval};

use super::paths::{LANES, Lanes};
use super::sums::{SliceLight, Sums};
use crate::grid::slices::Slices;

/// `∫ e^{−σt} dt` of all slices, for each channel.
#[derive(Debug, Clone, Default)]
pub struct SunTable {
    /// `[slice][channel]`, of three channels.
    weights: Vec<[f32; 3]>,
}

impl SunTable {
    /// Of a uniform medium. Reuses the table.
    pub fn set(&mut self, sigma_t: [f64; 3], slices: &Slices) {
        self.weights.clear();
        let bounds = slices.bounds().windows(2);
        self.weights
            .extend(bounds.map(|pair| sigma_t.map(|sigma| sun_interval(sigma, pair[0], pair[1]) as f32)));
    }

    /// Bytes of the table.
    pub fn memory_bytes(&self) -> u64 {
        (self.weights.capacity() * size_of::<[f32; 3]>()) as u64
    }
}

/// A sun in a uniform medium.
pub struct UniformSun<'a> {
    table: &'a SunTable,
    source: [Lanes; 3],
}

impl<'a> UniformSun<'a> {
    /// `source` is `E·Σ σs·p` of each ray, where radiance is asked for.
    pub fn new(table: &'a SunTable, source: [Lanes; 3]) -> Self {
        Self { table, source }
    }
}

impl<const C: usize> SliceLight<C> for UniformSun<'_> {
    #[inline(always)]
    fn add(&mut self, slice: usize, visible: &[Lanes; C], sums: &mut Sums<C>) {
        let weights = self.table.weights[slice];
        for channel in 0..C {
            sums.add(channel, &[weights[channel]; LANES], &visible[channel]);
        }
    }

    #[inline(always)]
    fn radiance(&self) -> [Lanes; C] {
        std::array::from_fn(|channel| self.source[channel])
    }
}

/// A sun in height fog: `e^{−τ(a)}·(1 − e^{−(τ(b) − τ(a))})`, of each channel.
pub struct FogSun<'a> {
    slices: &'a Slices,
    fog: FogLanes,
    log_thickest: f64,
    /// Extinction of the channels, as shares of the thickest one.
    shares: [f32; 3],
    /// What is left at the end of the slices so far.
    through: [Lanes; 3],
    source: [Lanes; 3],
}

impl<'a> FogSun<'a> {
    /// `source` is `E·Σ σs·p` of each ray over the extinction of each channel, where radiance is asked for.
    pub fn new(slices: &'a Slices, medium: &Medium, fog: FogLanes, source: [Lanes; 3]) -> Self {
        let thickest = medium.sigma_t().into_iter().fold(0.0, f64::max);
        let shares = medium.sigma_t().map(|sigma| (sigma / thickest) as f32);
        Self { slices, fog, log_thickest: thickest.ln(), shares, through: [[1.0; LANES]; 3], source }
    }
}

impl<const C: usize> SliceLight<C> for FogSun<'_> {
    #[inline(always)]
    fn add(&mut self, slice: usize, visible: &[Lanes; C], sums: &mut Sums<C>) {
        let [from, to] = [slice, slice + 1].map(|bound| [self.slices.bounds_f32()[bound]; LANES]);
        let depths = self.fog.optical_depths(self.log_thickest, &from, &to);
        for channel in 0..C {
            let mut weights = [0.0; LANES];
            for lane in 0..LANES {
                let depth = depths[lane] * self.shares[channel];
                let before = self.through[channel][lane];
                weights[lane] = before * absorbed(depth);
                self.through[channel][lane] = before * exp_f32(-depth);
            }
            sums.add(channel, &weights, &visible[channel]);
        }
    }

    #[inline(always)]
    fn radiance(&self) -> [Lanes; C] {
        std::array::from_fn(|channel| self.source[channel])
    }
}

/// `1 − e^{−x}` for x ≥ 0, without cancellation: by its series below ½, whose first term left out is x⁹/9!, 1.1e-8 of x.
#[inline(always)]
fn absorbed(x: f32) -> f32 {
    let mut series = -1.0f32 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series * x + coefficient;
    }
    let thick = 1.0 - exp_f32(-x);
    if x < 0.5 { x * series } else { thick }
}

/// `E·Σ σs·p` of sixteen rays, each channel divided by `per`; 0 in channels where that is 0.
pub fn sources(sun: &DirectionalLight, medium: &Medium, rays: &RayLanes, per: [f64; 3]) -> [Lanes; 3] {
    let mut sources = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let way = DVec3::from([0, 1, 2].map(|axis| rays.direction[axis][lane]));
        let haversine = 0.25 * (sun.direction() + way).length_squared();
        let source = DVec3::from(sun.irradiance()) * medium.scattering_towards(haversine);
        for channel in 0..3 {
            let value = if per[channel] > 0.0 { source[channel] / per[channel] } else { 0.0 };
            sources[channel][lane] = value as f32;
        }
    }
    sources
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absorbed_light_keeps_its_digits() {
        let mut worst = 0.0f64;
        for step in 0..4000 {
            let x = 10f32.powf(f32::from(step as u16) * 0.002 - 7.0);
            let exact = -(-f64::from(x)).exp_m1();
            worst = worst.max((f64::from(absorbed(x)) / exact - 1.0).abs());
        }
        println!("worst relative error {worst:.1e} (allowed 1e-6)");
        assert!(worst < 1e-6);
        assert_eq!((absorbed(0.0), absorbed(f32::MAX)), (0.0, 1.0));
    }
}
