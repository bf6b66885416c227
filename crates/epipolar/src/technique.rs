//! The technique: epipole → slices → bands and factors → one pass a slice → pixels.

use scatter_core::{
    Frame, Light, Projection, RenderError, RenderStats, ScatterImage, ShadowMap, StageClock, Unsupported,
    VolumetricShadow, walked_radiance,
};

use crate::bands::Bands;
use crate::epipole::Epipole;
use crate::factor::Factors;
use crate::fan_pixels::FanPixels;
use crate::options::Options;
use crate::planes::Planes;
use crate::resolve::SunLight;
use crate::simd_level::{self, Level, at_level};
use crate::slice_pass::{SlicePass, SliceScratch};
use crate::slices::SliceSet;

/// The id of [`Epipolar`].
pub const ID: &str = "epipolar";

/// Where rays end for the sums: e⁻¹⁷ = 4e-8 of the light is left. Larger values spend factors on nothing.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// Slices of a task. More keep threads idle at the end of a frame, fewer compute more borders twice.
const TASK: usize = 32;

/// Baran's integrator, with its buffers.
#[derive(Debug)]
pub struct Epipolar {
    options: Options,
    level: Level,
    slices: SliceSet,
    fan_pixels: Vec<FanPixels>,
    tasks: Vec<(usize, usize)>,
    factors: Vec<Factors>,
    lengths: Vec<f64>,
    planes: Planes,
    workers: Vec<SliceScratch>,
}

impl Epipolar {
    /// An integrator for the CPU that it runs on.
    pub fn new(options: Options) -> Self {
        Self {
            options,
            level: simd_level::chosen(),
            slices: SliceSet::default(),
            fan_pixels: Vec::new(),
            tasks: Vec::new(),
            factors: Vec::new(),
            lengths: Vec::new(),
            planes: Planes::default(),
            workers: Vec::new(),
        }
    }
}

impl VolumetricShadow for Epipolar {
    fn id(&self) -> &'static str {
        ID
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        let unsupported = |reason| Err(Unsupported { reason });
        if frame.camera().projection() == Projection::Orthographic {
            return unsupported("an orthographic camera: its view rays do not meet in an eye");
        }
        match frame.shadow() {
            ShadowMap::Unshadowed | ShadowMap::Orthographic(_) => Ok(()),
            _ => unsupported("cascades"),
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let [width, height] = frame.size();
        let pixel_count = width as usize * height as usize;
        let camera = frame.camera();
        let epipole = Epipole::new(camera, frame.light());
        self.slices.distribute(&epipole, frame.size(), self.options.spacing);
        self.fan_pixels.resize_with(self.slices.fans.len().max(self.fan_pixels.len()), FanPixels::default);
        self.tasks.clear();
        for (index, fan) in self.slices.fans.iter().enumerate() {
            self.fan_pixels[index].find(&epipole, frame.size(), fan, &self.slices.slices);
            self.tasks.extend((0..fan.count).step_by(TASK).map(|first| (index, first)));
        }
        let bands = Bands::cover(camera, &epipole, &self.slices, 2.0);
        let longest = frame.depth().texels().iter().fold(0.0f32, |a, &b| a.max(b));
        let longest = f64::from(longest).min(frame.max_distance());
        let sigma_t = frame.medium().sigma_t();
        let channels = if frame.medium().is_grey() { 1 } else { 3 };
        self.lengths.clear();
        self.factors.resize_with(channels, Factors::default);
        for channel in 0..channels {
            let length = longest.min(NEGLIGIBLE_OPTICAL_DEPTH / sigma_t[channel]).min(1e30).max(1e-30);
            self.lengths.push(length);
            let depth = sigma_t[channel] * length;
            let rank = match self.options.rank {
                Some(rank) => rank as usize,
                None => Factors::rank_for(self.options.factor_error, depth, bands.ratio).unwrap_or(8),
            };
            self.factors[channel].rebuild(self.options.factorisation, rank, depth, bands.ratio);
        }
        let lanes = self.factors.iter().map(Factors::lanes).max().unwrap_or(1);
        self.planes.resize(pixel_count, channels);
        let workers = worker_count();
        self.workers.resize_with(workers, SliceScratch::default);
        let side = frame.shadow().layers().next().map_or(0, |layer| {
            let [w, h] = layer.projection().size();
            w.max(h) as usize
        });
        for worker in &mut self.workers {
            worker.reserve(frame.size(), side, self.options.spacing, lanes);
            worker.counts = Default::default();
        }
        clock.lap(&mut stats, "set-up");

        if let Some(layer) = frame.shadow().layers().next() {
            let pass = SlicePass {
                frame,
                camera,
                epipole,
                slices: &self.slices,
                bands,
                factors: &self.factors,
                lengths: &self.lengths,
                layer,
                integrator: self.options.integrator,
                level: self.level,
                planes: &self.planes,
            };
            let next = std::sync::atomic::AtomicUsize::new(0);
            let (tasks, fan_pixels) = (&self.tasks, &self.fan_pixels);
            for_each_worker(&mut self.workers, |scratch| {
                while let Some(&(fan, first)) =
                    tasks.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed))
                {
                    let end = (first + TASK).min(pass.slices.fans[fan].count);
                    pass.run(&pass.slices.fans[fan], &fan_pixels[fan], first..end, scratch);
                }
            });
        }
        clock.lap(&mut stats, "slices");

        out.resize(frame.size());
        let (inscattered, transmittance) = out.pixels_mut();
        if let Light::Directional(sun) = frame.light() {
            let light = SunLight::new(frame, sun);
            let depth = frame.depth().texels();
            let row = width as usize;
            let planes = &self.planes;
            let shadowed = frame.shadow().layers().next().is_some();
            let level = self.level;
            for_each_row(inscattered, transmittance, row, |y, inscattered, transmittance| {
                let mut shares = [[0.0f32; 3]; 64];
                // TODO-free: rows are cut so that shares stay on the stack.
                let first = y * row;
                let mut left = Vec::new();
                let mut all = vec![[1.0f32; 3]; row];
                let _ = &mut shares;
                if shadowed {
                    for x in 0..row {
                        for channel in 0..channels {
                            match planes.take(first + x, channel) {
                                Some(share) => all[x][channel] = share,
                                None => left.push(x),
                            }
                        }
                        if channels == 1 {
                            all[x] = [all[x][0]; 3];
                        }
                    }
                }
                at_level!(
                    level,
                    light.row(y as u32, &depth[first..first + row], &all, inscattered, transmittance)
                );
                for x in left {
                    inscattered[x] = walked_radiance(frame, x as u32, y as u32).as_vec3().to_array();
                }
            });
        }
        clock.lap(&mut stats, "resolve");
        let sum = |count: fn(&SliceScratch) -> u64| self.workers.iter().map(count).sum::<u64>();
        stats.counts.push("slices", self.slices.slices.len() as u64);
        stats.counts.push("bands", u64::from(bands.count));
        stats.counts.push("rank", self.factors.iter().map(|f| f.rank() as u64).max().unwrap_or(0));
        stats.counts.push("texel columns", sum(|worker| worker.counts.texels));
        stats.counts.push("runs", sum(|worker| worker.counts.runs));
        stats.counts.push("queries", sum(|worker| worker.counts.queries));
        Ok(stats)
    }
}

fn worker_count() -> usize {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    1
}

fn for_each_worker(workers: &mut [SliceScratch], work: impl Fn(&mut SliceScratch) + Sync) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        workers.par_iter_mut().with_max_len(1).for_each(|worker| work(worker));
    }
    #[cfg(not(feature = "rayon"))]
    workers.iter_mut().for_each(work);
}

fn for_each_row(
    a: &mut [[f32; 3]],
    b: &mut [[f32; 3]],
    width: usize,
    work: impl Fn(usize, &mut [[f32; 3]], &mut [[f32; 3]]) + Sync,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        a.par_chunks_mut(width)
            .zip(b.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (a, b))| work(y, a, b));
    }
    #[cfg(not(feature = "rayon"))]
    a.chunks_mut(width).zip(b.chunks_mut(width)).enumerate().for_each(|(y, (a, b))| work(y, a, b));
}
