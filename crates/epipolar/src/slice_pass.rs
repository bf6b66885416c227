//! One slice from the shadow map to the shares of its pixels: rectify, integrate, hand out.
//!
//! The stages of a slice run one after the other on the same few kilobytes, so that rectified rows never leave the
//! innermost caches; only the pixels' shares reach memory.

use scatter_core::{Camera, Frame, ShadowLayer};

use crate::bands::Bands;
use crate::epipole::Epipole;
use crate::factor::Factors;
use crate::fan_pixels::FanPixels;
use crate::integrate::{Integrator, IntegratorScratch, Problem, Queries, RunIndex, Terms, integrate};
use crate::map_line::{ColumnOrder, MapLine};
use crate::planes::Planes;
use crate::row::Row;
use crate::simd_level::{Level, at_level};
use crate::slice_plane::SlicePlane;
use crate::slices::{Fan, Major, Slice, SliceSet};

/// What all slices of a frame share.
pub struct SlicePass<'a> {
    pub frame: &'a Frame<'a>,
    pub camera: &'a Camera,
    pub epipole: Epipole,
    pub slices: &'a SliceSet,
    pub bands: Bands,
    /// One factorisation a distinct extinction.
    pub factors: &'a [Factors],
    /// Light rays end where `length / (smallest 1/sin β of their band)` is reached: the length of the factors'
    /// domain, a distance along a view ray.
    pub lengths: &'a [f64],
    pub layer: ShadowLayer<'a>,
    pub integrator: Integrator,
    pub level: Level,
    pub planes: &'a Planes,
}

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct SliceScratch {
    row: Row,
    index: RunIndex,
    /// Per column of a fan: the first pixel behind the slice before, this slice, and the next one.
    borders: [Vec<i32>; 3],
    /// 1/sin β per column.
    cosecants: Vec<f32>,
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
    pub fn reserve(&mut self, size: [u32; 2], map_side: usize, spacing: f64, terms: usize) {
        let columns = size[0].max(size[1]) as usize;
        // A pixel is in the gaps beside a slice if it is within a spacing of it, measured across; 45° slices are √2
        // wider along a column.
        let queries = columns * (2 * ((1.5 * spacing).ceil() as usize + 1));
        let runs = 2 * map_side + 8;
        self.row.clear(runs);
        for border in &mut self.borders {
            border.clear();
            border.reserve(columns);
        }
        self.cosecants.clear();
        self.cosecants.resize(columns, 1.0);
        self.queries.clear();
        self.queries.reserve(queries);
        let grow = |buffer: &mut Vec<f32>, length: usize| buffer.resize(length.max(buffer.len()), 0.0);
        grow(&mut self.prefix, (runs + 1) * terms);
        grow(&mut self.ends, queries * terms);
        grow(&mut self.sums, queries * terms);
        self.integrator.reserve(runs, columns, queries, terms);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let queries = &self.queries;
        self.row.memory_bytes()
            + self.integrator.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * (self.borders.iter().map(Vec::capacity).sum::<usize>()
                + self.cosecants.capacity()
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
        plane.cosecants(order.columns[0], &mut scratch.cosecants[..to - from]);

        let reach = self.ask(fan, slices, index, borders, from, order, scratch);
        self.rectify(&plane, order, reach, scratch);
        scratch.index.fill(&scratch.row, reach);
        let starts = scratch.row.starts();
        let queries = &mut scratch.queries;
        for &gamma in &queries.gammas {
            queries.runs.push(scratch.index.find(starts, gamma));
        }
        scratch.counts.queries += queries.gammas.len() as u64;
        scratch.counts.runs += scratch.row.len() as u64;

        // Columns of one band follow each other.
        let (mut first, count) = (0, scratch.queries.columns.len());
        while first < count {
            let band_of =
                |query: usize| self.bands.of(scratch.cosecants[scratch.queries.columns[query] as usize]);
            let band = band_of(first);
            let last = (first + 1..count).find(|&query| band_of(query) != band).unwrap_or(count);
            for channel in 0..self.factors.len() {
                match self.factors[channel].lanes() {
                    1 => self.band::<1>(band, first..last, channel, order, scratch),
                    2 => self.band::<2>(band, first..last, channel, order, scratch),
                    4 => self.band::<4>(band, first..last, channel, order, scratch),
                    _ => self.band::<8>(band, first..last, channel, order, scratch),
                }
            }
            first = last;
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
        let longest = self.lengths.iter().fold(0.0f64, |a, &b| a.max(b)).min(self.frame.max_distance());
        let longest = longest.min(f64::from(f32::MAX)) as f32;
        let strides = match fan.major {
            Major::X => [1, width],
            Major::Y => [width, 1],
        };
        let neighbours = [&slices[index.saturating_sub(1)], &slices[(index + 1).min(slices.len() - 1)]];
        let queries = &mut scratch.queries;
        queries.clear();
        let mut reach = 0.0f32;
        for (offset, &cosecant) in scratch.cosecants[..order.count()].iter().enumerate() {
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
            let sine = 1.0 / cosecant;
            for pixel in start..end {
                let behind = pixel >= middle;
                let distance = (f64::from(pixel) + 0.5 - own).abs() * gaps[usize::from(behind)];
                let place = column * strides[0] + pixel as u32 * strides[1];
                let gamma = depth[place as usize].min(longest) * sine;
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
        let projection = self.layer.projection();
        let eye = self.camera.eye();
        scratch.row.clear(0);
        scratch.row.push(0.0, columns);
        if let Some(line) = MapLine::sun(projection, eye, plane, order, f64::from(reach)) {
            let behind = if self.epipole.outward { columns } else { 0 };
            scratch.counts.texels += u64::from(line.columns);
            scratch.row.append(self.level, &line, self.layer.texels(), columns, behind);
            let [gamma, per_texel] = line.gamma;
            scratch.row.push(gamma + per_texel * line.length, columns);
        }
        scratch.row.finish();
    }

    /// Answers the queries of one band for one extinction.
    #[inline(always)]
    fn band<const N: usize>(
        &self,
        band: u32,
        range: std::ops::Range<usize>,
        channel: usize,
        order: ColumnOrder,
        scratch: &mut SliceScratch,
    ) {
        let factors = &self.factors[channel];
        let start = self.bands.start(band);
        let table = Table::<N>::new(factors.prefix(), start / self.lengths[channel]);
        let queries = &scratch.queries;
        let gammas = &queries.gammas[range.clone()];
        let ends = &mut scratch.ends.as_chunks_mut::<N>().0[..gammas.len()];
        for (end, &gamma) in ends.iter_mut().zip(gammas) {
            *end = table.at(gamma);
        }
        let runs = queries.runs[range.clone()].iter().max().map_or(0, |&run| run as usize + 1);
        let prefix = &mut scratch.prefix.as_chunks_mut::<N>().0[..=runs];
        for (value, &gamma) in prefix.iter_mut().zip(scratch.row.starts()) {
            *value = table.at(gamma);
        }
        let ranks = &queries.ranks[range.clone()];
        let (a, b) = (ranks[0], ranks[ranks.len() - 1]);
        let problem = Problem {
            lit: &scratch.row.lit()[..runs],
            prefix,
            tint: None,
            queries: Queries { ranks, runs: &queries.runs[range.clone()] },
            ends,
            columns: [a.min(b), a.max(b) + 1],
            ascending: order.ascending,
        };
        let sums = &mut scratch.sums.as_chunks_mut::<N>().0[..gammas.len()];
        integrate(self.integrator, &problem, &mut scratch.integrator, sums);

        let per_cosecant = 1.0 / (start * (self.bands.ratio - 1.0)) as f32;
        let weights = Table::<N>::new(factors.weights(), f64::from(per_cosecant));
        for ((query, sum), end) in range.zip(&*sums).zip(&*ends) {
            let cosecant = scratch.cosecants[queries.columns[query] as usize];
            let view = weights.at((cosecant - start as f32).max(0.0));
            let (mut lit, mut whole) = (0.0, 0.0);
            for term in 0..N {
                lit += view[term] * sum[term];
                whole += view[term] * end[term];
            }
            // A ray without length has no shadow, and its radiance is 0 anyway.
            let share = if whole > 0.0 { (lit / whole).clamp(0.0, 1.0) } else { 1.0 };
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
