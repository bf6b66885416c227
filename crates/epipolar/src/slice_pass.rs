//! One slice from the shadow map to the shares of its pixels: rectify, integrate, hand out.
//!
//! The stages of a slice run one after the other on the same few kilobytes, so that rectified rows never leave the
//! innermost caches; only the pixels' shares reach memory.

use scatter_core::{Camera, Frame, Light, MapProjection, ShadowLayer, ShadowMap};

use crate::epipole::Epipole;
use crate::fan_pixels::FanPixels;
use crate::integrand::{BandTables, Integrand};
use crate::integrate::{Integrator, IntegratorScratch, Problem, Queries, RunIndex, Terms, integrate};
use crate::map_line::{ColumnOrder, MapLine, turn};
use crate::planes::Planes;
use crate::row::Row;
use crate::simd_level::{Level, at_level};
use crate::slice_plane::SlicePlane;
use crate::tint::TintedRow;
use crate::slices::{Fan, Major, Slice, SliceSet};

/// What all slices of a frame share.
pub struct SlicePass<'a> {
    pub frame: &'a Frame<'a>,
    pub camera: &'a Camera,
    pub epipole: Epipole,
    pub slices: &'a SliceSet,
    pub integrand: &'a Integrand,
    pub integrator: Integrator,
    /// Columns that a texel may hide before it is cut exactly.
    pub split_over: f32,
    pub level: Level,
    pub planes: &'a Planes,
    /// Channels whose shares differ.
    pub channels: usize,
}

/// Length of a view ray that never ends: far enough for any lamp, and its products stay within f32.
const FARTHEST: f64 = 1e18;

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct SliceScratch {
    row: Row,
    tinted: TintedRow,
    index: RunIndex,
    /// Per column of a fan: the first pixel behind the slice before, this slice, and the next one.
    borders: [Vec<i32>; 3],
    /// sin β, cos β and the factors' view coordinate per column.
    sines: Vec<f32>,
    cosines: Vec<f32>,
    views: Vec<f32>,
    /// Cone factors of a spot over γ, and the prefix sums of its factors.
    cone: Vec<f32>,
    lamp_prefix: Vec<f32>,
    queries: QueryList,
    prefix: Vec<f32>,
    ends: Vec<f32>,
    sums: Vec<f32>,
    integrator: IntegratorScratch,
    pub counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub texels: u64,
    pub runs: u64,
    pub queries: u64,
}

/// The pixels that one slice answers, in the order of its columns.
#[derive(Debug, Default)]
struct QueryList {
    ranks: Vec<u32>,
    /// Column within the fan.
    columns: Vec<u32>,
    /// Pixel index, doubled, plus one for those behind the slice's predecessor.
    slots: Vec<u32>,
    /// Share of the slice in the pixel.
    weights: Vec<f32>,
    gammas: Vec<f32>,
    runs: Vec<u32>,
}

impl QueryList {
    fn clear(&mut self) {
        self.ranks.clear();
        self.columns.clear();
        self.slots.clear();
        self.weights.clear();
        self.gammas.clear();
        self.runs.clear();
    }

    fn reserve(&mut self, count: usize) {
        self.ranks.reserve(count);
        self.columns.reserve(count);
        self.slots.reserve(count);
        self.weights.reserve(count);
        self.gammas.reserve(count);
        self.runs.reserve(count);
    }
}

impl SliceScratch {
    /// Grows all buffers to what any slice of such a frame may need.
    pub fn reserve(&mut self, frame: &Frame<'_>, map_side: usize, spacing: f64, integrand: &Integrand) {
        let size = frame.size();
        let terms = integrand.lanes();
        let columns = size[0].max(size[1]) as usize;
        // A pixel is in the gaps beside a slice if it is within a spacing of it, measured across; 45° slices are √2
        // wider along a column.
        let queries = columns * (2 * ((1.5 * spacing).ceil() as usize + 1));
        // Every texel column has two cells; around the epipole cells are split, by up to all columns each.
        let mut runs = 6 * map_side + 8 * columns + 64;
        self.row.clear(runs);
        if let Some(texture) = frame.texture() {
            let [width, height] = texture.projection().size();
            let side = width.max(height) as usize;
            self.tinted.reserve(runs, side);
            runs += 2 * side + 4;
        }
        for border in &mut self.borders {
            border.clear();
            border.reserve(columns);
        }
        for angles in [&mut self.sines, &mut self.cosines, &mut self.views] {
            angles.clear();
            angles.resize(columns, 1.0);
        }
        self.queries.clear();
        self.queries.reserve(queries);
        let grow = |buffer: &mut Vec<f32>, length: usize| buffer.resize(length.max(buffer.len()), 0.0);
        grow(&mut self.prefix, (runs + 1) * terms);
        grow(&mut self.ends, queries * terms);
        grow(&mut self.sums, queries * terms);
        grow(&mut self.lamp_prefix, integrand.buffer_len());
        self.cone.reserve(integrand.buffer_len());
        self.integrator.reserve(runs, columns, queries, terms);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let queries = &self.queries;
        self.row.memory_bytes()
            + self.tinted.memory_bytes()
            + self.integrator.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * (self.borders.iter().map(Vec::capacity).sum::<usize>()
                + self.sines.capacity()
                + self.cosines.capacity()
                + self.views.capacity()
                + self.cone.capacity()
                + self.lamp_prefix.capacity()
                + self.prefix.capacity()
                + self.ends.capacity()
                + self.sums.capacity()
                + queries.ranks.capacity()
                + queries.columns.capacity()
                + queries.slots.capacity()
                + queries.weights.capacity()
                + queries.gammas.capacity()
                + queries.runs.capacity())
    }
}

impl SlicePass<'_> {
    /// All slices `range` of a fan.
    pub fn run(
        &self,
        fan: &Fan,
        pixels: &FanPixels,
        range: std::ops::Range<usize>,
        scratch: &mut SliceScratch,
    ) {
        let slices = &self.slices.slices[fan.first..][..fan.count];
        let mut borders = std::mem::take(&mut scratch.borders);
        let [before, own, next] = &mut borders;
        if let Some(previous) = range.start.checked_sub(1) {
            at_level!(self.level, find_borders(fan, pixels, slices, previous, before));
        }
        at_level!(self.level, find_borders(fan, pixels, slices, range.start, own));
        for index in range {
            if index + 1 < fan.count {
                at_level!(self.level, find_borders(fan, pixels, slices, index + 1, next));
            } else {
                next.clone_from(own);
            }
            if index == 0 {
                before.clone_from(own);
            }
            at_level!(self.level, self.slice(fan, pixels, index, [&*before, &*own, &*next], scratch));
            std::mem::swap(before, own);
            std::mem::swap(own, next);
        }
        scratch.borders = borders;
    }

    #[inline(always)]
    fn slice(
        &self,
        fan: &Fan,
        pixels: &FanPixels,
        index: usize,
        borders: [&[i32]; 3],
        scratch: &mut SliceScratch,
    ) {
        let slices = &self.slices.slices[fan.first..][..fan.count];
        // Trim the columns to those that have pixels beside this slice.
        let busy = |column: usize| borders[0][column] < borders[2][column];
        let all = pixels.ranges.len();
        let Some(from) = (0..all).find(|&column| busy(column)) else { return };
        let to = (from..all).rev().find(|&column| busy(column)).unwrap_or(from) + 1;
        let order = ColumnOrder {
            columns: [pixels.columns[0] + from as u32, pixels.columns[0] + to as u32],
            ascending: fan.ascending == self.epipole.outward,
        };
        let plane = SlicePlane::new(self.camera, &self.epipole, &slices[index], fan.major);
        let count = to - from;
        plane.angles(order.columns[0], &mut scratch.sines[..count], &mut scratch.cosines[..count]);
        self.view_coordinates(count, scratch);
        if let Light::Spot(spot) = self.frame.light() {
            self.integrand.fill_cone(Some(spot), &plane, &mut scratch.cone);
        }

        let reach = self.ask(fan, slices, index, borders, from, order, scratch);
        self.rectify(&plane, order, reach, scratch);
        let texture = self.frame.texture();
        if let Some(texture) = texture {
            let line = self.line(texture.projection(), &plane, order, f64::from(reach));
            scratch.tinted.fill(&scratch.row, line.as_ref(), texture);
        }
        let starts = if texture.is_some() { scratch.tinted.starts() } else { scratch.row.starts() };
        scratch.index.fill(starts, reach);
        let queries = &mut scratch.queries;
        for &gamma in &queries.gammas {
            queries.runs.push(scratch.index.find(starts, gamma));
        }
        scratch.counts.queries += queries.gammas.len() as u64;
        scratch.counts.runs += scratch.row.len() as u64;

        for channel in 0..self.channels {
            let factors = channel.min(self.integrand.channels() - 1);
            // Columns of one band follow each other.
            let (mut first, count) = (0, scratch.queries.columns.len());
            while first < count {
                let band_of = |query: usize| {
                    self.integrand.band_of(factors, scratch.views[scratch.queries.columns[query] as usize])
                };
                let band = band_of(first);
                let last = (first + 1..count).find(|&query| band_of(query) != band).unwrap_or(count);
                let mut buffer = std::mem::take(&mut scratch.lamp_prefix);
                let (tables, lanes) = self.integrand.tables(factors, band, &scratch.cone, &mut buffer);
                match lanes {
                    1 => self.band::<1>(&tables, first..last, channel, order, scratch),
                    2 => self.band::<2>(&tables, first..last, channel, order, scratch),
                    4 => self.band::<4>(&tables, first..last, channel, order, scratch),
                    _ => self.band::<8>(&tables, first..last, channel, order, scratch),
                }
                scratch.lamp_prefix = buffer;
                first = last;
            }
        }
    }

    /// The factors' coordinate of each view ray: 1/sin β for a sun, β for a lamp.
    #[inline(always)]
    fn view_coordinates(&self, count: usize, scratch: &mut SliceScratch) {
        let angles = scratch.sines[..count].iter().zip(&scratch.cosines[..count]);
        if matches!(self.frame.light(), Light::Directional(_)) {
            for (view, (sine, _)) in scratch.views.iter_mut().zip(angles) {
                *view = 1.0 / sine;
            }
        } else {
            for (view, (sine, cosine)) in scratch.views.iter_mut().zip(angles) {
                *view = sine.atan2(*cosine);
            }
        }
    }

    /// Lists the pixels beside a slice; returns the farthest light ray that one of their rays ends at.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "one slice, its neighbours and its columns")]
    fn ask(
        &self,
        fan: &Fan,
        slices: &[Slice],
        index: usize,
        borders: [&[i32]; 3],
        from: usize,
        order: ColumnOrder,
        scratch: &mut SliceScratch,
    ) -> f32 {
        let [width, _] = self.frame.size();
        let depth = self.frame.depth().texels();
        let eye = self.camera.eye();
        let lamp = self.frame.light().position().map(|position| (position - eye).length() as f32);
        let longest = if lamp.is_some() { FARTHEST } else { self.integrand.longest() };
        let longest = longest.min(self.frame.max_distance()) as f32;
        let strides = match fan.major {
            Major::X => [1, width],
            Major::Y => [width, 1],
        };
        let neighbours = [&slices[index.saturating_sub(1)], &slices[(index + 1).min(slices.len() - 1)]];
        let queries = &mut scratch.queries;
        queries.clear();
        let mut reach = 0.0f32;
        for offset in 0..order.count() {
            let column = order.columns[0] + offset as u32;
            let at = from + offset;
            let (start, middle, end) = (borders[0][at], borders[1][at], borders[2][at]);
            if start == end {
                continue;
            }
            let along = f64::from(column) + 0.5;
            let own = slices[index].minor_at(fan.major, along);
            let gaps = neighbours.map(|other| {
                let gap = (other.minor_at(fan.major, along) - own).abs();
                if gap > 0.0 { 1.0 / gap } else { 0.0 }
            });
            let rank = order.rank(column);
            let (sine, cosine) = (scratch.sines[offset], scratch.cosines[offset]);
            for pixel in start..end {
                let behind = pixel >= middle;
                let distance = (f64::from(pixel) + 0.5 - own).abs() * gaps[usize::from(behind)];
                let place = column * strides[0] + pixel as u32 * strides[1];
                let end = depth[place as usize].min(longest);
                let gamma = match lamp {
                    None => end * sine,
                    Some(distance) => turn(distance - end * cosine, end * sine),
                };
                reach = reach.max(gamma);
                queries.ranks.push(rank);
                queries.columns.push(offset as u32);
                // Pixels behind this slice have it as the one before them.
                queries.slots.push(2 * place + u32::from(!behind));
                queries.weights.push((1.0 - distance).clamp(0.0, 1.0) as f32);
                queries.gammas.push(gamma);
            }
        }
        reach
    }

    /// Rectifies the light rays of a slice up to `reach`.
    #[inline(always)]
    fn rectify(&self, plane: &SlicePlane, order: ColumnOrder, reach: f32, scratch: &mut SliceScratch) {
        let columns = order.count() as u32;
        let behind = if self.epipole.outward { columns } else { 0 };
        let reach = f64::from(reach);
        scratch.row.clear(0);
        scratch.row.push(0.0, columns);
        let mut append = |line: MapLine, layer: &ShadowLayer<'_>| {
            scratch.counts.texels += u64::from(line.columns);
            scratch.row.append(self.level, &line, layer.texels(), columns, behind, self.split_over);
            // Outside of the map nothing is shadowed.
            scratch.row.push(line.gamma.at(line.length), columns);
        };
        match self.frame.shadow() {
            ShadowMap::Orthographic(layer) | ShadowMap::Perspective(layer) => {
                if let Some(line) = self.line(layer.projection(), plane, order, reach) {
                    append(line, layer);
                }
            }
            ShadowMap::Cube(cube) => {
                let mut faces: [_; 6] = std::array::from_fn(|face| {
                    let line = self.line(cube.face(face).projection(), plane, order, reach);
                    line.map(|line| (line.gamma.at(0.0), face, line))
                });
                // In the order of γ; `None` first.
                faces.sort_unstable_by(|a, b| {
                    let start = |face: &Option<(f32, usize, MapLine)>| face.as_ref().map_or(-1.0, |face| face.0);
                    start(a).total_cmp(&start(b))
                });
                for (_, face, line) in faces.into_iter().flatten() {
                    append(line, &cube.face(face));
                }
            }
            ShadowMap::Unshadowed | ShadowMap::Cascades(_) => {}
        }
        scratch.row.finish();
    }

    /// The slice's line through a map of the light.
    #[inline(always)]
    fn line(
        &self,
        projection: &MapProjection,
        plane: &SlicePlane,
        order: ColumnOrder,
        reach: f64,
    ) -> Option<MapLine> {
        let eye = self.camera.eye();
        match self.frame.light().position() {
            None => MapLine::sun(projection, eye, plane, order, reach),
            Some(lamp) => MapLine::lamp(projection, plane, order, (lamp - eye).length(), reach),
        }
    }

    /// Answers the queries of one band for one extinction.
    #[inline(always)]
    fn band<const N: usize>(
        &self,
        tables: &BandTables<'_>,
        range: std::ops::Range<usize>,
        channel: usize,
        order: ColumnOrder,
        scratch: &mut SliceScratch,
    ) {
        let table = Table::<N>::new(tables.prefix, tables.per_gamma);
        let queries = &scratch.queries;
        let gammas = &queries.gammas[range.clone()];
        let ends = &mut scratch.ends.as_chunks_mut::<N>().0[..gammas.len()];
        for (end, &gamma) in ends.iter_mut().zip(gammas) {
            *end = table.at(gamma);
        }
        let runs = queries.runs[range.clone()].iter().max().map_or(0, |&run| run as usize + 1);
        let (starts, lit, tint) = if self.frame.texture().is_some() {
            let tinted = &scratch.tinted;
            (tinted.starts(), tinted.lit(), Some(tinted.tint(channel)))
        } else {
            (scratch.row.starts(), scratch.row.lit(), None)
        };
        let prefix = &mut scratch.prefix.as_chunks_mut::<N>().0[..=runs];
        for (value, &gamma) in prefix.iter_mut().zip(starts) {
            *value = table.at(gamma);
        }
        let ranks = &queries.ranks[range.clone()];
        let (a, b) = (ranks[0], ranks[ranks.len() - 1]);
        let problem = Problem {
            lit: &lit[..runs],
            prefix,
            tint: tint.map(|tint| &tint[..runs]),
            queries: Queries { ranks, runs: &queries.runs[range.clone()] },
            ends,
            columns: [a.min(b), a.max(b) + 1],
            ascending: order.ascending,
        };
        let sums = &mut scratch.sums.as_chunks_mut::<N>().0[..gammas.len()];
        integrate(self.integrator, &problem, &mut scratch.integrator, sums);

        let brightest = if tint.is_some() { f32::MAX } else { 1.0 };
        let weights = Table::<N>::new(tables.weights, tables.per_view);
        for ((query, sum), end) in range.zip(&*sums).zip(&*ends) {
            let view = scratch.views[queries.columns[query] as usize];
            let view = weights.at((view - tables.first_view as f32).max(0.0));
            let (mut lit, mut whole) = (0.0f32, 0.0f32);
            for term in 0..N {
                lit += view[term] * sum[term];
                whole += view[term] * end[term];
            }
            // A ray without length has no shadow, and its radiance is 0 anyway.
            let share = if whole > 0.0 { (lit / whole).max(0.0).min(brightest) } else { 1.0 };
            let slot = queries.slots[query];
            let share = share * queries.weights[query];
            self.planes.put((slot >> 1) as usize, channel, slot & 1 == 1, share);
        }
    }
}

/// A table of factors over a uniform grid, interpolated linearly.
struct Table<'a, const N: usize> {
    nodes: &'a [Terms<N>],
    per_unit: f32,
    last: f32,
}

impl<'a, const N: usize> Table<'a, N> {
    /// `scale` maps the argument to [0, 1].
    #[inline(always)]
    fn new(flat: &'a [f32], scale: f64) -> Self {
        let nodes = flat.as_chunks::<N>().0;
        let last = (nodes.len() - 1) as f32;
        Self { nodes, per_unit: (scale * f64::from(last)) as f32, last }
    }

    #[inline(always)]
    fn at(&self, argument: f32) -> Terms<N> {
        let place = (argument * self.per_unit).min(self.last);
        let index = (place as usize).min(self.nodes.len() - 2);
        let part = place - index as f32;
        let (a, b) = (&self.nodes[index], &self.nodes[index + 1]);
        std::array::from_fn(|term| a[term] + part * (b[term] - a[term]))
    }
}

/// The first pixel behind a slice in each column of its fan.
#[inline(always)]
fn find_borders(fan: &Fan, pixels: &FanPixels, slices: &[Slice], index: usize, out: &mut Vec<i32>) {
    out.clear();
    if index == 0 {
        out.extend(pixels.ranges.iter().map(|range| range[0]));
    } else if index + 1 == slices.len() {
        out.extend(pixels.ranges.iter().map(|range| range[1]));
    } else {
        let slice = &slices[index];
        let first = slice.minor_at(fan.major, f64::from(pixels.columns[0]) + 0.5) - 0.5;
        out.extend(pixels.ranges.iter().enumerate().map(|(offset, range)| {
            let minor = first + slice.slope * offset as f64;
            (minor.ceil() as i32).clamp(range[0], range[1])
        }));
    }
}
