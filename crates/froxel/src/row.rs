//! One row of the grid: visibility of every froxel's samples, then the sums along the depth (Wronski 2014).
//!
//! Sixteen columns at a time: their froxels stand together as `[slice][channel][column]`, so that both steps run over
//! neighbouring numbers that are still in the cache. Slices behind the deepest pixel that reads a column are left out
//! (engines do so by a conservative depth).

use scatter_core::{Frame, Light, RayLanes, ShadowMap};

use crate::grid::footing::{Footing, readers};
use crate::grid::jitter::sample_place;
use crate::grid::slices::Slices;
use crate::light::glass::Glass;
use crate::light::lamp::{LampLight, PhaseTerm};
use crate::light::occlusion::{Clear, ConeMap, CubeMap, Occlusion, OneMap, SeveralMaps};
use crate::light::paths::{LANES, Lanes};
use crate::light::sums::{SliceLight, Sums};
use crate::light::sun::{FogSun, SunTable, UniformSun, sources};

/// What all rows of a frame's grid share.
pub struct GridFrame<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Whether any texel of its maps holds a surface.
    pub casts_shadow: bool,
    /// Columns and rows, at most a column a pixel.
    pub size: [u32; 2],
    /// Where the slices lie.
    pub slices: &'a Slices,
    /// Samples a froxel.
    pub frames: u32,
    /// Where the samples lie along the rays, `[pass][slice]` \[world units\].
    pub samples: &'a [f64],
    /// The columns that each pixel column reads, and the rows that each pixel row reads.
    pub footings: [&'a [Footing]; 2],
    /// A sun's light a slice in a uniform medium.
    pub sun: &'a SunTable,
    /// How the medium scatters a lamp's light, and the largest σs.
    pub terms: (&'a [PhaseTerm], f64),
}

impl GridFrame<'_> {
    /// Numbers of a row of froxels in `channels`.
    pub fn row_length(&self, channels: usize) -> usize {
        self.size[0].div_ceil(LANES as u32) as usize * self.block_length(channels)
    }

    /// Numbers of sixteen columns in `channels`.
    pub fn block_length(&self, channels: usize) -> usize {
        self.slices.count() * channels * LANES
    }

    /// Fills row `row` in `C` channels: after each slice the share of the light so far that is lit, or with `RADIANCE` the
    /// radiance so far. Returns how many samples were taken.
    #[inline(always)]
    pub fn fill_row<const C: usize, const RADIANCE: bool>(&self, row: u32, values: &mut [f32]) -> u64 {
        let lines = readers(self.footings[1], [row, row + 1]);
        let mut samples = 0;
        for (block, values) in values.chunks_exact_mut(self.block_length(C)).enumerate() {
            let first = (block * LANES) as u32;
            let slices = 1 + self.deepest_slice(first, lines);
            let values = &mut values[..slices * C * LANES];
            for pass in 0..self.frames {
                self.look::<C>([first, row], pass, values);
            }
            self.accumulate::<C, RADIANCE>([first, row], values);
            let columns = (self.size[0] - first).min(LANES as u32);
            samples += slices as u64 * u64::from(columns) * u64::from(self.frames);
        }
        samples
    }

    /// The last slice that a pixel reads of sixteen columns from `first` on, among these lines of the picture.
    #[inline(always)]
    fn deepest_slice(&self, first: u32, [from, to]: [usize; 2]) -> usize {
        let [left, right] = readers(self.footings[0], [first, first + LANES as u32]);
        let (depth, width) = (self.frame.depth().texels(), self.frame.size()[0] as usize);
        let mut deepest = 0.0f32;
        for line in from..to {
            for &depth in &depth[line * width + left..line * width + right] {
                deepest = if depth > deepest { depth } else { deepest };
            }
        }
        self.slices.slice_of(deepest.min(self.frame.max_distance() as f32))
    }

    /// The rays of sixteen columns, at a place within each froxel.
    #[inline(always)]
    fn rays(&self, [first, row]: [u32; 2], [across, down, _]: [f64; 3]) -> RayLanes {
        let camera = self.frame.camera();
        let [width, height] = camera.size().map(f64::from);
        let [columns, rows] = self.size.map(f64::from);
        let y = (f64::from(row) + down) * (height / rows);
        RayLanes::from_fn(|lane| {
            let column = (first + lane as u32).min(self.size[0] - 1);
            camera.ray((f64::from(column) + across) * (width / columns), y)
        })
    }

    /// Adds what light reaches the samples of a pass, over the number of passes.
    #[inline(always)]
    fn look<const C: usize>(&self, place: [u32; 2], pass: u32, values: &mut [f32]) {
        let mut within = sample_place(pass, self.frames);
        for axis in 0..2 {
            // No wider than a pixel: samples stay on the pixel's own ray, whose image this is.
            if self.size[axis] == self.frame.size()[axis] {
                within[axis] = 0.5;
            }
        }
        let rays = self.rays(place, within);
        let eye = self.frame.camera().eye();
        match self.frame.shadow() {
            _ if !self.casts_shadow => self.look_by::<C>(&Clear, pass, &rays, values),
            ShadowMap::Unshadowed => self.look_by::<C>(&Clear, pass, &rays, values),
            ShadowMap::Orthographic(layer) => {
                self.look_by::<C>(&OneMap::<false>::new(layer, eye, &rays), pass, &rays, values);
            }
            ShadowMap::Perspective(layer) => {
                // A perspective map is a spot's, which a frame checks.
                let Light::Spot(spot) = self.frame.light() else { return };
                self.look_by::<C>(&ConeMap::new(layer, spot, eye, &rays), pass, &rays, values);
            }
            ShadowMap::Cube(cube) => {
                self.look_by::<C>(&CubeMap::new(cube, eye, &rays), pass, &rays, values);
            }
            ShadowMap::Faces(faces) => {
                self.look_by::<C>(&SeveralMaps::<true>::new(*faces, eye, &rays), pass, &rays, values);
            }
            ShadowMap::Cascades(layers) => {
                self.look_by::<C>(&SeveralMaps::<false>::new(layers, eye, &rays), pass, &rays, values);
            }
        }
    }

    #[inline(always)]
    fn look_by<const C: usize>(
        &self,
        occlusion: &impl Occlusion,
        pass: u32,
        rays: &RayLanes,
        values: &mut [f32],
    ) {
        let weight = 1.0 / self.frames as f32;
        let samples = &self.samples[pass as usize * self.slices.count()..];
        let glass = match self.frame.texture() {
            // One channel has no colour.
            Some(texture) if C == 3 => Some(Glass::new(texture, self.frame.camera().eye(), rays)),
            _ => None,
        };
        for (values, &t) in values.chunks_exact_mut(C * LANES).zip(samples) {
            let lit = occlusion.lit(t);
            let colour = glass.as_ref().map(|glass| glass.colour(t));
            for (channel, values) in values.chunks_exact_mut(LANES).enumerate() {
                let mut light = lit;
                if let Some(colour) = &colour {
                    for lane in 0..LANES {
                        light[lane] *= colour[channel][lane];
                    }
                }
                for lane in 0..LANES {
                    let before = if pass == 0 { 0.0 } else { values[lane] };
                    values[lane] = before + weight * light[lane];
                }
            }
        }
    }

    /// Front to back: visible light becomes the sums up to the end of each slice.
    #[inline(always)]
    fn accumulate<const C: usize, const RADIANCE: bool>(&self, place: [u32; 2], values: &mut [f32]) {
        let rays = self.rays(place, [0.5; 3]);
        let (frame, medium) = (self.frame, self.frame.medium());
        let (lamp, spot) = match frame.light() {
            Light::Directional(sun) => {
                let source =
                    |per| if RADIANCE { sources(sun, medium, &rays, per) } else { [[0.0; LANES]; 3] };
                match medium.height_falloff() {
                    None => {
                        let light = UniformSun::new(self.sun, source([1.0; 3]));
                        accumulate_by::<C, RADIANCE>(light, values);
                    }
                    Some(falloff) => {
                        let fog = scatter_core::FogLanes::new(falloff, frame.camera().eye(), &rays);
                        let light = FogSun::new(self.slices, medium, fog, source(medium.sigma_t()));
                        accumulate_by::<C, RADIANCE>(light, values);
                    }
                }
                return;
            }
            Light::Point(lamp) => (lamp, None),
            Light::Spot(spot) => (spot.lamp(), Some(spot)),
        };
        if medium.height_falloff().is_none() {
            let light = LampLight::<false>::new(frame, (lamp, spot), self.slices, self.terms, &rays);
            accumulate_by::<C, RADIANCE>(light, values);
        } else {
            let light = LampLight::<true>::new(frame, (lamp, spot), self.slices, self.terms, &rays);
            accumulate_by::<C, RADIANCE>(light, values);
        }
    }
}

/// Larger radiances are taken at this: four of them, weighted, must not overflow.
const BRIGHTEST: f32 = 1e38;

#[inline(always)]
fn accumulate_by<const C: usize, const RADIANCE: bool>(mut light: impl SliceLight<C>, values: &mut [f32]) {
    let mut sums = Sums::<C>::ZERO;
    for (slice, values) in values.chunks_exact_mut(C * LANES).enumerate() {
        let mut visible = [[0.0; LANES]; C];
        for (channel, values) in values.chunks_exact(LANES).enumerate() {
            visible[channel].copy_from_slice(values);
        }
        light.add(slice, &visible, &mut sums);
        let unit: [Lanes; C] = if RADIANCE { light.radiance() } else { [[0.0; LANES]; C] };
        for (channel, values) in values.chunks_exact_mut(LANES).enumerate() {
            if RADIANCE {
                for lane in 0..LANES {
                    values[lane] = (sums.lit[channel][lane] * unit[channel][lane]).min(BRIGHTEST);
                }
            } else {
                values.copy_from_slice(&sums.share(channel, &visible[channel]));
            }
        }
    }
}
