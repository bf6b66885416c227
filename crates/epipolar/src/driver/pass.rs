//! The slices of a fan, one after the other, and the pixels in the gaps between them.
//!
//! Each pixel lies in one gap and is answered by the two slices beside it, with its own depth, at its own column: no
//! rectified result is resampled, so nothing blurs over depth edges. Between the two answers it is interpolated. Where
//! they differ by more than the tolerance a further slice goes through the middle of the gap, for those pixels alone,
//! and again: shafts' edges get fine slices, open air keeps coarse ones. (The paper resamples rectified results, and
//! its slices are a pixel apart everywhere.)

use scatter_core::at_level;

use super::borders::Borders;
use super::pixels_between::{Grid, Offsets, PixelsBetween};
use super::queries::SliceQueries;
use super::refinement::{MOST_HALVINGS, Refinement};
use super::resampling::Resampling;
use super::shares::Shares;
use super::slice_integrator::{SliceIntegrator, SliceRoom};
use super::slice_view::{SliceAngles, SliceScene, SliceView};
use super::spacing_sample::{GapPixels, MOST_COLUMN_STRIDE, SpacingSample, Unoccluded};
use super::surfaces::{SharedColumns, Surfaces};
use crate::geometry::{ColumnOrder, Fan, FanPixels, Major, Slice};

/// What the slices of a frame share.
pub struct SlicePass<'a, I> {
    pub scene: SliceScene<'a>,
    pub integrator: &'a I,
    pub slices: &'a [Slice],
    pub shares: &'a Shares,
    pub refinement: Refinement,
    pub resampling: Resampling,
    /// Which pixels share answers, if any do.
    pub surfaces: Option<Surfaces>,
    /// Measures gaps instead of filling them.
    pub measures: Option<Measuring<'a>>,
    /// Where the pixels' rays end.
    pub ends: &'a [f32],
    /// Whether all texels are cut, whatever the integrator's settings are.
    pub is_exact: bool,
    /// One column in how many queries.
    pub column_stride: usize,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
    /// Where rays end that are longer.
    pub longest: f32,
}

/// What is measured of a gap.
#[derive(Clone, Copy)]
pub struct Measuring<'a> {
    /// The light that shares are shares of.
    pub light: &'a Unoccluded<'a>,
    /// Whether only what texels hide that are not cut is measured: of the line between two slices.
    pub cuts_alone: bool,
    /// From which error on, relative to a pixel's radiance, it is noted whether its ray ends on steps of the map.
    pub notes_steps: Option<f32>,
}

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct Worker<S> {
    /// Those of the integrator.
    pub scratch: S,
    angles: SliceAngles,
    queries: SliceQueries,
    /// Pixels of the gap before a slice and behind it.
    gaps: [PixelsBetween; 2],
    /// Pixels whose gap is halved: a list for each half, a pair a depth of halving.
    halves: [[PixelsBetween; 2]; MOST_HALVINGS as usize + 1],
    /// What a slice says that others are measured against, per channel, and what they say.
    line: [Vec<f32>; 3],
    found: Vec<f32>,
    /// The slice before, this one and the next one.
    lines: [Borders; 3],
    /// The gaps that were measured.
    pub sample: SpacingSample,
    /// Slices that were integrated, and what they were asked.
    pub counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub slices: u64,
    pub queries: u64,
}

impl<S> Worker<S> {
    /// Grows all buffers to what any slice of such a frame may need, with at most `gap` pixels on one side of it, but the
    /// integrator's; forgets what was counted.
    pub fn reserve(&mut self, room: &SliceRoom<'_>, gap: usize) {
        let SliceRoom { columns, queries, channels, .. } = *room;
        self.angles.reserve(columns);
        self.queries.clear(queries, channels);
        for list in self.gaps.iter_mut().chain(self.halves.iter_mut().flatten()) {
            list.clear(gap, channels);
            list.list_none(columns, MOST_COLUMN_STRIDE as usize, channels);
        }
        self.lines.iter_mut().for_each(|line| line.reserve(columns));
        self.line.iter_mut().for_each(|line| line.reserve(gap.saturating_sub(line.len())));
        self.found.reserve(gap.saturating_sub(self.found.len()));
        self.counts = Counts::default();
    }

    /// Most pixels of a gap in an image of a size.
    pub fn most_between([width, height]: [usize; 2], spacing: f64) -> usize {
        // A pixel is beside a slice if it is within a spacing of it, measured across; 45° slices are √2 wider along a
        // column.
        (width.max(height) * ((1.5 * spacing).ceil() as usize + 1)).min(width * height)
    }

    /// Bytes held, but those of the integrator.
    pub fn memory_bytes(&self) -> usize {
        let lists = self.gaps.iter().chain(self.halves.iter().flatten());
        self.angles.memory_bytes()
            + self.queries.memory_bytes()
            + lists.map(PixelsBetween::memory_bytes).sum::<usize>()
            + self.lines.iter().map(Borders::memory_bytes).sum::<usize>()
            + self.sample.memory_bytes()
            + 4 * (self.line.iter().map(Vec::capacity).sum::<usize>() + self.found.capacity())
    }
}

impl<I: SliceIntegrator> SlicePass<'_, I> {
    /// Fills the pixels of gaps `range` of a fan.
    pub fn run(
        &self,
        fan: &Fan,
        pixels: &FanPixels,
        range: std::ops::Range<usize>,
        worker: &mut Worker<I::Scratch>,
    ) {
        let slices = &self.slices[fan.first..][..fan.count];
        let mut lines = std::mem::take(&mut worker.lines);
        let [before, own, next] = &mut lines;
        // The first slice has no gap of this range before it: its own line stands in for the one before.
        self.follow(own, fan, pixels, slices, range.start);
        let all = pixels.ranges.len();
        worker.gaps[1].list_none(all, self.column_stride, self.channels);
        for index in range.start..=range.end {
            if index < range.end {
                self.follow(next, fan, pixels, slices, index + 1);
            }
            let has_before = index > range.start;
            let first = if has_before { &*before } else { &*own };
            let last = if index < range.end { &*next } else { &*own };
            worker.gaps.swap(0, 1);
            self.slice(fan, pixels, &slices[index], [first, own, last], worker);
            if has_before {
                let between = [&slices[index - 1], &slices[index]];
                match self.measures {
                    Some(measuring) => self.measure_gap(fan, between, measuring, index, worker),
                    None => self.finish_gap(fan, between, worker),
                }
            }
            std::mem::swap(before, own);
            std::mem::swap(own, next);
        }
        worker.lines = lines;
    }

    /// Integrates a slice for the pixels beside it: those of the gap before it, and those of the gap behind it, which it lists.
    fn slice(
        &self,
        fan: &Fan,
        pixels: &FanPixels,
        slice: &Slice,
        lines: [&Borders; 3],
        worker: &mut Worker<I::Scratch>,
    ) {
        let channels = self.channels;
        let [first, own, last] = lines;
        let all = pixels.ranges.len();
        let busy = |column: usize| {
            first.pixels[column] < own.pixels[column] || own.pixels[column] < last.pixels[column]
        };
        let Some(from) = (0..all).find(|&column| busy(column)) else {
            worker.gaps[1].list_none(all, self.column_stride, channels);
            return;
        };
        let to = (from..all).rev().find(|&column| busy(column)).unwrap_or(from) + 1;
        let first_column = pixels.columns[0];
        let [from, to] = match self.shared(pixels) {
            Some(shared) => shared.surfaces.widened(first_column, [from, to], all),
            None => [from, to],
        };
        let width = self.scene.frame.size()[0];
        let strides = if fan.major == Major::X { [1, width] } else { [width, 1] };
        let first = first_column + from as u32;
        let offsets = self.offsets(first_column, from..to, all);
        let shared = self.shared(pixels);
        let depth = self.ends;
        let Worker { queries, gaps, .. } = worker;
        at_level!(self.scene.simd, {
            let [before, behind] = &mut *gaps;
            behind.list(Grid { first_column, strides }, [own, last], offsets, channels);
            behind.find_ends(depth, self.longest);
            if let Some(shared) = shared {
                behind.find_shared(shared, [own, last]);
            }
            match (self.resampling, shared) {
                (_, Some(shared)) => {
                    queries.merge_shared([before, behind], shared, [from, to], (&own.ends, channels));
                }
                (Resampling::Pixels, None) => {
                    queries.merge([before, behind], first_column, offsets.stride, first, channels);
                }
                (Resampling::Rectified, None) => {
                    queries.merge_rectified([before, behind], lines, offsets, from, channels);
                }
            }
        });
        self.integrate(slice, fan, [first, first_column + to as u32], self.is_exact, worker);
        let Worker { queries, gaps: [before, behind], .. } = worker;
        at_level!(self.scene.simd, {
            for channel in 0..channels {
                if let Some(SharedColumns { surfaces, .. }) = shared {
                    queries.interpolate(surfaces, first, to - from, channel);
                    before.answer_shared(1, channel, queries, first);
                    behind.answer_shared(0, channel, queries, first);
                } else {
                    let shares = queries.shares(channel);
                    before.answer(1, channel, shares);
                    behind.answer(0, channel, shares);
                }
            }
        });
    }

    /// How the pixels of a fan share answers; what is measured shares none.
    fn shared(&self, pixels: &FanPixels) -> Option<SharedColumns> {
        let surfaces = self.surfaces.filter(|_| self.measures.is_none())?;
        Some(SharedColumns { surfaces, fan: pixels.columns })
    }

    /// Follows a slice through its fan.
    fn follow(&self, line: &mut Borders, fan: &Fan, pixels: &FanPixels, slices: &[Slice], index: usize) {
        line.follow(self.scene.simd, fan, pixels, slices, index);
        if let Some(SharedColumns { surfaces, .. }) = self.shared(pixels) {
            let [width, height] = self.scene.frame.size();
            let (strides, breadth) =
                if fan.major == Major::X { ([1, width], height) } else { ([width, 1], width) };
            let grid = Grid { first_column: pixels.columns[0], strides };
            surfaces.find_ends(line, pixels, grid, self.ends, (breadth, self.longest));
        }
    }

    /// The columns whose pixels query: all of a range, or a sample of them.
    fn offsets(&self, first_column: u32, range: std::ops::Range<usize>, all: usize) -> Offsets {
        let (stride, first) = (self.column_stride, first_column as usize);
        let start = (first + range.start).next_multiple_of(stride) - first;
        Offsets { start, end: range.end.max(start), stride, all }
    }

    /// Gives the pixels of a gap their shares, or halves it.
    fn finish_gap(&self, fan: &Fan, between: [&Slice; 2], worker: &mut Worker<I::Scratch>) {
        let mut pixels = std::mem::take(&mut worker.gaps[0]);
        if self.finish(&mut pixels, 0) {
            let mut lists = std::mem::take(&mut worker.halves[0]);
            at_level!(self.scene.simd, lists[0].take_doubtful(&pixels, None, self.channels));
            self.halve(fan, between, 0, &mut lists[0], worker);
            worker.halves[0] = lists;
        }
        worker.gaps[0] = pixels;
    }

    /// Compares what a line between a gap's two slices gets, interpolated and halved as the pixels beside it are, with what
    /// the slice through it says.
    fn measure_gap(
        &self,
        fan: &Fan,
        between: [&Slice; 2],
        measuring: Measuring<'_>,
        index: usize,
        worker: &mut Worker<I::Scratch>,
    ) {
        if worker.gaps[0].is_empty() {
            return;
        }
        let [a, b] = between;
        // Pixels lie anywhere in their gap: so do the lines, evenly over gaps that follow each other (golden ratio).
        let part = (0.5 + 0.618_033_988_749_895 * index as f64).fract();
        let line = Slice::through(&self.scene.epipole, fan.major, a.exit + part * (b.exit - a.exit));
        let across = |slice: &Slice| slice.minor_at(fan.major, 0.5 + f64::from(worker.gaps[0].span()[0]));
        let [from, own, to] = [a, &line, b].map(across);
        let part = if to > from { ((own - from) / (to - from)).clamp(0.0, 1.0) as f32 } else { 0.5 };
        worker.gaps[0].place_at(part);
        let pixels = std::mem::take(&mut worker.gaps[0]);
        self.query_all(&line, fan, &pixels, true, worker);
        for (channel, line) in worker.line.iter_mut().enumerate().take(self.channels) {
            line.clear();
            line.extend_from_slice(worker.queries.shares(channel));
        }
        if measuring.cuts_alone {
            self.query_all(&line, fan, &pixels, false, worker);
            worker.gaps[0] = pixels;
        } else {
            // What the pixels would get is written where they are, and overwritten once all of them are filled.
            worker.gaps[0] = pixels;
            self.finish_gap(fan, between, worker);
        }
        let Worker { gaps: [pixels, _], line, found, queries, sample, .. } = worker;
        let on_steps = measuring.notes_steps.map(|counts| (self.scene.frame, counts));
        let at = GapPixels { places: pixels.places(), ends: pixels.ends(), on_steps };
        sample.begin();
        for (channel, line) in line.iter().enumerate().take(self.channels) {
            if measuring.cuts_alone {
                found.clear();
                found.extend_from_slice(queries.shares(channel));
            } else {
                pixels.read(self.shares, channel, found);
            }
            let weighted_by = (self.channels > 1).then_some(channel);
            sample.count(self.scene.simd, measuring.light, at, weighted_by, (found, line));
        }
    }

    /// Queries a slice for pixels that come column by column.
    fn query_all(
        &self,
        slice: &Slice,
        fan: &Fan,
        pixels: &PixelsBetween,
        is_exact: bool,
        worker: &mut Worker<I::Scratch>,
    ) {
        at_level!(self.scene.simd, worker.queries.take(pixels, self.channels));
        let [first, last] = pixels.span();
        self.integrate(slice, fan, [first, last + 1], is_exact, worker);
    }

    /// Writes the shares of the pixels of a gap; returns whether some are left to slices nearer to them.
    fn finish(&self, pixels: &mut PixelsBetween, depth: u32) -> bool {
        let channels = self.channels;
        at_level!(self.scene.simd, {
            let halves = depth < self.refinement.halvings;
            let differ = (halves || self.refinement.walks_rest) && pixels.doubt(&self.refinement, channels);
            pixels.put(self.shares, channels);
            differ && halves
        })
    }

    /// Puts a slice through the middle of a gap for some of its pixels, which come column by column.
    fn halve(
        &self,
        fan: &Fan,
        between: [&Slice; 2],
        depth: u32,
        pixels: &mut PixelsBetween,
        worker: &mut Worker<I::Scratch>,
    ) {
        let channels = self.channels;
        let [a, b] = between;
        let middle = Slice::through(&self.scene.epipole, fan.major, 0.5 * (a.exit + b.exit));
        self.query_all(&middle, fan, pixels, self.is_exact, worker);
        at_level!(self.scene.simd, {
            let shares = [0, 1, 2].map(|channel| worker.queries.shares(channel));
            pixels.halve(fan.major, [a, &middle, b], shares, channels);
        });
        if !self.finish(pixels, depth + 1) {
            return;
        }
        let below = depth as usize + 1;
        let mut halves = std::mem::take(&mut worker.halves[below]);
        for (side, half) in halves.iter_mut().enumerate() {
            at_level!(self.scene.simd, half.take_doubtful(pixels, Some(side), channels));
            if !half.is_empty() {
                let between = if side == 0 { [a, &middle] } else { [&middle, b] };
                self.halve(fan, between, depth + 1, half, worker);
            }
        }
        worker.halves[below] = halves;
    }

    /// Has the queries of a slice answered, whose columns count from `columns[0]`.
    fn integrate(
        &self,
        slice: &Slice,
        fan: &Fan,
        columns: [u32; 2],
        is_exact: bool,
        worker: &mut Worker<I::Scratch>,
    ) {
        let order = ColumnOrder { columns, ascending: fan.ascending == self.scene.epipole.outward };
        let Worker { scratch, angles, queries, counts, .. } = worker;
        counts.slices += 1;
        counts.queries += queries.len() as u64;
        at_level!(self.scene.simd, {
            let slice = SliceView::new(self.scene, *slice, fan.major, order, angles);
            let reach = queries.find_light_rays(slice.light, slice.sines(), slice.cosines());
            let slice = slice.up_to(reach);
            let slice = if is_exact { slice.exactly() } else { slice };
            self.integrator.integrate(&slice, queries, scratch);
        });
    }
}
