//! The technique: rows of the grid are filled and read in turn, so that no grid is ever held as a whole.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Level, Light, LightIntegralF32, LightKind, Limits,
    MAX_CASCADES, MapKind, PhaseKind, RenderError, RenderStats, ScatterImage, SceneFacts, StageClock,
    VolumetricShadow, at_level, parallel, simd_level,
};

use crate::grid::footing::{Footing, footings};
use crate::grid::jitter::sample_place;
use crate::grid::reach::far_of;
use crate::grid::slices::Slices;
use crate::light::lamp::{PhaseTerm, set_terms};
use crate::light::sun::SunTable;
use crate::options::{ID, Lookup, NEAR_SHARE, Options};
use crate::resolve::{Resolve, SliceBlend};
use crate::row::GridFrame;

const ALL_LIGHTS: &[LightKind] = &[LightKind::Directional, LightKind::Point, LightKind::Spot];

/// What it renders: all of the model but translucent occluders.
pub const CAPABILITIES: Capabilities = Capabilities {
    lights: ALL_LIGHTS,
    textures: ALL_LIGHTS,
    maps: &[
        MapKind::Unshadowed,
        MapKind::Orthographic,
        MapKind::Perspective,
        MapKind::Cube,
        MapKind::Faces,
        MapKind::Cascades,
    ],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre, CameraKind::Orthographic],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    height_fog: ALL_LIGHTS,
    translucent: &[],
    endless_rays: true,
    // Texel indices are u32, over the six faces of a cube together.
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u32::MAX as u64 / 6 },
};

/// Bytes of rows that are filled before they are read: enough to share among threads, few enough for a cache.
const ROWS_BYTES: usize = 8 << 20;

const GRID_STAGE: &str = "grid";
const LOOK_UP_STAGE: &str = "look-up";

/// Where slices turn exponential: a lamp's light lies about as far away as the lamp, however long the rays are.
fn near_of(frame: &Frame<'_>, far: f64) -> f64 {
    let lamp = frame.light().position().map_or(f64::INFINITY, |lamp| lamp.distance(frame.camera().eye()));
    (far / NEAR_SHARE).min(lamp).max(far * SMALLEST_NEAR)
}

/// Least `near` in units of `far`: slices grow by a factor of 21/count each, and their bounds stay apart in f32.
const SMALLEST_NEAR: f64 = 1e-9;

/// The grid of froxels (Wronski 2014) with Hillaire's energy-conserving integration (2015).
///
/// Every froxel takes one sample of the shadow map (or [`Options::frames`] jittered ones); along each column the light of the
/// slices is added up front to back; a pixel reads the four columns around it at the distance of its surface. Cost:
/// O(columns · rows · slices) fetches, whatever the picture and the scene, and O(pixels) look-ups.
///
/// Where nothing shadows, the image is the closed form. Where something does, a froxel is lit or dark as a whole: shafts thinner
/// than a froxel are missed or blurred, and light bleeds over columns at the edges of what is near.
#[derive(Debug)]
pub struct Froxel {
    options: Options,
    simd: Level,
    slices: Slices,
    samples: Vec<f64>,
    footings: [Vec<Footing>; 2],
    sun: SunTable,
    terms: Vec<PhaseTerm>,
    blend: SliceBlend,
    /// Some rows of the grid, `[row][sixteen columns][slice][channel][column]`.
    rows: Vec<f32>,
}

impl Froxel {
    /// With the widest registers of the CPU that it runs on, or the portable ones if the environment says
    /// `SCATTER_SIMD=baseline`.
    pub fn new(options: Options) -> Self {
        Self::with_simd(options, simd_level())
    }

    /// With the instructions of a level: `Level::baseline()` uses nothing but what every CPU of the target has.
    pub fn with_simd(options: Options, simd: Level) -> Self {
        Self {
            options,
            simd,
            slices: Slices::default(),
            samples: Vec::new(),
            footings: Default::default(),
            sun: SunTable::default(),
            terms: Vec::new(),
            blend: SliceBlend::default(),
            rows: Vec::new(),
        }
    }

    /// Its options.
    pub fn options(&self) -> Options {
        self.options
    }

    /// Tables of a frame: slices, samples, footings, light a slice. Returns columns and rows, and the largest σs.
    fn set(&mut self, frame: &Frame<'_>, facts: &SceneFacts) -> ([u32; 2], f64) {
        let Options { grid: [columns, rows, slices], frames, near, far, lookup: _ } = self.options;
        let [width, height] = frame.size();
        let size = [columns.min(width), rows.min(height)];
        let far = far.unwrap_or_else(|| far_of(frame, facts));
        let near = near.unwrap_or_else(|| near_of(frame, far));
        self.slices.set(slices as usize, near, far);
        self.samples.clear();
        if frames == 1 {
            self.samples.extend_from_slice(self.slices.middles());
        } else {
            for pass in 0..frames {
                let [_, _, along] = sample_place(pass, frames);
                let slices = &self.slices;
                self.samples.extend((0..slices.count()).map(|slice| slices.distance(slice as f64 + along)));
            }
        }
        let [across, down] = &mut self.footings;
        footings(width, size[0], across);
        footings(height, size[1], down);
        let medium = frame.medium();
        let uniform_sun = matches!(frame.light(), Light::Directional(_)) && medium.height_falloff().is_none();
        let sigma_t = if uniform_sun { medium.sigma_t() } else { [0.0; 3] };
        self.sun.set(sigma_t, &self.slices);
        self.blend.set(sigma_t, &self.slices);
        (size, set_terms(frame, &mut self.terms))
    }

    /// Whether one channel serves all three.
    fn is_one_channel(&self, frame: &Frame<'_>, facts: &SceneFacts) -> bool {
        let components = frame.medium().components();
        let one_colour = components.len() == 1
            || !facts.anisotropic
            || components.iter().all(|c| c.sigma_s[0] == c.sigma_s[1] && c.sigma_s[1] == c.sigma_s[2]);
        // A sun's phase functions are no part of the sums.
        let same = one_colour || facts.light == LightKind::Directional;
        self.options.lookup == Lookup::Share && facts.grey_extinction && !facts.textured && same
    }

    /// Fills and reads rows in turn; returns how many samples were taken, and adds the time of both stages.
    fn image<const C: usize, const RADIANCE: bool>(
        &self,
        (grid, light): (&GridFrame<'_>, &LightIntegralF32<'_>),
        rows: &mut Vec<f32>,
        out: &mut ScatterImage,
        stats: &mut RenderStats,
    ) -> u64 {
        let simd = self.simd;
        let resolve = Resolve {
            frame: grid.frame,
            light,
            slices: &self.slices,
            blend: &self.blend,
            columns: grid.footings[0],
            block_length: grid.block_length(C),
            simd,
        };
        let [width, height] = grid.frame.size().map(|side| side as usize);
        let row_count = grid.size[1] as usize;
        let length = grid.row_length(C);
        // A row for each thread at least, and the last one of those before.
        let in_cache = ROWS_BYTES / (length * size_of::<f32>());
        let held = in_cache.max(1 + parallel::worker_count()).clamp(2, row_count.max(2));
        if rows.len() < held * length {
            rows.resize(held * length, 0.0);
        }
        let rows = &mut rows[..held * length];
        let (inscattered, transmittance) = out.overwritten(grid.frame.size());
        let samples = AtomicU64::new(0);
        let lines = grid.footings[1];
        let (mut first, mut filled, mut line) = (0, 0, 0);
        let mut times = [Duration::ZERO; 2];
        while filled < row_count {
            let (mut clock, mut turn) = (StageClock::start(), RenderStats::default());
            let kept = filled - first;
            let end = row_count.min(first + held);
            parallel::for_each_row(
                &mut rows[kept * length..(end - first) * length],
                length,
                |index, values| {
                    let row = (filled + index) as u32;
                    let taken = at_level!(simd, grid.fill_row::<C, RADIANCE>(row, values));
                    samples.fetch_add(taken, Ordering::Relaxed);
                },
            );
            clock.lap(&mut turn, GRID_STAGE);
            filled = end;
            let ready = lines.partition_point(|footing| (footing.second as usize) < filled);
            let done = line;
            let pixels = done * width..ready * width;
            let held_rows = &*rows;
            parallel::for_each_row_of_both(
                (&mut inscattered[pixels.clone()], &mut transmittance[pixels]),
                width,
                |index, inscattered, transmittance| {
                    let y = done + index;
                    let footing = lines[y];
                    let pair = [footing.first, footing.second]
                        .map(|row| &held_rows[(row as usize - first) * length..][..length]);
                    let from = (pair, footing.share);
                    at_level!(simd, resolve.line::<C, RADIANCE>(y as u32, from, inscattered, transmittance));
                },
            );
            clock.lap(&mut turn, LOOK_UP_STAGE);
            line = ready;
            for (time, stage) in times.iter_mut().zip([GRID_STAGE, LOOK_UP_STAGE]) {
                *time += turn.stages.get(stage).unwrap_or_default();
            }
            // The next lines read the last row, too.
            rows.copy_within((filled - 1 - first) * length..(filled - first) * length, 0);
            first = filled - 1;
        }
        debug_assert_eq!(line, height, "every line is read");
        stats.stages.push(GRID_STAGE, times[0]);
        stats.stages.push(LOOK_UP_STAGE, times[1]);
        samples.into_inner()
    }

    /// Nothing to look up: the closed form alone.
    fn clear(&self, frame: &Frame<'_>, light: &LightIntegralF32<'_>, out: &mut ScatterImage) {
        let simd = self.simd;
        let resolve = Resolve {
            frame,
            light,
            slices: &self.slices,
            blend: &self.blend,
            columns: &[],
            block_length: 0,
            simd,
        };
        let (inscattered, transmittance) = out.overwritten(frame.size());
        parallel::for_each_row_of_both(
            (inscattered, transmittance),
            frame.size()[0] as usize,
            |y, inscattered, transmittance| {
                at_level!(simd, resolve.clear_line(y as u32, inscattered, transmittance));
            },
        );
    }

    fn memory_bytes(&self) -> u64 {
        let [across, down] = &self.footings;
        self.slices.memory_bytes()
            + self.sun.memory_bytes()
            + self.blend.memory_bytes()
            + (self.samples.capacity() * size_of::<f64>()
                + (across.capacity() + down.capacity()) * size_of::<Footing>()
                + self.terms.capacity() * size_of::<PhaseTerm>()
                + self.rows.capacity() * size_of::<f32>()) as u64
    }
}

impl VolumetricShadow for Froxel {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let light = LightIntegralF32::new(frame.setup());
        let scatters = facts.component_count > 0;
        if !scatters || !(facts.casts_shadow || facts.textured) {
            clock.lap(&mut stats, "facts");
            self.clear(frame, &light, out);
            clock.lap(&mut stats, "closed form");
        } else {
            let (size, largest) = self.set(frame, &facts);
            clock.lap(&mut stats, "facts");
            let grid = GridFrame {
                frame,
                casts_shadow: facts.casts_shadow,
                size,
                slices: &self.slices,
                frames: self.options.frames,
                samples: &self.samples,
                footings: [&self.footings[0], &self.footings[1]],
                sun: &self.sun,
                terms: (&self.terms, largest),
            };
            let mut rows = std::mem::take(&mut self.rows);
            let pass = (&grid, &light);
            let samples = match (self.options.lookup, self.is_one_channel(frame, &facts)) {
                (Lookup::Radiance, _) => self.image::<3, true>(pass, &mut rows, out, &mut stats),
                (Lookup::Share, true) => self.image::<1, false>(pass, &mut rows, out, &mut stats),
                (Lookup::Share, false) => self.image::<3, false>(pass, &mut rows, out, &mut stats),
            };
            let froxels = size.map(u64::from).iter().product::<u64>() * self.slices.count() as u64;
            self.rows = rows;
            stats.counts.push("froxels", froxels);
            stats.counts.push("samples", samples);
            stats.counts.push("shadow-map fetches", if facts.casts_shadow { samples } else { 0 });
        }
        stats.counts.push("rays", frame.size().map(u64::from).iter().product());
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        Ok(stats)
    }
}
