//! Everything of a frame but the sums: slices are laid, their spacing is estimated, they are integrated on all threads, and
//! what they found becomes an image.

use std::sync::atomic::{AtomicUsize, Ordering};

use scatter_core::{
    Frame, Level, RenderStats, ScatterImage, SceneFacts, StageClock, Window, parallel, simd_level,
};

use super::near_ends::NearEnds;
use super::pass::{Measuring, SlicePass, Worker};
use super::refinement::Refinement;
use super::resampling::Resampling;
use super::resolve::Resolve;
use super::shares::Shares;
use super::slice_integrator::{SliceIntegrator, SliceRoom, SliceSetup, TileUse};
use super::slice_view::SliceScene;
use super::spacing::{POWER, SpacingSearch};
use super::spacing_sample::{ErrorTarget, Measured, Unoccluded, column_stride, measured, stride};
use super::surfaces::Surfaces;
use crate::geometry::{Epipole, FanPixels, Slice, SliceMap, SliceSet};
use crate::rows::MinMaxTiles;

/// Slices a radian, at least, where the spacing is measured: fewer, and the sample has no gaps.
const FEWEST_SLICES: f64 = 100.0;

/// Slices of a frame at the most, beside [`SLICES_A_PIXEL`]: a few megabytes. A view of nearly half of all directions asks for
/// more, since what lies between two slices is a part of the view. Fewer, and thumbnails of wide views are walked.
const MOST_SLICES: usize = 1 << 18;

/// A pixel's own walk costs no more than a few slices: where a frame asks for more of them than that, its pixels are walked.
const SLICES_A_PIXEL: usize = 4;

/// Gaps of a task. More keep threads idle at the end of a frame, fewer integrate more slices twice.
const TASK: usize = 32;

/// Share of the unoccluded radiance, in units of the frame's mean, below which differences of slices are measured against it:
/// a hundredth is what the figures of levels are relative to.
const DARK_FLOOR: f32 = 0.01;

/// Shares below are f32's rounding of sums.
const LEAST_FLOOR: f32 = 1e-6;

/// Largest part of what a target allows that texels may hide which are not cut. It comes on top of what slices miss between them.
const MOST_OF_CUTS: f64 = 0.4;

/// How many times fewer gaps tell what such texels hide, since that is alike everywhere.
const FEWER_GAPS_OF_CUTS: usize = 4;

/// Nanoseconds that a slice costs beside its queries, and that a pixel costs where rays are cut, under a sun and around a lamp,
/// as met in rooms of sheets and before a lamp behind a grid: they only decide between two ways that both keep the level.
const SLICE: f64 = 3e4;
const CUT_OF_SUN: f64 = 150.0;
const CUT_OF_LAMP: f64 = 570.0;

/// How slices are laid and refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceSettings {
    /// Distance of slices \[pixels\], 1/16 to 16.
    pub spacing: f64,
    /// Slices a radian of the image's middle, at least, where the spacing is not measured; > 0.
    pub fewest_slices: f64,
    /// What the spacing is measured for: it shrinks or grows from `spacing` on until the target is just kept. `None` takes it as
    /// it is.
    pub target: Option<ErrorTarget>,
    /// When a further slice goes between two that differ.
    pub refinement: Refinement,
    /// How pixels get a slice's answers.
    pub resampling: Resampling,
    /// One column in how many has a view ray that pixels on one surface share, 1 to 16; 0: every pixel asks with its own depth.
    pub shared_columns: u32,
}

impl SliceSettings {
    /// Slices a given number of pixels apart, none halved: pixels are interpolated between them.
    pub const fn even(spacing: f64) -> Self {
        let refinement = Refinement { tolerance: 1.0, floor: 1.0, halvings: 0, walks_rest: false };
        Self {
            spacing,
            fewest_slices: 1.0,
            target: None,
            refinement,
            resampling: Resampling::Pixels,
            shared_columns: 0,
        }
    }
}

/// Renders frames with whatever sums their slices; all buffers are kept from frame to frame.
///
/// The same bits for any number of threads: every pixel is written by the one task that owns its gap. Time: the integrator's
/// for each slice, of which there are about `2·(width + height)/spacing` and more where they are halved; one pass over
/// the shadow map for its tiles; and some nanoseconds a pixel to list it, to interpolate and to resolve. Where more slices are
/// asked for than pixels are worth (views of nearly half of all directions) every pixel is walked. Memory: a few numbers a
/// pixel, a column and a texel column, per worker.
#[derive(Debug)]
pub struct SliceDriver<I: SliceIntegrator> {
    /// What sums the slices.
    pub integrator: I,
    simd: Level,
    slices: SliceSet,
    fan_pixels: Vec<FanPixels>,
    /// Fan and first gap of each task.
    tasks: Vec<(usize, usize)>,
    tiles: MinMaxTiles,
    shares: Shares,
    near_ends: NearEnds,
    workers: Vec<Worker<I::Scratch>>,
}

impl<I: SliceIntegrator> SliceDriver<I> {
    /// For the CPU that it runs on.
    pub fn new(integrator: I) -> Self {
        Self {
            integrator,
            simd: simd_level(),
            slices: SliceSet::default(),
            fan_pixels: Vec::new(),
            tasks: Vec::new(),
            tiles: MinMaxTiles::default(),
            shares: Shares::default(),
            near_ends: NearEnds::default(),
            workers: Vec::new(),
        }
    }

    /// Fills `out` with a frame that a perspective camera sees.
    ///
    /// A pixel's radiance is its unoccluded closed form times the share that its two slices find lit, interpolated between
    /// them; where nothing casts a shadow it is the closed form.
    pub fn render(
        &mut self,
        frame: &Frame<'_>,
        settings: &SliceSettings,
        out: &mut ScatterImage,
    ) -> RenderStats {
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let epipole = Epipole::new(frame.camera(), frame.light());
        let (spacing, widest, few_enough) = self.lay_first(frame, &epipole, settings);
        let channels = self.set_up(frame, epipole, widest, facts.longest_ray);
        clock.lap(&mut stats, "set-up");

        // A texture colours light that nothing shadows, too.
        let shadowed = facts.casts_shadow || facts.textured;
        let integrates = shadowed && few_enough && self.integrator.is_accurate();
        self.tiles.forget();
        if integrates {
            self.read_tiles(frame);
        }
        clock.lap(&mut stats, "extrema");

        let spacing = if integrates {
            self.integrate(frame, epipole, ([spacing, widest], channels), settings, (&mut stats, &mut clock))
        } else {
            spacing
        };
        clock.lap(&mut stats, "slices");

        let walked = Resolve::new(frame, shadowed.then_some((&self.shares, channels)), self.simd)
            .with_near_ends(&self.near_ends)
            .image(out);
        clock.lap(&mut stats, "resolve");

        let sum = |count: fn(&Worker<I::Scratch>) -> u64| self.workers.iter().map(count).sum::<u64>();
        stats.counts.push("slices", sum(|worker| worker.counts.slices));
        stats.counts.push("spacing in 1/64 pixel", (64.0 * spacing).round() as u64);
        self.integrator.report(&mut self.workers.iter().map(|worker| &worker.scratch), &mut stats);
        stats.counts.push("queries", sum(|worker| worker.counts.queries));
        stats.counts.push("walked pixels", walked);
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        stats
    }

    /// The slices of the last frame and the pixels between them.
    pub fn slice_map(&self) -> SliceMap<'_> {
        SliceMap { slices: &self.slices, pixels: &self.fan_pixels }
    }

    /// Lays slices at the spacing to begin with, which it returns, with room for what the next frame may need; and the widest
    /// that may follow, and whether slices are as many as the frame asks for.
    fn lay_first(
        &mut self,
        frame: &Frame<'_>,
        epipole: &Epipole,
        settings: &SliceSettings,
    ) -> (f64, f64, bool) {
        let [width, height] = frame.size().map(f64::from);
        // Pixels a radian in the middle of the image, along the coarser axis.
        let Window { left, right, bottom, top } = frame.camera().window();
        let per_radian = (width / (right - left).abs()).min(height / (top - bottom).abs());
        // A measured spacing needs no such guess.
        let fewest = if settings.target.is_some() { FEWEST_SLICES } else { settings.fewest_slices };
        let spacing = settings.spacing.min(per_radian / fewest);
        // However the spacing of the next frame turns out.
        let [finest, widest] = settings.target.map_or([spacing; 2], |target| {
            [target.within[0].min(spacing), target.within[1].min(per_radian / fewest).max(spacing)]
        });
        let most = MOST_SLICES as f64 + SLICES_A_PIXEL as f64 * width * height;
        let few_enough = 2.0 * (width + height) / finest <= most;
        let [finest, spacing, widest] =
            if few_enough { [finest, spacing, widest] } else { [settings.spacing; 3] };
        let most = self.slices.reserve(frame.size(), finest);
        self.tasks.reserve((most / TASK + 16).saturating_sub(self.tasks.len()));
        self.lay(frame, epipole, spacing);
        (spacing, widest, few_enough)
    }

    /// Distributes slices, finds the pixels of their fans, and cuts the gaps into tasks.
    fn lay(&mut self, frame: &Frame<'_>, epipole: &Epipole, spacing: f64) {
        self.slices.distribute(epipole, frame.size(), spacing);
        self.fan_pixels.resize_with(self.slices.fans.len().max(self.fan_pixels.len()), FanPixels::default);
        self.tasks.clear();
        for (index, fan) in self.slices.fans.iter().enumerate() {
            self.fan_pixels[index].find(epipole, frame.size(), fan, &self.slices.slices);
            self.tasks.extend((0..fan.count - 1).step_by(TASK).map(|first| (index, first)));
        }
    }

    /// Prepares the integrator and all buffers; returns for how many channels.
    fn set_up(&mut self, frame: &Frame<'_>, epipole: Epipole, widest: f64, longest_ray: f64) -> usize {
        let setup = SliceSetup { setup: frame.setup(), epipole, slices: &self.slices, longest_ray };
        self.integrator.set_up(&setup);
        let channels = if frame.texture().is_some() { 3 } else { self.integrator.channels() };
        let [width, height] = frame.size().map(|side| side as usize);
        self.shares.clear(width * height, channels);
        self.near_ends.reserve(width * height);
        self.workers.resize_with(parallel::worker_count(), Worker::default);
        let columns = width.max(height);
        let gap = Worker::<I::Scratch>::most_between([width, height], widest);
        let queries = (2 * gap).min(width * height);
        let room = SliceRoom { frame, columns, queries, runs: most_runs(frame, columns), channels };
        for worker in &mut self.workers {
            worker.reserve(&room, gap);
            worker.sample.reserve(width * height, channels, self.slices.slices.capacity());
            self.integrator.reserve(&room, &mut worker.scratch);
        }
        channels
    }

    /// Reads the extrema of the map's tiles, once a frame, unless so few slices read the map that they are not worth it.
    fn read_tiles(&mut self, frame: &Frame<'_>) {
        /// Texels that are read for their extrema in the time of one that a row reads on its own. A quarter of it made rooms
        /// slower by a fifth.
        const TEXELS_A_READ: usize = 16;
        let tiles = self.integrator.tiles();
        if tiles == TileUse::Never || self.tiles.are_read() {
            return;
        }
        let sizes =
            || frame.shadow().layers().map(|layer| layer.projection().size().map(|side| side as usize));
        let (texels, side) = sizes().fold((0, 0), |(area, side), [w, h]| (area + w * h, side.max(w).max(h)));
        let are_worthwhile = TEXELS_A_READ * self.slices.slices.len() * side >= texels;
        if are_worthwhile || tiles == TileUse::Always {
            self.tiles.rebuild(self.simd, frame.shadow());
        }
    }

    /// Integrates all slices, after their spacing was measured where that is asked for; returns it.
    fn integrate(
        &mut self,
        frame: &Frame<'_>,
        epipole: Epipole,
        ([mut spacing, widest], channels): ([f64; 2], usize),
        settings: &SliceSettings,
        (stats, clock): (&mut RenderStats, &mut StageClock),
    ) -> f64 {
        let mut settings = *settings;
        let mut is_exact = false;
        if let Some(target) = settings.target {
            let light = Unoccluded::new(frame);
            let notes_steps = Some(target.error);
            let mut measuring = Measuring { light: &light, cuts_alone: false, notes_steps };
            let mut search =
                SpacingSearch::new(spacing, [target.within[0], widest], target.confidence.beyond);
            let mut is_first = true;
            while search.goes_on() {
                let of_slices = (spacing, channels);
                let found = self.measure(frame, epipole, of_slices, &settings, (measuring, is_exact), target);
                if found.excess > 1.0
                    && measuring.notes_steps.is_some()
                    && self.cuts_rays(frame, found, target)
                {
                    // Measured anew, since not all that is missed there may lie beyond the cuts.
                    self.near_ends.find(frame);
                    measuring.notes_steps = None;
                    continue;
                }
                // In a dark picture errors of less count.
                let floor = settings.refinement.floor;
                settings.refinement.floor = floor.min(DARK_FLOOR * found.lit_share as f32).max(LEAST_FLOOR);
                if is_first && found.excess > 1.0 && self.integrator.leaves_texels_uncut() {
                    let measuring = Measuring { cuts_alone: true, ..measuring };
                    let cuts = self.measure(frame, epipole, of_slices, &settings, (measuring, false), target);
                    // What texels hide that are not cut stays, however close slices are.
                    is_exact = cuts.excess > MOST_OF_CUTS;
                }
                is_first = false;
                search.learn(found.excess);
                if search.spacing != spacing {
                    spacing = search.spacing;
                    self.lay(frame, &epipole, spacing);
                    self.read_tiles(frame);
                }
            }
            clock.lap(stats, "spacing");
        }
        self.run(frame, epipole, (spacing, channels), &settings, (None, is_exact));
        spacing
    }

    /// Whether it is worth it to cut rays before they end on steps of the map, by what was measured without it.
    fn cuts_rays(&self, frame: &Frame<'_>, found: Measured, target: ErrorTarget) -> bool {
        let [width, height] = frame.size().map(f64::from);
        let cut = if frame.light().position().is_some() { CUT_OF_LAMP } else { CUT_OF_SUN };
        let samples = self.workers.iter().map(|worker| &worker.sample);
        let without = measured(samples, target, false);
        let slices = self.slices.slices.len() as f64;
        // Closer slices cost more texels, not more queries.
        let finer = |excess: f64| excess.max(1.0).powf(1.0 / POWER);
        let saved = (finer(found.excess) - finer(without.excess)) * slices * SLICE;
        saved > cut * width * height
    }

    /// Measures a sample of gaps against a target.
    fn measure(
        &mut self,
        frame: &Frame<'_>,
        epipole: Epipole,
        of_slices: (f64, usize),
        settings: &SliceSettings,
        (measuring, is_exact): (Measuring<'_>, bool),
        target: ErrorTarget,
    ) -> Measured {
        self.workers.iter_mut().for_each(|worker| worker.sample.clear());
        let gaps = target.confidence.gaps / if measuring.cuts_alone { FEWER_GAPS_OF_CUTS } else { 1 };
        self.run(frame, epipole, of_slices, settings, (Some((measuring, gaps)), is_exact));
        measured(self.workers.iter().map(|worker| &worker.sample), target, true)
    }

    /// Fills all gaps, or measures a sample of them: what is measured, and how many gaps are enough.
    fn run(
        &mut self,
        frame: &Frame<'_>,
        epipole: Epipole,
        (spacing, channels): (f64, usize),
        settings: &SliceSettings,
        (measures, is_exact): (Option<(Measuring<'_>, usize)>, bool),
    ) {
        let longest = self.integrator.longest_ray().min(frame.max_distance()) as f32;
        let pass = SlicePass {
            scene: SliceScene { frame, epipole, tiles: &self.tiles, simd: self.simd },
            integrator: &self.integrator,
            slices: &self.slices.slices,
            shares: &self.shares,
            refinement: settings.refinement,
            resampling: settings.resampling,
            surfaces: Surfaces::new(
                settings.resampling,
                settings.shared_columns,
                spacing,
                &settings.refinement,
            ),
            measures: measures.map(|(measuring, _)| measuring),
            ends: self.near_ends.or_depth(frame),
            is_exact,
            column_stride: measures.map_or(1, |_| column_stride(spacing) as usize),
            channels,
            longest,
        };
        let fans = &self.slices.fans;
        let stride = measures.map_or(1, |(_, enough)| stride(self.slices.slices.len(), enough));
        let next = AtomicUsize::new(0);
        let (tasks, fan_pixels) = (&self.tasks, &self.fan_pixels);
        parallel::for_each_worker(&mut self.workers, |worker| {
            while let Some(&(fan, first)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                let end = (first + TASK).min(fans[fan].count - 1);
                if measures.is_some() {
                    for gap in (first..end).filter(|gap| gap % stride == stride / 2) {
                        pass.run(&fans[fan], &fan_pixels[fan], gap..gap + 1, worker);
                    }
                } else {
                    pass.run(&fans[fan], &fan_pixels[fan], first..end, worker);
                }
            }
        });
    }

    fn memory_bytes(&self) -> u64 {
        let slices = self.slices.slices.capacity() * size_of::<Slice>();
        let pixels = self.fan_pixels.iter().map(|fan| fan.ranges.capacity() * size_of::<[i32; 2]>());
        let workers =
            self.workers.iter().map(|worker| worker.memory_bytes() + I::scratch_bytes(&worker.scratch));
        let tasks = self.tasks.capacity() * size_of::<(usize, usize)>();
        let tables = self.integrator.memory_bytes() + self.tiles.memory_bytes() + self.shares.memory_bytes();
        let tables = tables + self.near_ends.memory_bytes();
        (slices + tasks + tables + pixels.chain(workers).sum::<usize>()) as u64
    }
}

/// Most runs of a slice's row.
fn most_runs(frame: &Frame<'_>, columns: usize) -> usize {
    let sides = || frame.shadow().layers().map(|layer| layer.projection().size());
    let side = sides().flatten().max().unwrap_or(0) as usize;
    // Every texel column has two cells. A half-plane of a lamp crosses four faces at the most; a sun's may cross every
    // cascade. Around the epipole cells are split.
    let layers = sides().count();
    let lines = if frame.light().position().is_some() { 4 } else { layers.max(4) };
    2 * lines * side + 8 * columns + 64
}
