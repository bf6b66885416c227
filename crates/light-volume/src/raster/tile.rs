//! A tile of the image: which patches its rays may cross, what crosses what, and the light of its pixels.
//!
//! ```text
//!     for each layer:
//!         rays of the sixteen blocks                how they start, where they enter and leave the map
//!         patches that any ray of the tile may cross
//!         of each block: those that it may cross ──▶ crossings
//!     of each block: crossings ──▶ lit intervals ──▶ sums
//!     what does not add up, and what numbers cannot hold, ray by ray in f64
//!     sums to pixels
//! ```
//!
//! No tile knows of another: threads change no bit.

use fearless_simd::Simd;
use scatter_core::{
    Frame, Light, MapFan, MapKind, RayFan, RayLanes, ShadowLayer, SunIntegralF32, lit_stretches,
    transmittances_of_pixels_f32,
};

use super::block_rays::{BlockRays, Bounds, RAYS, SIDE};
use super::candidates::Candidates;
use super::coverage::cross;
use super::crossings::{Crossing, Crossings, ENTERS, LEAVES, make_room};
use super::facets::{cross_facets, starts_behind};
use super::integrate::{Integrand, LANES, Run, TileSums, along_ray};
use super::ray_fan::MapRays;
use super::ray_group::BlockBeams;
use super::surface_walk::lit_on_surface;
use crate::volume::{HeightField, SteppedVolume, code_of};

/// Pixels along the side of a tile.
pub const TILE: u32 = 32;
/// Blocks along its side.
const ACROSS: u32 = TILE / SIDE;
/// Blocks of a tile.
const BLOCKS: usize = (ACROSS * ACROSS) as usize;

/// What all tiles of a frame read.
pub struct Scene<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Its rays.
    pub fan: RayFan,
    /// Its rays in each layer; none where nothing casts a shadow.
    pub fans: &'a [MapFan],
    /// The meshes of the layers.
    pub meshes: Meshes<'a>,
    /// What is added up.
    pub integrand: Integrand<'a>,
}

/// The meshes of a frame's layers; none where nothing casts a shadow.
#[derive(Debug, Clone, Copy)]
pub enum Meshes<'a> {
    /// Caps and walls.
    Stepped(&'a [SteppedVolume]),
    /// Triangles between texels' centres.
    Interpolated(&'a [HeightField]),
}

impl Meshes<'_> {
    /// How many layers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Stepped(volumes) => volumes.len(),
            Self::Interpolated(fields) => fields.len(),
        }
    }

    /// Whether a ray starts in the shadow of a layer.
    #[inline(always)]
    fn starts_dark(&self, layer: usize, map: &ShadowLayer<'_>, rays: &BlockRays, ray: usize) -> bool {
        let (size, perspective) = (map.projection().size(), map.projection().is_perspective());
        match self {
            Self::Stepped(volumes) => rays.first_texel(ray, size).is_some_and(|[i, j]| {
                rays.starts_behind(ray, code_of(volumes[layer].depth_at(map, i, j), perspective))
            }),
            Self::Interpolated(fields) => rays.first_cell(ray, size).is_some_and(|(cell, half)| {
                let facet = fields[layer].facet_at(map, cell, half);
                facet.is_some_and(|facet| starts_behind(&facet, rays, ray))
            }),
        }
    }
}

/// What a worker did.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Patches that blocks looked at.
    pub patches: u64,
    /// Faces of them.
    pub faces: u64,
    /// Crossings found.
    pub crossings: u64,
    /// Lit intervals.
    pub lit_runs: u64,
    /// Rays whose signs did not add up.
    pub violations: u64,
    /// Rays that were walked in f64.
    pub walked: u64,
}

/// What a worker holds for the tile that it is at.
#[derive(Debug, Clone, Default)]
pub struct TileWork {
    rays: Vec<BlockRays>,
    ends: Vec<[f64; RAYS]>,
    candidates: Candidates,
    crossings: Vec<Crossings>,
    sorted: Vec<Crossing>,
    runs: Vec<Run>,
    sums: TileSums,
    /// What it did in all tiles so far.
    pub counts: Counts,
    /// What a tile asked for at the most.
    pub most: Most,
}

/// The longest lists of a frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Most {
    /// Crossings of a block.
    crossings: usize,
    /// Lit intervals of a block.
    runs: usize,
    /// Squares that a tile's rays may cross.
    candidates: usize,
}

impl Most {
    /// The longer ones of both.
    pub fn joined(&self, other: &Self) -> Self {
        Self {
            crossings: self.crossings.max(other.crossings),
            runs: self.runs.max(other.runs),
            candidates: self.candidates.max(other.candidates),
        }
    }
}

impl TileWork {
    /// Forgets what it counted.
    pub fn start_frame(&mut self) {
        self.counts = Counts::default();
    }

    /// Makes room for twice the longest lists of the frame in all of its lists: which worker gets which tile is chance, the camera
    /// moves, and the next frame should allocate nothing.
    pub fn end_frame(&mut self, most: &Most) {
        self.most = *most;
        self.rays.resize_with(BLOCKS, BlockRays::default);
        self.ends.resize(BLOCKS, [0.0; RAYS]);
        self.crossings.resize_with(BLOCKS, Crossings::default);
        self.crossings.iter_mut().for_each(|list| list.make_room(most.crossings));
        make_room(&mut self.sorted, most.crossings);
        make_room(&mut self.runs, most.runs);
        self.candidates.make_room(most.candidates);
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
        let size = [(width - origin[0]).min(TILE), (height - origin[1]).min(TILE)];
        // Whole tiles, whatever the image leaves of them: buffers of one size, and lanes that need no end.
        self.sums.clear(origin, TILE, (TILE * TILE) as usize, scene.integrand.accumulate());
        self.rays.resize_with(BLOCKS, BlockRays::default);
        self.ends.resize(BLOCKS, [0.0; RAYS]);
        self.crossings.resize_with(BLOCKS, Crossings::default);
        self.crossings.iter_mut().for_each(Crossings::clear);
        self.measure(scene, size);
        scene.integrand.set_up(scene.frame, &mut self.sums);
        for layer in 0..scene.meshes.len() {
            self.cross_layer(simd, scene, layer);
        }
        for block in 0..BLOCKS {
            self.integrate(simd, scene, block);
        }
        scene.integrand.finish(simd, &mut self.sums);
        self.shade(scene, size, rows);
    }

    /// Where the tile's rays end, and how long a unit of depth is on them.
    #[inline(always)]
    fn measure(&mut self, scene: &Scene<'_>, size: [u32; 2]) {
        let (frame, limit) = (scene.frame, scene.frame.max_distance());
        let width = frame.size()[0] as usize;
        let origin = self.sums.origin;
        for block in 0..BLOCKS as u32 {
            let first = [block % ACROSS * SIDE, block / ACROSS * SIDE];
            for ray in 0..RAYS as u32 {
                let [x, y] = [first[0] + ray % SIDE, first[1] + ray / SIDE];
                let pixel = (y * TILE + x) as usize;
                let stretch = scene.fan.stretch([origin[0] + x, origin[1] + y]);
                let mut end = 0.0;
                if x < size[0] && y < size[1] {
                    let at = (origin[1] + y) as usize * width + (origin[0] + x) as usize;
                    end = f64::from(frame.depth().texels()[at]).min(limit) / stretch;
                }
                self.ends[block as usize][ray as usize] = end;
                self.sums.stretch[pixel] = stretch as f32;
                self.sums.ends[pixel] = end as f32;
            }
        }
    }

    /// Finds what the tile's rays cross in a layer.
    #[inline(always)]
    fn cross_layer<S: Simd>(&mut self, simd: S, scene: &Scene<'_>, layer: usize) {
        let Self { rays, ends, candidates, crossings, sums, counts, most, .. } = self;
        let fan = &scene.fans[layer];
        let Some(map) = scene.frame.shadow().layer(layer) else { return };
        let mut bounds = Bounds::EMPTY;
        for (block, rays) in rays.iter_mut().enumerate() {
            let origin = place_of(sums.origin, block);
            let found = &mut crossings[block];
            found.walked |= rays.set_up(fan, origin, &ends[block]);
            bounds = bounds.joined(&rays.bounds);
            for ray in (0..RAYS).filter(|&ray| scene.meshes.starts_dark(layer, &map, rays, ray)) {
                match rays.base(ray) {
                    0.0 => found.starts[layer].dark |= 1 << ray,
                    // Before it enters a lamp's pyramid the ray is in the light, as all is outside of a map.
                    depth => {
                        let (ray, layer) = (ray as u8, layer as u8);
                        found.push(Crossing { depth, s: 0.0, ray, layer, sign: 1, axis: 0 });
                    }
                }
            }
            if scene.meshes.len() > 1 {
                find_borders(fan, layer as u8, origin, &ends[block], found);
            }
        }
        match scene.meshes {
            Meshes::Stepped(volumes) => candidates.find(&volumes[layer], fan.perspective, &bounds),
            Meshes::Interpolated(fields) => candidates.find(&fields[layer], fan.perspective, &bounds),
        }
        most.candidates = most.candidates.max(candidates.len());
        for (rays, found) in rays.iter().zip(crossings) {
            if !(rays.bounds.end > 0.0) {
                continue;
            }
            let beams = BlockBeams::new(rays);
            let (index, perspective) = (layer as u8, fan.perspective);
            for sixteen in 0..candidates.sixteens() {
                let mut met = candidates.met_by(simd, &beams.block, sixteen);
                while met != 0 {
                    let candidate = candidates.at(sixteen, met.trailing_zeros() as usize);
                    met &= met - 1;
                    counts.patches += 1;
                    counts.faces += match scene.meshes {
                        Meshes::Stepped(volumes) => {
                            let of_layer = (&volumes[layer], index, perspective);
                            cross(simd, of_layer, candidate, (rays, &beams), found)
                        }
                        Meshes::Interpolated(fields) => {
                            let of_layer = (&fields[layer], &map, index, perspective);
                            cross_facets(simd, of_layer, candidate, (rays, &beams), found)
                        }
                    };
                }
            }
        }
    }

    /// Adds up the light of a block's pixels.
    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S, scene: &Scene<'_>, block: usize) {
        let Self { ends, crossings, sorted, runs, sums, counts, most, .. } = self;
        let (ends, crossings) = (&ends[block], &mut crossings[block]);
        let first = [block as u32 % ACROSS * SIDE, block as u32 / ACROSS * SIDE];
        let layers = scene.meshes.len();
        if scene.frame.setup().maps().kind() == MapKind::Cube && layers > 0 {
            crossings.walk_gaps(ends);
        }
        let pixel_of = |ray: usize| (first[1] + ray as u32 / SIDE) * TILE + first[0] + ray as u32 % SIDE;
        runs.clear();
        counts.crossings += crossings.len() as u64;
        counts.violations += crossings.lit_intervals(ends, (layers, layers > 1), sorted, |ray, from, to| {
            runs.push(Run { pixel: pixel_of(ray), ends: [from, to] });
        });
        counts.lit_runs += runs.len() as u64;
        *most = most.joined(&Most { crossings: crossings.len(), runs: runs.len(), candidates: 0 });
        scene.integrand.add(simd, scene.frame, runs, sums);
        let mut walked = crossings.walked;
        while walked != 0 {
            let ray = walked.trailing_zeros() as usize;
            walked &= walked - 1;
            if ends[ray] > 0.0 {
                counts.walked += 1;
                walk(scene, pixel_of(ray), ends[ray], sums);
            }
        }
    }

    /// Writes the tile's pixels.
    #[inline(always)]
    fn shade(
        &self,
        scene: &Scene<'_>,
        size: [u32; 2],
        (inscattered, transmittance): (&mut [[f32; 3]], &mut [[f32; 3]]),
    ) {
        let sums = &self.sums;
        let (frame, width, limit) = (scene.frame, scene.frame.size()[0] as usize, scene.frame.max_distance());
        let sun = match (frame.light(), scene.integrand.adds_lengths()) {
            (Light::Directional(sun), true) => Some(SunIntegralF32::new(sun, frame.medium(), frame.camera())),
            _ => None,
        };
        let same = scene.integrand.channels() == 1;
        for row in 0..size[1] {
            for column in (0..size[0]).step_by(RayLanes::COUNT) {
                let place = [sums.origin[0] + column, sums.origin[1] + row];
                let count = (size[0] - column).min(RayLanes::COUNT as u32) as usize;
                let first = row as usize * width + place[0] as usize;
                let tile_first = (row * TILE + column) as usize;
                let mut ends = [0.0f32; LANES];
                let texels =
                    &frame.depth().texels()[place[1] as usize * width + place[0] as usize..][..count];
                for (end, &depth) in ends.iter_mut().zip(texels) {
                    *end = f64::from(depth).min(limit) as f32;
                }
                let through = transmittances_of_pixels_f32(frame.setup(), (place[0], place[1]), &ends);
                let mut radiance = [[1.0f32; LANES]; 3];
                if let Some(sun) = &sun {
                    radiance = sun.source_of_pixels(place[0], place[1]);
                }
                for (channel, values) in radiance.iter_mut().enumerate() {
                    let sum = &sums.channels[if same { 0 } else { channel }][tile_first..][..LANES];
                    let stretch = &sums.stretch[tile_first..][..LANES];
                    for lane in 0..LANES {
                        values[lane] *= sum[lane] * if sun.is_some() { stretch[lane] } else { 1.0 };
                    }
                }
                write_pixels(&radiance, &mut inscattered[first..][..count]);
                write_pixels(&through, &mut transmittance[first..][..count]);
            }
        }
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let crossings: u64 = self.crossings.iter().map(Crossings::memory_bytes).sum();
        let lists = self.rays.capacity() * size_of::<BlockRays>()
            + self.ends.capacity() * size_of::<[f64; RAYS]>()
            + self.crossings.capacity() * size_of::<Crossings>()
            + self.sorted.capacity() * size_of::<Crossing>()
            + self.runs.capacity() * size_of::<Run>();
        crossings + lists as u64 + self.candidates.memory_bytes() + self.sums.memory_bytes()
    }
}

/// The first pixel of a block of the tile at `origin`.
fn place_of(origin: [u32; 2], block: usize) -> [u32; 2] {
    let block = block as u32;
    [origin[0] + block % ACROSS * SIDE, origin[1] + block / ACROSS * SIDE]
}

/// Where the rays of a block enter and leave the rectangle of a layer's map.
#[inline(always)]
fn find_borders(fan: &MapFan, layer: u8, [x, y]: [u32; 2], ends: &[f64; RAYS], found: &mut Crossings) {
    for (ray, &end) in ends.iter().enumerate() {
        if !(end > 0.0) {
            continue;
        }
        let path = fan.path([x + ray as u32 % SIDE, y + ray as u32 / SIDE]);
        let [from, to] = fan.clip(&path, [0.0, end]);
        if !(from < to) {
            continue;
        }
        let event = |depth, sign| Crossing { depth, s: 0.0, ray: ray as u8, layer, sign, axis: 0 };
        if from > 0.0 {
            found.push(event(from, ENTERS));
        } else {
            found.starts[layer as usize].inside |= 1 << ray;
        }
        if to < end {
            found.push(event(to, LEAVES));
        }
    }
}

/// Adds the light of one pixel, walked through the maps or the surface in f64.
fn walk(scene: &Scene<'_>, pixel: u32, end: f64, sums: &mut TileSums) {
    let frame = scene.frame;
    let [x, y] = sums.place(pixel);
    let ray = frame.camera().pixel_ray(x, y);
    let along = along_ray(frame, &ray);
    let maps = (frame.shadow(), frame.setup().maps());
    let add = |from: f64, to: f64| {
        scene.integrand.add_exactly(frame, pixel, [from / along, to / along], sums);
    };
    match scene.meshes {
        Meshes::Stepped(_) => lit_stretches(maps, frame.camera().eye(), &ray, [0.0, end * along], add),
        Meshes::Interpolated(fields) => lit_on_surface(frame, fields, &ray, end * along, add),
    }
}

/// Channel by channel to pixel by pixel.
#[inline(always)]
fn write_pixels(channels: &[[f32; LANES]; 3], pixels: &mut [[f32; 3]]) {
    let [red, green, blue] = channels;
    for (((pixel, red), green), blue) in pixels.iter_mut().zip(red).zip(green).zip(blue) {
        *pixel = [*red, *green, *blue];
    }
}
