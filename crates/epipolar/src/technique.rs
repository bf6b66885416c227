//! The technique: epipole → slices → bands and factors → one pass a slice → pixels.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Level, LightKind, Limits, MapKind, PhaseKind,
    RenderError, RenderStats, ScatterImage, SceneFacts, StageClock, VolumetricShadow, Window, at_level,
    parallel, simd_level,
};

use crate::answer::{Answerer, Manner};
use crate::bands::Bands;
use crate::epipole::Epipole;
use crate::extrema::Extrema;
use crate::fan_pixels::FanPixels;
use crate::integrand::{Integrand, Precision};
use crate::options::{Around, ID, Options};
use crate::probe::{Aim, Probe, SpacingSearch, stride};
use crate::resolve::Resolve;
use crate::row::Cells;
use crate::shares::Shares;
use crate::slice_pass::{SlicePass, Worker};
use crate::slice_plane::STEEPEST;
use crate::slices::{Slice, SliceSet};

/// Half angle of the ring around the epipole that the paper marches (Section 6: "about two degrees").
const RING_DEGREES: f64 = 2.0;

/// Slices a radian, at least, where the spacing is measured: fewer, and the sample has no gaps.
const FEWEST_SLICES: f64 = 100.0;

/// Largest ratio of 1/sin β within a band. Wider bands need more terms, narrower ones more sweeps around the epipole.
const WIDEST_BAND: f64 = 2.0;

/// Error of a lamp's factors beyond which pixels are walked: well below a film's. Only backward lobes over long rays in thin
/// fog miss it.
const WORST_LAMP_ERROR: f64 = 0.004;

/// Largest |g| of a medium around a lamp: a thinner lobe is missed by the factors' tables.
const MOST_LAMP_G: f64 = 0.99;

/// View rays that meet in an eye, and maps whose light rays come in one order: no orthographic camera, no cascades, no
/// faces that may overlap. Texel indices are u32.
pub(crate) const CAPABILITIES: Capabilities = Capabilities {
    lights: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    glass: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    maps: &[MapKind::Unshadowed, MapKind::Orthographic, MapKind::Perspective, MapKind::Cube],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: MOST_LAMP_G, cascades: 0, layer_texels: u32::MAX as u64 },
};

/// Gaps of a task. More keep threads idle at the end of a frame, fewer integrate more slices twice.
const TASK: usize = 32;

/// Baran's integrator, with its buffers.
#[derive(Debug)]
pub struct Epipolar {
    options: Options,
    simd: Level,
    slices: SliceSet,
    fan_pixels: Vec<FanPixels>,
    tasks: Vec<(usize, usize)>,
    integrand: Integrand,
    extrema: Extrema,
    shares: Shares,
    workers: Vec<Worker>,
}

impl Epipolar {
    /// An integrator for the CPU that it runs on.
    pub fn new(options: Options) -> Self {
        Self {
            options,
            simd: simd_level(),
            slices: SliceSet::default(),
            fan_pixels: Vec::new(),
            tasks: Vec::new(),
            integrand: Integrand::default(),
            extrema: Extrema::default(),
            shares: Shares::default(),
            workers: Vec::new(),
        }
    }
}

impl Epipolar {
    /// Distributes slices, finds the pixels of their fans, and cuts the gaps into tasks.
    fn lay_slices(&mut self, frame: &Frame<'_>, epipole: &Epipole, spacing: f64) {
        self.slices.distribute(epipole, frame.size(), spacing);
        self.fan_pixels.resize_with(self.slices.fans.len().max(self.fan_pixels.len()), FanPixels::default);
        self.tasks.clear();
        for (index, fan) in self.slices.fans.iter().enumerate() {
            self.fan_pixels[index].find(epipole, frame.size(), fan, &self.slices.slices);
            self.tasks.extend((0..fan.count - 1).step_by(TASK).map(|first| (index, first)));
        }
    }

    /// Fills all gaps, or measures a sample of them.
    fn run_slices(
        &mut self,
        frame: &Frame<'_>,
        epipole: Epipole,
        channels: usize,
        ring: f64,
        probe: Option<(&Probe, Aim)>,
    ) {
        let Options { integrator, split_over, cells, resampling, refinement, .. } = self.options;
        let manner = Manner { integrator, split_over, cells, ring: ring as f32, level: self.simd };
        let pass = SlicePass {
            frame,
            answerer: Answerer::new(frame, epipole, &self.integrand, &self.extrema, manner, channels),
            slices: &self.slices.slices,
            shares: &self.shares,
            refinement,
            resampling,
            probe,
            level: self.simd,
        };
        let fans = &self.slices.fans;
        let stride = stride(self.slices.slices.len());
        let next = AtomicUsize::new(0);
        let (tasks, fan_pixels) = (&self.tasks, &self.fan_pixels);
        parallel::for_each_worker(&mut self.workers, |scratch| {
            while let Some(&(fan, first)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                let end = (first + TASK).min(fans[fan].count - 1);
                if probe.is_some() {
                    for gap in (first..end).filter(|gap| gap % stride == stride / 2) {
                        pass.run(&fans[fan], &fan_pixels[fan], gap..gap + 1, scratch);
                    }
                } else {
                    pass.run(&fans[fan], &fan_pixels[fan], first..end, scratch);
                }
            }
        });
    }

    fn memory_bytes(&self) -> u64 {
        let slices = self.slices.slices.capacity() * size_of::<Slice>();
        let pixels = self.fan_pixels.iter().map(|fan| fan.ranges.capacity() * size_of::<[i32; 2]>());
        let workers = self.workers.iter().map(Worker::memory_bytes);
        let tasks = self.tasks.capacity() * size_of::<(usize, usize)>();
        let tables = self.integrand.memory_bytes() + self.extrema.memory_bytes() + self.shares.memory_bytes();
        (slices + tasks + tables + pixels.chain(workers).sum::<usize>()) as u64
    }
}

impl VolumetricShadow for Epipolar {
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
        let [width, height] = frame.size();
        let pixel_count = width as usize * height as usize;
        let camera = frame.camera();
        let epipole = Epipole::new(camera, frame.light());
        // Glass colours light that nothing shadows, too.
        let facts = SceneFacts::of(frame);
        let shadowed = facts.casts_shadow || facts.textured;
        // Pixels a radian in the middle of the image, along the coarser axis.
        let Window { left, right, bottom, top } = camera.window();
        let per_radian =
            (f64::from(width) / (right - left).abs()).min(f64::from(height) / (top - bottom).abs());
        // A measured spacing needs no such guess.
        let fewest = if self.options.aim.is_some() { FEWEST_SLICES } else { self.options.fewest_slices };
        let widest = per_radian / fewest;
        let mut spacing = self.options.spacing.min(widest);
        // Room for what the next frame may need, however its spacing turns out.
        let finest = self.options.aim.map_or(spacing, |aim| aim.finest.min(spacing));
        let most = self.slices.reserve(frame.size(), finest);
        self.tasks.reserve((most / TASK + 16).saturating_sub(self.tasks.len()));
        self.lay_slices(frame, &epipole, spacing);
        let ring = match self.options.around {
            Around::Bands => 0.0,
            Around::Ring => RING_DEGREES.to_radians().sin(),
        };
        let steepest = if ring > 0.0 { 1.0 / ring } else { STEEPEST };
        let bands = Bands::cover(camera, &epipole, &self.slices, WIDEST_BAND, steepest);
        let precision = Precision {
            factorisation: self.options.factorisation,
            rank: self.options.rank,
            error: self.options.factor_error,
        };
        self.integrand.rebuild(frame, bands, facts.longest_ray, precision);
        let channels = if frame.texture().is_some() { 3 } else { self.integrand.channels() };
        self.shares.clear(pixel_count, channels);
        self.workers.resize_with(parallel::worker_count(), Worker::default);
        let sides = frame.shadow().layers().flat_map(|layer| layer.projection().size());
        let side = sides.max().unwrap_or(0) as usize;
        for worker in &mut self.workers {
            worker.reserve(frame, side, spacing, &self.integrand, channels);
        }
        clock.lap(&mut stats, "set-up");
        // Factors that miss their error by far are not used: every pixel is walked instead.
        let trusted = self.integrand.lamp_error() <= self.options.factor_error.max(WORST_LAMP_ERROR);
        if shadowed && trusted && self.options.cells == Cells::Exact {
            self.extrema.rebuild(self.simd, frame.shadow());
        }
        clock.lap(&mut stats, "extrema");

        if shadowed && trusted {
            if let Some(aim) = self.options.aim {
                let mut search = SpacingSearch::new(spacing, aim.finest);
                while search.goes_on() {
                    let probe = Probe::default();
                    self.run_slices(frame, epipole, channels, ring, Some((&probe, aim)));
                    search.learn(probe.excess(aim));
                    if search.spacing != spacing {
                        spacing = search.spacing;
                        self.lay_slices(frame, &epipole, spacing);
                    }
                }
                clock.lap(&mut stats, "probe");
            }
            self.run_slices(frame, epipole, channels, ring, None);
        }
        clock.lap(&mut stats, "slices");

        let (inscattered, transmittance) = out.overwritten(frame.size());
        let resolve = Resolve::new(frame, shadowed.then_some((&self.shares, channels)), self.simd);
        let walked = AtomicU64::new(0);
        let simd = self.simd;
        parallel::for_each_row_of_both(
            (inscattered, transmittance),
            width as usize,
            |y, inscattered, transmittance| {
                let count = at_level!(simd, resolve.row(y as u32, inscattered, transmittance));
                walked.fetch_add(count, Ordering::Relaxed);
            },
        );
        clock.lap(&mut stats, "resolve");
        let sum = |count: fn(&Worker) -> u64| self.workers.iter().map(count).sum::<u64>();
        stats.counts.push("slices", sum(|worker| worker.counts().slices));
        stats.counts.push("spacing in 1/64 pixel", (64.0 * spacing).round() as u64);
        stats.counts.push("bands", self.integrand.band_count() as u64);
        stats.counts.push("rank", self.integrand.rank() as u64);
        stats.counts.push("texel columns", sum(|worker| worker.counts().texels));
        stats.counts.push("runs", sum(|worker| worker.counts().runs));
        stats.counts.push("queries", sum(|worker| worker.counts().queries));
        stats.counts.push("walked pixels", walked.into_inner());
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        Ok(stats)
    }
}
