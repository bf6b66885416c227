//! The image pass: faces of the mesh to crossings of pixels' rays, crossings to lit intervals, intervals to radiance.
//!
//! ```text
//! ray_fan      a pixel's ray in a map's space, and what of it lies inside
//! block_rays   those of 8×8 pixels, in a parameter in which borders and depths are crossed in order
//! ray_group    sixteen of them side by side
//! beam         what bounds the rays of a block or of a tile: what no pixel can see is left out
//! candidates   which patches the rays of a tile, and then of a block, may cross
//! coverage     which rays cross which faces, sixteen rays at a time
//! facets       the same of an interpolated surface's triangles
//! surface_walk one ray through it in f64, where numbers of f32 do not reach
//! crossings    a pixel's crossings in order ──▶ its lit intervals
//! integrate    lit intervals ──▶ sums of pixels        tile      all of it for a part of the image
//! ```

mod beam;
mod block_rays;
mod candidates;
mod coverage;
mod crossings;
mod facets;
mod integrate;
mod ray_fan;
mod ray_group;
pub mod surface_walk;
mod tile;

use std::sync::{Mutex, PoisonError};

use scatter_core::{
    Frame, Level, MapFan, RayFan, RenderStats, ScatterImage, SceneFacts, StageClock, at_level, parallel,
};

use crate::options::{Options, Surface};
use crate::volume::{HeightField, SteppedVolume, Tessellation, Tolerance};
use integrate::Integrand;
use tile::{Meshes, Most, Scene, TILE, TileWork};

/// Meshes and image pass with their buffers, which serve the next frame.
#[derive(Debug)]
pub struct Raster {
    simd: Level,
    volumes: Vec<SteppedVolume>,
    fields: Vec<HeightField>,
    fans: Vec<MapFan>,
    workers: Vec<TileWork>,
}

impl Raster {
    /// With the instructions of a level.
    pub fn new(simd: Level) -> Self {
        Self { simd, volumes: Vec::new(), fields: Vec::new(), fans: Vec::new(), workers: Vec::new() }
    }

    /// Renders a frame, which has no texture.
    pub fn render(&mut self, frame: &Frame<'_>, options: &Options, out: &mut ScatterImage) -> RenderStats {
        let simd = self.simd;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let fan = RayFan::new(frame.camera());
        let layer_count = if facts.casts_shadow { frame.shadow().layer_count() } else { 0 };
        clock.lap(&mut stats, "facts");

        let tessellation = tessellation_of(frame, options);
        let layers = || frame.shadow().layers().take(layer_count);
        self.fans.clear();
        self.fans.extend(layers().map(|layer| fan.in_map(layer.projection())));
        let meshes = match options.surface {
            Surface::Stepped => {
                self.volumes.resize_with(layer_count.max(self.volumes.len()), SteppedVolume::default);
                for (volume, layer) in self.volumes.iter_mut().zip(layers()) {
                    volume.build(&layer, tessellation);
                }
                Meshes::Stepped(&self.volumes[..layer_count])
            }
            Surface::Interpolated => {
                self.fields.resize_with(layer_count.max(self.fields.len()), HeightField::default);
                for (field, layer) in self.fields.iter_mut().zip(layers()) {
                    field.build(&layer, tessellation);
                }
                Meshes::Interpolated(&self.fields[..layer_count])
            }
        };
        clock.lap(&mut stats, "mesh");

        self.workers.resize_with(parallel::worker_count(), TileWork::default);
        self.workers.iter_mut().for_each(TileWork::start_frame);
        let scene = Scene {
            frame,
            fan,
            fans: &self.fans,
            meshes,
            integrand: Integrand::of(frame, options.accumulate),
        };
        let width = frame.size()[0];
        let band_pixels = (width * TILE) as usize;
        let (inscattered, transmittance) = out.overwritten(frame.size());
        let bands =
            inscattered.chunks_mut(band_pixels).zip(transmittance.chunks_mut(band_pixels)).enumerate();
        let bands = Mutex::new(bands);
        parallel::for_each_worker(&mut self.workers, |worker| {
            loop {
                let band = bands.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some((band, (inscattered, transmittance))) = band else { return };
                for x in (0..width).step_by(TILE as usize) {
                    let origin = [x, band as u32 * TILE];
                    at_level!(simd, vectors => worker.render(vectors, &scene, origin, (inscattered, transmittance)));
                }
            }
        });
        let none = Most::default();
        let most = self.workers.iter().fold(none, |most, worker| most.joined(&worker.most));
        self.workers.iter_mut().for_each(|worker| worker.end_frame(&most));
        clock.lap(&mut stats, "image");

        let count = |of: fn(&TileWork) -> u64| self.workers.iter().map(of).sum();
        let triangles: u64 = match meshes {
            Meshes::Stepped(volumes) => volumes.iter().map(|volume| 2 * volume.face_count()).sum(),
            // Walls aside.
            Meshes::Interpolated(fields) => fields.iter().map(HeightField::triangle_count).sum(),
        };
        stats.counts.push("rays", frame.size().map(u64::from).iter().product());
        stats.counts.push("triangles", triangles);
        stats.counts.push("patches", count(|work| work.counts.patches));
        stats.counts.push("faces", count(|work| work.counts.faces));
        stats.counts.push("crossings", count(|work| work.counts.crossings));
        stats.counts.push("lit runs", count(|work| work.counts.lit_runs));
        stats.counts.push("sign violations", count(|work| work.counts.violations));
        stats.counts.push("pixels in f64", count(|work| work.counts.walked));
        stats.push_modelled(&facts);
        stats.memory_bytes = self.memory_bytes();
        stats
    }

    fn memory_bytes(&self) -> u64 {
        let fans = self.fans.capacity() * size_of::<MapFan>();
        let volumes: u64 = self.volumes.iter().map(SteppedVolume::memory_bytes).sum::<u64>()
            + self.fields.iter().map(HeightField::memory_bytes).sum::<u64>();
        fans as u64 + volumes + self.workers.iter().map(TileWork::memory_bytes).sum::<u64>()
    }
}

/// How the maps of a frame become meshes.
pub fn tessellation_of(frame: &Frame<'_>, options: &Options) -> Tessellation {
    if !options.is_adaptive() {
        return Tessellation::Static;
    }
    let threshold = options.threshold;
    if threshold <= 0.0 {
        return Tessellation::Adaptive(Tolerance::EXACT);
    }
    if frame.light().position().is_some() {
        return Tessellation::Adaptive(Tolerance { absolute: 0.0, relative: threshold });
    }
    // The longest ray; an endless one has no share.
    let depths = frame.depth().texels().iter().copied();
    let longest = depths.fold(0.0f32, f32::max).min(frame.max_distance() as f32);
    let absolute = if longest.is_finite() { threshold * longest } else { 0.0 };
    Tessellation::Adaptive(Tolerance { absolute, relative: 0.0 })
}
