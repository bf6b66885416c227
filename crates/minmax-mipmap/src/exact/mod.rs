//! Exact mode: every pixel's own ray through min/max mipmaps of the light's maps.
//!
//! ```text
//! layers      each map's MinMaxTree, coded for the depths that view rays have
//! ray_fan     sixteen rays in a map's space          slabs      what blocks of 8×8 rays tell at once
//! set_up      rays cut by the layers and the slabs ──▶ segments
//! packets     segments through the mipmap ──▶ lit runs, and blocks that must be looked at closely
//! texels      blocks texel by texel       ──▶ lit runs
//! integrate   lit runs ──▶ sums of pixels            glass      those behind stained glass
//! tile        all of it for a part of the image
//! descent     one ray in f64: the plain form, for what lanes of f32 cannot hold
//! ```

mod descent;
mod glass;
mod integrate;
mod lanes;
mod layers;
mod packets;
mod queues;
mod ray_fan;
mod segment;
mod set_up;
mod slabs;
mod texels;
mod tile;
mod tree_view;

use std::sync::{Mutex, PoisonError};

use scatter_core::{
    Frame, Level, RayFan, RenderStats, ScatterImage, SceneFacts, StageClock, at_level, parallel,
};

use glass::GlassBlocks;
use integrate::Integrand;
use layers::LayerTrees;
use set_up::LayerFan;
use tile::{Scene, TILE, TileWork};

/// Exact mode with its buffers, which serve the next frame.
#[derive(Debug)]
pub struct Exact {
    simd: Level,
    trees: LayerTrees,
    fans: Vec<LayerFan>,
    glass: GlassBlocks,
    workers: Vec<TileWork>,
}

impl Exact {
    /// With the instructions of a level.
    pub fn new(simd: Level) -> Self {
        Self {
            simd,
            trees: LayerTrees::default(),
            fans: Vec::new(),
            glass: GlassBlocks::default(),
            workers: Vec::new(),
        }
    }

    /// Renders a frame, whatever it has.
    pub fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> RenderStats {
        let simd = self.simd;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let fan = RayFan::new(frame.camera());
        clock.lap(&mut stats, "facts");

        self.fans.clear();
        if facts.casts_shadow {
            self.trees.build(simd, frame, &fan);
            let layers = frame.shadow().layers().enumerate();
            self.fans.extend(layers.map(|(index, layer)| LayerFan::new(&fan, &layer, &self.trees, index)));
        }
        clock.lap(&mut stats, "mipmaps");

        self.workers.resize_with(parallel::worker_count(), TileWork::default);
        self.workers.iter_mut().for_each(TileWork::start_frame);
        let integrand = Integrand::of(frame, &fan, &mut self.glass);
        let scene = Scene { frame, fan, layers: &self.fans, trees: &self.trees, integrand };
        let width = frame.size()[0];
        let band_pixels = (width * TILE[1]) as usize;
        let (inscattered, transmittance) = out.overwritten(frame.size());
        let bands =
            inscattered.chunks_mut(band_pixels).zip(transmittance.chunks_mut(band_pixels)).enumerate();
        let bands = Mutex::new(bands);
        parallel::for_each_worker(&mut self.workers, |worker| {
            loop {
                let band = bands.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some((band, (inscattered, transmittance))) = band else { return };
                for x in (0..width).step_by(TILE[0] as usize) {
                    let origin = [x, band as u32 * TILE[1]];
                    at_level!(simd, vectors => worker.render(vectors, &scene, origin, (inscattered, transmittance)));
                }
            }
        });
        clock.lap(&mut stats, "traversal");

        let count = |of: fn(&TileWork) -> u64| self.workers.iter().map(of).sum();
        stats.counts.push("rays", frame.size().map(u64::from).iter().product());
        stats.counts.push("segments", count(|work| work.segments));
        stats.counts.push("nodes", count(|work| work.looks.nodes));
        stats.counts.push("texels", count(|work| work.looks.texels));
        stats.counts.push("lit runs", count(|work| work.lit_runs));
        stats.counts.push("segments in f64", count(|work| work.leftovers));
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        stats
    }

    fn memory_bytes(&self) -> u64 {
        let fans = self.fans.capacity() * size_of::<LayerFan>();
        self.trees.memory_bytes()
            + self.glass.memory_bytes()
            + fans as u64
            + self.workers.iter().map(TileWork::memory_bytes).sum::<u64>()
    }
}
