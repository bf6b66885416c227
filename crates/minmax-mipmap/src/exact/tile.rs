//! A tile of the image: its rays to segments, segments to lit runs, runs to pixels.
//!
//! ```text
//!     cut the rays by the layers                 what no layer decides about is lit
//!     for each layer:
//!         packets until a list is full  ⟲  blocks texel by texel  ⟲  runs to sums
//!     what lanes cannot hold, in f64
//!     sums to pixels
//! ```
//!
//! All that a tile needs stays in the innermost caches, and no tile knows of another: threads change no bit.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use scatter_core::{
    Frame, Light, RayFan, RayLanes, SunIntegralF32, transmittances_of_pixels_f32, write_pixels,
};

use super::descent::{Looks, lit_stretches};
use super::integrate::{Integrand, TileSums};
use super::lanes::{Reals, real};
use super::layers::LayerTrees;
use super::packets::{PADDING, Packets};
use super::queues::{Blocks, Runs};
use super::ray_fan::{GROUP, LANES, stretches};
use super::set_up::{Found, GROUPS, LayerFan, numbers_in_tile};
use super::texels::{TexelView, look_closely};
use super::tree_view::TreeView;

/// Pixels of a tile: segments of one are about a hundred kilobytes. Smaller tiles end more often with lanes that idle.
pub const TILE: [u32; 2] = [64, 32];

/// Where packets enter the mipmap of a perspective map: 512×512 texels.
const START_LEVEL: i32 = 9;

/// Where they enter that of a parallel map, whose slabs have been looked at: 64×64 texels.
const START_LEVEL_OF_SLABS: i32 = 6;

/// What all tiles of a frame read.
pub struct Scene<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Its rays.
    pub fan: RayFan,
    /// Its layers, in order; none where nothing casts a shadow.
    pub layers: &'a [LayerFan],
    /// Their mipmaps.
    pub trees: &'a LayerTrees,
    /// What is added up.
    pub integrand: Integrand<'a>,
}

/// What a worker holds for the tile that it is at.
#[derive(Debug, Clone, Default)]
pub struct TileWork {
    found: Found,
    blocks: Blocks,
    /// The same, by how many texels they pass.
    sorted: Blocks,
    runs: Runs,
    sums: TileSums,
    /// What was looked at in all tiles so far.
    pub looks: Looks,
    /// Segments and lit runs of all tiles so far.
    pub segments: u64,
    /// Lit runs of all tiles so far.
    pub lit_runs: u64,
    /// Parts of rays that went the long way, in f64, of all tiles so far.
    pub leftovers: u64,
}

impl TileWork {
    /// Forgets what it counted.
    pub fn start_frame(&mut self) {
        self.looks = Looks::default();
        (self.segments, self.lit_runs, self.leftovers) = (0, 0, 0);
    }

    /// Renders the tile at `origin` into rows of the image's width, the first of which is the tile's first row.
    #[inline(always)]
    pub fn render<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<'_>,
        origin: [u32; 2],
        rows: (&mut [[f32; 3]], &mut [[f32; 3]]),
    ) {
        let [width, height] = scene.frame.size();
        let size = [(width - origin[0]).min(TILE[0]), (height - origin[1]).min(TILE[1])];
        // Whole tiles, whatever the image leaves of them: buffers of one size, and lanes that need no end.
        let pixels = (TILE[0] * TILE[1]) as usize;
        self.sums.clear(origin, TILE[0], pixels);
        if !scene.integrand.is_length() {
            let eye = scene.frame.camera().eye();
            let lamp = scene.frame.light().position().map(|lamp| lamp - eye);
            self.sums.lay_rays(scene.frame.camera(), lamp);
        }
        self.found.clear(scene.layers.len(), pixels);
        self.set_up(simd, scene, size);
        for index in 0..scene.layers.len() {
            self.traverse(simd, scene, index);
        }
        self.walk_leftovers(scene);
        self.shade(simd, scene, size, rows);
    }

    /// Cuts the tile's rays by the layers.
    #[inline(always)]
    fn set_up<S: Simd>(&mut self, simd: S, scene: &Scene<'_>, size: [u32; 2]) {
        let Self { found, sums, lit_runs, .. } = self;
        let (frame, limit) = (scene.frame, scene.frame.max_distance());
        let whole_intervals = scene.integrand.is_dear();
        let width = frame.size()[0] as usize;
        for y in (0..size[1]).step_by(GROUP[1] as usize * GROUPS) {
            for x in (0..size[0]).step_by(GROUP[0] as usize) {
                let place = [sums.origin[0] + x, sums.origin[1] + y];
                let mut ends = [[0.0; LANES]; GROUPS];
                for (group, ends) in ends.iter_mut().enumerate() {
                    let first_row = y + group as u32 * GROUP[1];
                    let stretch = stretches(&scene.fan, [place[0], sums.origin[1] + first_row]);
                    for row in 0..GROUP[1] {
                        let lanes = (row * GROUP[0]) as usize..((row + 1) * GROUP[0]) as usize;
                        let in_tile = ((first_row + row) * TILE[0] + x) as usize;
                        for (kept, value) in sums.stretch[in_tile..].iter_mut().zip(&stretch[lanes.clone()]) {
                            *kept = *value as f32;
                        }
                        if first_row + row < size[1] {
                            let at = (sums.origin[1] + first_row + row) as usize * width + place[0] as usize;
                            let count = (size[0] - x).min(GROUP[0]) as usize;
                            let depths = &frame.depth().texels()[at..][..count];
                            let ends = ends[lanes.clone()].iter_mut();
                            for ((end, depth), stretch) in ends.zip(depths).zip(&stretch[lanes]) {
                                *end = f64::from(*depth).min(limit) / stretch;
                            }
                        }
                    }
                }
                found.look(simd, (scene.layers, scene.trees), place, &ends, whole_intervals);
                for (group, ends) in ends.iter().enumerate() {
                    let pixels = numbers_in_tile(TILE[0], [x, y + group as u32 * GROUP[1]]);
                    found.cut(simd, scene.layers, group, &pixels, ends);
                    for [from, to] in &found.lit {
                        let (mut starts, mut lengths) = ([0.0f32; LANES], [0.0f32; LANES]);
                        for lane in 0..LANES {
                            let crosses = from[lane] < to[lane];
                            starts[lane] = if crosses { from[lane] as f32 } else { 0.0 };
                            lengths[lane] = if crosses { (to[lane] - from[lane]) as f32 } else { 0.0 };
                        }
                        *lit_runs += LANES as u64;
                        scene.integrand.add(simd, frame, &pixels, &starts, &lengths, LANES, sums);
                    }
                }
            }
        }
    }

    /// Takes the segments of a layer through its mipmap.
    #[inline(always)]
    fn traverse<S: Simd>(&mut self, simd: S, scene: &Scene<'_>, index: usize) {
        let Self { found, blocks, sorted, runs, sums, looks, segments: all_segments, lit_runs, .. } = self;
        let (Some(tree), Some(layer)) = (scene.trees.trees().get(index), scene.frame.shadow().layer(index))
        else {
            return;
        };
        let (segments, starts, bases) =
            (&mut found.segments[index], &found.starts[index], &found.bases[index]);
        let count = segments.len();
        if count == 0 {
            return;
        }
        *all_segments += count as u64;
        segments.extend_from_slice(&PADDING);
        let perspective = layer.projection().is_perspective();
        let start = if perspective { START_LEVEL } else { START_LEVEL_OF_SLABS };
        let (tree_view, texel_view) = (TreeView::new(tree), TexelView::new(&layer, tree.sides()));
        let mut packets = Packets::new(simd, start.min(tree_view.coarsest));
        loop {
            let through = packets.advance(simd, &tree_view, segments, count, (blocks, runs));
            blocks.sort_into(simd, sorted);
            let mut at = 0;
            loop {
                at = look_closely(simd, &texel_view, segments, sorted, at, runs, &mut looks.texels);
                *lit_runs += runs.len() as u64;
                scene.integrand.add_runs(
                    simd,
                    scene.frame,
                    (runs, segments, starts, bases, perspective),
                    sums,
                );
                runs.clear();
                if at >= sorted.len() {
                    break;
                }
            }
            blocks.clear();
            if through {
                break;
            }
        }
        looks.nodes += packets.nodes;
    }

    /// Takes what lanes cannot hold through the mipmap in f64.
    fn walk_leftovers(&mut self, scene: &Scene<'_>) {
        let Self { found, sums, looks, leftovers, .. } = self;
        let frame = scene.frame;
        *leftovers += found.leftovers.len() as u64;
        for leftover in &found.leftovers {
            let index = leftover.layer as usize;
            let (Some(tree), Some(layer)) = (scene.trees.trees().get(index), frame.shadow().layer(index))
            else {
                continue;
            };
            let [x, y] = sums.place(leftover.pixel);
            let ray = frame.camera().pixel_ray(x, y);
            let stretch = f64::from(sums.stretch[leftover.pixel as usize]);
            let path = layer.projection().ray(frame.camera().eye(), ray.origin, ray.direction);
            let part = leftover.part.map(|depth| depth * stretch);
            let pixel = leftover.pixel;
            lit_stretches(&layer, tree, &path, part, looks, |a, b| {
                scene.integrand.add_exactly(frame, pixel, [a, b], sums);
            });
        }
    }

    /// Writes the tile's pixels.
    #[inline(always)]
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<'_>,
        size: [u32; 2],
        (inscattered, transmittance): (&mut [[f32; 3]], &mut [[f32; 3]]),
    ) {
        let sums = &self.sums;
        let (frame, width, limit) = (scene.frame, scene.frame.size()[0] as usize, scene.frame.max_distance());
        let sun = match frame.light() {
            Light::Directional(sun) if scene.integrand.is_length() => {
                Some(SunIntegralF32::new(sun, frame.medium(), frame.camera()))
            }
            _ => None,
        };
        let same = matches!(scene.integrand, Integrand::Lengths { channels: 1, .. });
        for row in 0..size[1] {
            for column in (0..size[0]).step_by(RayLanes::COUNT) {
                let place = [sums.origin[0] + column, sums.origin[1] + row];
                let count = (size[0] - column).min(RayLanes::COUNT as u32) as usize;
                let first = row as usize * width + place[0] as usize;
                let tile_first = (row * TILE[0] + column) as usize;
                let texels =
                    &frame.depth().texels()[place[1] as usize * width + place[0] as usize..][..count];
                let mut ends = [0.0f32; LANES];
                match texels.first_chunk() {
                    Some(whole) => ends = *whole,
                    None => ends[..count].copy_from_slice(texels),
                }
                // Rounding keeps order, so that this is the lesser one rounded.
                let ends = Reals::load_array(simd, ends).min(real(simd, limit as f32)).to_array();
                let through = transmittances_of_pixels_f32(frame.setup(), (place[0], place[1]), &ends);
                let mut radiance = [[1.0f32; LANES]; 3];
                if let Some(sun) = &sun {
                    radiance = sun.source_of_pixels(place[0], place[1]);
                }
                let mut stretch = real(simd, 1.0);
                if sun.is_some() {
                    stretch = Reals::from_slice(simd, &sums.stretch[tile_first..][..LANES]);
                }
                for (channel, values) in radiance.iter_mut().enumerate() {
                    let sum = &sums.channels[if same { 0 } else { channel }][tile_first..][..LANES];
                    let source = Reals::load_array_ref(simd, values);
                    *values = (source * Reals::from_slice(simd, sum) * stretch).to_array();
                }
                write_pixels(&radiance, &mut inscattered[first..][..count]);
                write_pixels(&through, &mut transmittance[first..][..count]);
            }
        }
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.found.memory_bytes()
            + self.blocks.memory_bytes()
            + self.sorted.memory_bytes()
            + self.runs.memory_bytes()
            + self.sums.memory_bytes()
            + size_of::<Self>() as u64
    }
}
