//! The slices of a fan, one after the other, and the pixels in the gaps between them.
//!
//! Each pixel lies in one gap and is answered by the two slices beside it, with its own depth, at its own column: no
//! rectified result is resampled, so nothing blurs over depth edges. Between the two answers it is interpolated. Where
//! they differ by more than the tolerance a further slice goes through the middle of the gap, for those pixels alone,
//! and again: shafts' edges get fine slices, open air keeps coarse ones. (The paper resamples rectified results, and
//! its slices are a pixel apart everywhere.)

use scatter_core::{Frame, Level, at_level};

use crate::answer::{Answerer, SliceBuffers};
use crate::asks::Asks;
use crate::borders::Borders;
use crate::fan_pixels::FanPixels;
use crate::gap_pixels::{GapPixels, Grid, Offsets};
use crate::integrand::Integrand;
use crate::probe::{Aim, COLUMN_STRIDE, Probe};
use crate::refinement::{MOST_HALVINGS, Refinement};
use crate::shares::Shares;
use crate::slices::{Fan, Major, Slice};

/// What the slices of a frame share.
pub struct SlicePass<'a> {
    pub frame: &'a Frame<'a>,
    pub answerer: Answerer<'a>,
    pub slices: &'a [Slice],
    pub shares: &'a Shares,
    pub refinement: Refinement,
    pub resampling: Resampling,
    /// Measures gaps instead of filling them.
    pub probe: Option<(&'a Probe, Aim)>,
    pub level: Level,
}

/// How pixels get a slice's answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resampling {
    /// Every pixel asks with its own depth.
    #[default]
    Pixels,
    /// The paper's: a slice is integrated for one view ray a column, with the depth of the pixel nearest to it, and
    /// pixels interpolate between the results.
    Rectified,
}

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct Worker {
    buffers: SliceBuffers,
    asks: Asks,
    /// Pixels of the gap before a slice and behind it.
    gaps: [GapPixels; 2],
    /// Pixels whose gap is halved: a list for each half, a pair a level.
    levels: [[GapPixels; 2]; MOST_HALVINGS as usize + 1],
    /// The slice before, this one and the next one.
    lines: [Borders; 3],
}

impl Worker {
    /// Grows all buffers to what any slice of such a frame may need.
    pub fn reserve(
        &mut self,
        frame: &Frame<'_>,
        map_side: usize,
        spacing: f64,
        integrand: &Integrand,
        channels: usize,
    ) {
        let [width, height] = frame.size();
        let columns = width.max(height) as usize;
        // A pixel is beside a slice if it is within a spacing of it, measured across; 45° slices are √2 wider along a
        // column.
        let most_asks = columns * (2 * ((1.5 * spacing).ceil() as usize + 1));
        self.buffers.reserve(frame, map_side, most_asks, integrand);
        self.asks.clear(most_asks, channels);
        for list in self.gaps.iter_mut().chain(self.levels.iter_mut().flatten()) {
            list.clear(most_asks / 2, channels);
            list.list_none(columns, COLUMN_STRIDE as usize, channels);
        }
        self.lines.iter_mut().for_each(|line| line.reserve(columns));
        self.buffers.counts = Default::default();
    }

    /// What was counted since [`Self::reserve`].
    pub fn counts(&self) -> crate::answer::Counts {
        self.buffers.counts
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = self.gaps.iter().chain(self.levels.iter().flatten());
        self.buffers.memory_bytes()
            + self.asks.memory_bytes()
            + lists.map(GapPixels::memory_bytes).sum::<usize>()
            + self.lines.iter().map(Borders::memory_bytes).sum::<usize>()
    }
}

impl SlicePass<'_> {
    /// Fills the pixels of gaps `range` of a fan.
    pub fn run(&self, fan: &Fan, pixels: &FanPixels, range: std::ops::Range<usize>, worker: &mut Worker) {
        let slices = &self.slices[fan.first..][..fan.count];
        let mut lines = std::mem::take(&mut worker.lines);
        let [before, own, next] = &mut lines;
        // The first slice has no gap of this range before it: its own line stands in for the one before.
        own.follow(self.level, fan, pixels, slices, range.start);
        let all = pixels.ranges.len();
        worker.gaps[1].list_none(all, self.stride(), self.answerer.channels);
        for index in range.start..=range.end {
            if index < range.end {
                next.follow(self.level, fan, pixels, slices, index + 1);
            }
            let has_before = index > range.start;
            let first = if has_before { &*before } else { &*own };
            let last = if index < range.end { &*next } else { &*own };
            worker.gaps.swap(0, 1);
            self.slice(fan, pixels, &slices[index], [first, own, last], worker);
            if has_before {
                let between = [&slices[index - 1], &slices[index]];
                match self.probe {
                    Some((probe, aim)) => self.probe_gap(fan, between, (probe, aim), worker),
                    None => self.finish_gap(fan, between, worker),
                }
            }
            std::mem::swap(before, own);
            std::mem::swap(own, next);
        }
        worker.lines = lines;
    }

    /// Answers the pixels beside a slice: those of the gap before it, and those of the gap behind it, which it lists.
    fn slice(&self, fan: &Fan, pixels: &FanPixels, slice: &Slice, lines: [&Borders; 3], worker: &mut Worker) {
        let channels = self.answerer.channels;
        let [first, own, last] = lines;
        let all = pixels.ranges.len();
        let busy = |column: usize| {
            first.pixels[column] < own.pixels[column] || own.pixels[column] < last.pixels[column]
        };
        let Some(from) = (0..all).find(|&column| busy(column)) else {
            worker.gaps[1].list_none(all, self.stride(), channels);
            return;
        };
        let to = (from..all).rev().find(|&column| busy(column)).unwrap_or(from) + 1;
        let first_column = pixels.columns[0];
        let width = self.frame.size()[0];
        let strides = if fan.major == Major::X { [1, width] } else { [width, 1] };
        let first = first_column + from as u32;
        let offsets = self.offsets(first_column, from..to, all);
        let Worker { asks, gaps, .. } = worker;
        at_level!(self.level, {
            let [before, behind] = &mut *gaps;
            behind.list(Grid { first_column, strides }, [own, last], offsets, channels);
            behind.find_ends(self.frame.depth().texels(), self.answerer.longest);
            match self.resampling {
                Resampling::Pixels => {
                    asks.merge([before, behind], first_column, offsets.stride, first, channels);
                }
                Resampling::Rectified => {
                    asks.merge_rectified([before, behind], lines, offsets, from, channels);
                }
            }
        });
        self.answer(slice, fan, [first, first_column + to as u32], worker);
        let Worker { asks, gaps: [before, behind], .. } = worker;
        at_level!(self.level, {
            for channel in 0..channels {
                before.answer(1, channel, asks.shares(channel));
                behind.answer(0, channel, asks.shares(channel));
            }
        });
    }

    /// The columns whose pixels ask: all of a range, or a sample of them.
    fn offsets(&self, first_column: u32, range: std::ops::Range<usize>, all: usize) -> Offsets {
        let (stride, first) = (self.stride(), first_column as usize);
        let start = (first + range.start).next_multiple_of(stride) - first;
        Offsets { start, end: range.end.max(start), stride, all }
    }

    /// One column in how many asks.
    fn stride(&self) -> usize {
        if self.probe.is_some() { COLUMN_STRIDE as usize } else { 1 }
    }

    /// Gives the pixels of a gap their shares, or halves it.
    fn finish_gap(&self, fan: &Fan, between: [&Slice; 2], worker: &mut Worker) {
        let mut pixels = std::mem::take(&mut worker.gaps[0]);
        if self.finish(&mut pixels, 0) {
            let mut lists = std::mem::take(&mut worker.levels[0]);
            at_level!(self.level, lists[0].take_doubtful(&pixels, None, self.answerer.channels));
            self.halve(fan, between, 0, &mut lists[0], worker);
            worker.levels[0] = lists;
        }
        worker.gaps[0] = pixels;
    }

    /// Compares what a gap's two slices say of its middle with what a slice there says.
    fn probe_gap(&self, fan: &Fan, between: [&Slice; 2], (probe, aim): (&Probe, Aim), worker: &mut Worker) {
        let pixels = std::mem::take(&mut worker.gaps[0]);
        if !pixels.is_empty() {
            let [a, b] = between;
            let middle = Slice::through(&self.answerer.epipole, fan.major, 0.5 * (a.exit + b.exit));
            self.ask_all(&middle, fan, &pixels, worker);
            for channel in 0..self.answerer.channels {
                let asked = worker.asks.shares(channel);
                at_level!(self.level, probe.count(aim, &self.refinement, pixels.both(channel), asked));
            }
        }
        worker.gaps[0] = pixels;
    }

    /// Asks a slice about pixels that come column by column.
    fn ask_all(&self, slice: &Slice, fan: &Fan, pixels: &GapPixels, worker: &mut Worker) {
        at_level!(self.level, worker.asks.take(pixels, self.answerer.channels));
        let [first, last] = pixels.span();
        self.answer(slice, fan, [first, last + 1], worker);
    }

    /// Writes the shares of the pixels of a gap; returns whether some are left to slices nearer to them.
    fn finish(&self, pixels: &mut GapPixels, level: u32) -> bool {
        let channels = self.answerer.channels;
        at_level!(self.level, {
            let halves = level < self.refinement.halvings;
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
        level: u32,
        pixels: &mut GapPixels,
        worker: &mut Worker,
    ) {
        let channels = self.answerer.channels;
        let [a, b] = between;
        let middle = Slice::through(&self.answerer.epipole, fan.major, 0.5 * (a.exit + b.exit));
        self.ask_all(&middle, fan, pixels, worker);
        at_level!(self.level, {
            let shares = [0, 1, 2].map(|channel| worker.asks.shares(channel));
            pixels.halve(fan.major, [a, &middle, b], shares, channels);
        });
        if !self.finish(pixels, level + 1) {
            return;
        }
        let below = level as usize + 1;
        let mut halves = std::mem::take(&mut worker.levels[below]);
        for (side, half) in halves.iter_mut().enumerate() {
            at_level!(self.level, half.take_doubtful(pixels, Some(side), channels));
            if !half.is_empty() {
                let between = if side == 0 { [a, &middle] } else { [&middle, b] };
                self.halve(fan, between, level + 1, half, worker);
            }
        }
        worker.levels[below] = halves;
    }

    fn answer(&self, slice: &Slice, fan: &Fan, columns: [u32; 2], worker: &mut Worker) {
        let way = (fan.major, fan.ascending);
        at_level!(
            self.level,
            self.answerer.answer(slice, way, columns, &mut worker.asks, &mut worker.buffers)
        );
    }
}
