//! Mode `sampling`: epipolar sampling (Engelhardt and Dachsbacher 2010; Yusov 2012, Section 5).
//!
//! ```text
//! line_samples   a slice's samples, the edges between them, which are marched   Sections 6.1, 6.2
//! pass           marches through the slice's tree, interpolation                Sections 6.4, 6.5
//! line_columns   samples by the columns of their fan                            Section 6.6
//! gap            pixels between two slices, by bilateral weights                Section 6.6
//! pass           pixels that no sample serves, by their own rays                Section 6.7
//! pixel_lights   which rays of a spot see light at all
//! upscale        from one pixel in 2×2 or 4×4 to all of them                    Section 6.8
//! ```
//!
//! Slices are worked off fan by fan, side by side on all threads; each pixel is written by the one task that owns its gap, so
//! that the number of threads does not change a bit. What pixels get is a share of their own unoccluded light, with their own
//! phase function and depth, as the last step ([`Resolve`]).
//!
//! Departures from the paper: slices are laid by the sinh distribution (Baran et al. 2010, Section 8), not evenly along the image's
//! border; pixels are corrected by their own exact row, not by a coarser march; and what is interpolated between samples does not
//! depend on the length of rays ([`LineSamples`]).

mod bilateral;
mod gap;
mod lattice;
mod line_columns;
mod line_samples;
mod pass;
mod pixel_lights;
mod upscale;

use std::sync::atomic::{AtomicUsize, Ordering};

use epipolar::driver::{FrameLight, Resolve, Shares, SliceScene, channels_of};
use epipolar::geometry::{Epipole, FanPixels, Slice, SliceSet};
use epipolar::rows::MinMaxTiles;
use glam::DVec2;
use scatter_core::{Frame, Level, RenderStats, ScatterImage, SceneFacts, StageClock, at_level, parallel};

use crate::options::Options;
use lattice::Lattice;
use pass::{SamplingPass, Worker};
use pixel_lights::PixelLights;
use upscale::UpscalePass;

pub use line_samples::{Flags, LineSamples, SampleSettings};

/// Gaps of a task. More keep threads idle at the end of a frame, fewer march more slices twice.
const TASK: usize = 16;

/// Fewest slices that every fan of any frame can share: two of each.
const FEWEST_SLICES: usize = 24;

/// Distance of slices \[pixels\] that makes at most `count` of them, wherever the epipole is: even exits along the border
/// of an image.
pub fn spacing_of(size: [u32; 2], count: u32) -> f64 {
    2.0 * (f64::from(size[0]) + f64::from(size[1])) / f64::from(count)
}

/// Epipolar sampling with its buffers, which serve the next frame.
#[derive(Debug)]
pub struct Sampling {
    simd: Level,
    slices: SliceSet,
    fan_pixels: Vec<FanPixels>,
    /// Fan and first gap of each task.
    tasks: Vec<(usize, usize)>,
    tiles: MinMaxTiles,
    shares: Shares,
    lights: PixelLights,
    workers: Vec<Worker>,
}

impl Sampling {
    /// With the instructions of a level.
    pub fn new(simd: Level) -> Self {
        Self {
            simd,
            slices: SliceSet::default(),
            fan_pixels: Vec::new(),
            tasks: Vec::new(),
            tiles: MinMaxTiles::default(),
            shares: Shares::default(),
            lights: PixelLights::default(),
            workers: Vec::new(),
        }
    }

    /// Renders a frame that a perspective camera sees.
    pub fn render(&mut self, frame: &Frame<'_>, options: &Options, out: &mut ScatterImage) -> RenderStats {
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let epipole = Epipole::new(frame.camera(), frame.light());
        // A texture colours light that nothing shadows, too.
        let integrates = facts.casts_shadow || facts.textured;
        let channels = if facts.textured { 3 } else { channels_of(frame.light(), frame.medium()) };
        if integrates {
            self.lay(frame, &epipole, options);
            let [width, height] = frame.size().map(|side| side as usize);
            self.shares.clear(width * height, channels);
            self.lights.rebuild(frame, self.simd);
            self.workers.resize_with(parallel::worker_count(), Worker::default);
        }
        clock.lap(&mut stats, "set-up");

        if integrates {
            self.tiles.rebuild(self.simd, frame.shadow());
        }
        clock.lap(&mut stats, "extrema");

        if integrates {
            let light = FrameLight::new(frame);
            let mut workers = std::mem::take(&mut self.workers);
            let pass = SamplingPass {
                scene: SliceScene { frame, epipole, tiles: &self.tiles, simd: self.simd },
                light: &light,
                slices: &self.slices.slices,
                shares: &self.shares,
                lights: self.lights.all(),
                options,
                lattice: Lattice::new(options.downscale.factor()),
                channels,
            };
            workers.iter_mut().for_each(|worker| worker.reserve(&pass));
            self.run(&pass, &mut workers);
            clock.lap(&mut stats, "slices");
            if options.downscale.factor() > 1 {
                upscale(&pass, &mut workers);
                clock.lap(&mut stats, "upscale");
            }
            report(&workers, &mut stats);
            self.workers = workers;
        }

        let walked =
            Resolve::new(frame, integrates.then_some((&self.shares, channels)), self.simd).image(out);
        clock.lap(&mut stats, "resolve");
        // Pixels as good as on the epipole lie on no slice: they are walked through the map.
        let on_no_slice = if integrates { pixels_too_near(&epipole, frame.size()) } else { 0 };
        stats.counts.push("pixels without a source", walked - on_no_slice.min(walked));
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        stats
    }

    /// Distributes slices, finds the pixels of their fans, and cuts the gaps into tasks.
    fn lay(&mut self, frame: &Frame<'_>, epipole: &Epipole, options: &Options) {
        let count = options.slices as usize;
        self.slices.distribute_count(epipole, frame.size(), count);
        self.tasks.clear();
        self.tasks.reserve(count / TASK + FEWEST_SLICES);
        self.fan_pixels.resize_with(FEWEST_SLICES / 2, FanPixels::default);
        // The next frame may have other fans.
        let columns = frame.size()[0].max(frame.size()[1]) as usize;
        for pixels in &mut self.fan_pixels {
            pixels.ranges.clear();
            pixels.ranges.reserve(columns);
        }
        for (index, fan) in self.slices.fans.iter().enumerate() {
            self.fan_pixels[index].find(epipole, frame.size(), fan, &self.slices.slices);
            self.tasks.extend((0..fan.count - 1).step_by(TASK).map(|first| (index, first)));
        }
    }

    /// Fills all gaps.
    fn run(&self, pass: &SamplingPass<'_>, workers: &mut [Worker]) {
        let next = AtomicUsize::new(0);
        let (tasks, fans, fan_pixels) = (&self.tasks, &self.slices.fans, &self.fan_pixels);
        parallel::for_each_worker(workers, |worker| {
            while let Some(&(fan, first)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                let end = (first + TASK).min(fans[fan].count - 1);
                pass.run(&fans[fan], &fan_pixels[fan], first..end, worker);
            }
        });
    }

    fn memory_bytes(&self) -> u64 {
        let slices = self.slices.slices.capacity() * size_of::<Slice>();
        let pixels = self.fan_pixels.iter().map(|fan| fan.ranges.capacity() * size_of::<[i32; 2]>());
        let workers = self.workers.iter().map(Worker::memory_bytes);
        let tasks = self.tasks.capacity() * size_of::<(usize, usize)>();
        let rest = self.tiles.memory_bytes() + self.shares.memory_bytes() + self.lights.memory_bytes();
        (slices + tasks + rest + pixels.chain(workers).sum::<usize>()) as u64
    }
}

/// Interpolates the pixels between those of the lattice, rows on all threads.
fn upscale(pass: &SamplingPass<'_>, workers: &mut [Worker]) {
    let frame = pass.scene.frame;
    let rows = UpscalePass {
        frame,
        shares: pass.shares,
        lights: pass.lights,
        lattice: pass.lattice,
        channels: pass.channels,
        threshold: pass.options.refinement,
        correction: pass.options.correction,
    };
    let height = frame.size()[1];
    let next = AtomicUsize::new(0);
    parallel::for_each_worker(workers, |worker| {
        loop {
            let y = next.fetch_add(1, Ordering::Relaxed) as u32;
            if y >= height {
                break;
            }
            at_level!(pass.scene.simd, rows.row(y, &mut worker.left));
            pass.correct_pixels(worker);
        }
    });
}

/// How many pixels are too near to the epipole for slices.
fn pixels_too_near(epipole: &Epipole, size: [u32; 2]) -> u64 {
    if !(epipole.image.z > 0.0) {
        return 0;
    }
    let centre = epipole.image.truncate() / epipole.image.z - DVec2::splat(0.5);
    let reach = epipole.too_near;
    // A pixel more on either side, since `is_too_near` decides.
    let within = |axis: usize| {
        let clamped = |at: f64| at.clamp(0.0, f64::from(size[axis])) as u32;
        clamped((centre[axis] - reach).floor() - 1.0)..clamped((centre[axis] + reach).ceil() + 2.0)
    };
    let is_too_near = |x: u32, y: u32| {
        epipole.is_too_near(epipole.towards(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)))
    };
    within(1).flat_map(|y| within(0).map(move |x| (x, y))).filter(|&(x, y)| is_too_near(x, y)).count() as u64
}

fn report(workers: &[Worker], stats: &mut RenderStats) {
    let mut push = |name: &'static str, count: fn(&Worker) -> u64| {
        stats.counts.push(name, workers.iter().map(count).sum::<u64>());
    };
    push("slices", |worker| worker.counts.slices);
    push("samples", |worker| worker.counts.samples);
    push("marched samples", |worker| worker.counts.marched);
    push("corrected pixels", |worker| worker.counts.corrected);
    push("nodes", |worker| worker.march().counts.looks.nodes);
    push("texel columns", |worker| worker.march().counts.looks.columns);
    push("texel columns read", |worker| worker.march().counts.columns_read);
    push("lit runs", |worker| worker.march().sums.integrated);
}
