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
use crate::fan_pixels::FanPixels;
use crate::integrand::Integrand;
use crate::probe::{Aim, COLUMN_STRIDE, Probe};
use crate::shares::Shares;
use crate::slices::{Fan, Major, Slice};

/// Most times that a gap is halved. Every one doubles the slices in the worst case.
pub const MOST_HALVINGS: u32 = 6;

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

/// When a gap gets a slice of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Largest difference of two neighbouring slices' answers that is interpolated over, relative to the pixel's
    /// radiance.
    pub tolerance: f32,
    /// Share of the unoccluded radiance below which differences are measured against it.
    pub floor: f32,
    /// How often a gap may be halved.
    pub halvings: u32,
    /// Whether pixels that are still in doubt then are walked through the map, ray by ray.
    pub walks_rest: bool,
}

/// A pixel between two slices.
#[derive(Debug, Clone, Copy)]
struct GapPixel {
    column: u32,
    /// Index in the image.
    place: u32,
    /// Distance from the first slice over the gap's width, 0 to 1.
    part: f32,
    /// Answers of the two slices, per channel.
    before: [f32; 3],
    behind: [f32; 3],
}

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct Worker {
    buffers: SliceBuffers,
    asks: Asks,
    /// Pixels of the gap before a slice and behind it.
    gaps: [Vec<GapPixel>; 2],
    /// Pixels whose gap is halved: a list for each half, a pair a level.
    levels: [[Vec<GapPixel>; 2]; MOST_HALVINGS as usize + 1],
    /// Minor coordinate of the slice before, this one and the next one in each column, less ½; and the first pixel
    /// behind them.
    lines: [Line; 3],
    /// Pixels that one slice may have to answer.
    most_asks: usize,
}

#[derive(Debug, Default)]
struct Line {
    minors: Vec<f32>,
    borders: Vec<i32>,
}

impl Worker {
    /// Grows all buffers to what any slice of such a frame may need.
    pub fn reserve(&mut self, frame: &Frame<'_>, map_side: usize, spacing: f64, integrand: &Integrand) {
        let [width, height] = frame.size();
        let columns = width.max(height) as usize;
        // A pixel is beside a slice if it is within a spacing of it, measured across; 45° slices are √2 wider along a
        // column.
        self.most_asks = columns * (2 * ((1.5 * spacing).ceil() as usize + 1));
        self.buffers.reserve(frame, map_side, self.most_asks, integrand);
        self.asks.clear(columns, self.most_asks);
        for gap in &mut self.gaps {
            gap.clear();
            gap.reserve(self.most_asks);
        }
        for list in self.levels.iter_mut().flatten() {
            list.clear();
            list.reserve(self.most_asks);
        }
        for line in &mut self.lines {
            line.minors.clear();
            line.minors.reserve(columns);
            line.borders.clear();
            line.borders.reserve(columns);
        }
        self.buffers.counts = Default::default();
    }

    /// What was counted since [`Self::reserve`].
    pub fn counts(&self) -> crate::answer::Counts {
        self.buffers.counts
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let pixels = self.gaps.iter().chain(self.levels.iter().flatten()).map(Vec::capacity).sum::<usize>();
        self.buffers.memory_bytes()
            + self.asks.memory_bytes()
            + pixels * size_of::<GapPixel>()
            + self
                .lines
                .iter()
                .map(|line| 4 * (line.minors.capacity() + line.borders.capacity()))
                .sum::<usize>()
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
        worker.gaps[1].clear();
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
    #[inline(always)]
    fn slice(&self, fan: &Fan, pixels: &FanPixels, slice: &Slice, lines: [&Line; 3], worker: &mut Worker) {
        let [first, own, last] = lines;
        worker.asks.clear(pixels.ranges.len(), worker.most_asks);
        let gap_behind = &mut worker.gaps[1];
        gap_behind.clear();
        let busy = |column: usize| first.borders[column] < last.borders[column];
        let all = pixels.ranges.len();
        let Some(from) = (0..all).find(|&column| busy(column)) else { return };
        let to = (from..all).rev().find(|&column| busy(column)).unwrap_or(from) + 1;
        let columns = [pixels.columns[0] + from as u32, pixels.columns[0] + to as u32];
        let width = self.frame.size()[0];
        let strides = if fan.major == Major::X { [1, width] } else { [width, 1] };
        let depth = self.frame.depth().texels();
        for offset in from..to {
            let (start, middle, end) = (first.borders[offset], own.borders[offset], last.borders[offset]);
            if start == end {
                continue;
            }
            let column = pixels.columns[0] + offset as u32;
            if !self.is_asked(column) {
                continue;
            }
            worker.asks.begin((offset - from) as u32);
            if self.resampling == Resampling::Rectified {
                // One view ray a column, as long as the pixel nearest to the slice.
                let nearest = (own.minors[offset].round() as i32).clamp(start, end - 1);
                let place = column * strides[0] + nearest as u32 * strides[1];
                worker.asks.push(self.answerer.end(depth[place as usize]));
            }
            let (line, gap) = (own.minors[offset], last.minors[offset] - own.minors[offset]);
            for pixel in start..end {
                let place = column * strides[0] + pixel as u32 * strides[1];
                if self.resampling == Resampling::Pixels {
                    worker.asks.push(self.answerer.end(depth[place as usize]));
                }
                if pixel >= middle {
                    let part = if gap > 0.0 { ((pixel as f32 - line) / gap).clamp(0.0, 1.0) } else { 0.5 };
                    gap_behind.push(GapPixel { column, place, part, before: [0.0; 3], behind: [0.0; 3] });
                }
            }
        }
        self.answer(slice, fan, columns, worker);
        let [gap_before, gap_behind] = &mut worker.gaps;
        // Hand out: in each column first the pixels before the slice, then those behind it.
        for channel in 0..self.answerer.channels {
            let mut shares = worker.asks.shares(channel).iter();
            let (mut before, mut behind) = (gap_before.iter_mut(), gap_behind.iter_mut());
            for offset in from..to {
                let (start, middle, end) = (first.borders[offset], own.borders[offset], last.borders[offset]);
                if !self.is_asked(pixels.columns[0] + offset as u32) {
                    continue;
                }
                if self.resampling == Resampling::Rectified && start < end {
                    let share = shares.next().copied().unwrap_or(1.0);
                    before
                        .by_ref()
                        .take((middle.clamp(start, end) - start) as usize)
                        .for_each(|pixel| pixel.behind[channel] = share);
                    behind
                        .by_ref()
                        .take((end - middle.clamp(start, end)) as usize)
                        .for_each(|pixel| pixel.before[channel] = share);
                    continue;
                }
                let counts = [middle.clamp(start, end) - start, end - middle.clamp(start, end)];
                for (pixel, &share) in before.by_ref().take(counts[0] as usize).zip(shares.by_ref()) {
                    pixel.behind[channel] = share;
                }
                for (pixel, &share) in behind.by_ref().take(counts[1] as usize).zip(shares.by_ref()) {
                    pixel.before[channel] = share;
                }
            }
        }
    }

    /// Whether a column's pixels ask: all, or a sample of them.
    #[inline(always)]
    fn is_asked(&self, column: u32) -> bool {
        self.probe.is_none() || column.is_multiple_of(COLUMN_STRIDE)
    }

    /// Gives the pixels of a gap their shares, or halves it.
    #[inline(always)]
    fn finish_gap(&self, fan: &Fan, between: [&Slice; 2], worker: &mut Worker) {
        let mut lists = std::mem::take(&mut worker.levels[0]);
        let split = &mut lists[0];
        split.clear();
        for pixel in &worker.gaps[0] {
            self.finish_pixel(pixel, 0, split);
        }
        if !split.is_empty() {
            self.halve(fan, between, 0, split, worker);
        }
        worker.levels[0] = lists;
    }

    /// Compares what a gap's two slices say of its middle with what a slice there says.
    fn probe_gap(&self, fan: &Fan, between: [&Slice; 2], (probe, aim): (&Probe, Aim), worker: &mut Worker) {
        let pixels = std::mem::take(&mut worker.gaps[0]);
        if !pixels.is_empty() {
            let [a, b] = between;
            let middle = Slice::through(&self.answerer.epipole, fan.major, 0.5 * (a.exit + b.exit));
            self.ask_all(&middle, fan, &pixels, worker);
            for channel in 0..self.answerer.channels {
                for (pixel, &share) in pixels.iter().zip(worker.asks.shares(channel)) {
                    let (a, b) = (pixel.before[channel], pixel.behind[channel]);
                    let allowed = aim.error * share.max(self.refinement.floor);
                    // A difference that the tolerance sees is left to a gap as fine as halvings make it.
                    let Refinement { tolerance, floor, halvings, .. } = self.refinement;
                    let seen = (b - a).abs() > 2.0 * tolerance * (0.5 * (a + b)).max(floor);
                    let finer = if seen { 1.0 / (1u32 << halvings) as f32 } else { 1.0 };
                    let error = finer * (share - 0.5 * (a + b)).abs();
                    probe.count(share, error, allowed);
                }
            }
        }
        worker.gaps[0] = pixels;
    }

    /// Asks a slice about pixels that come column by column.
    fn ask_all(&self, slice: &Slice, fan: &Fan, pixels: &[GapPixel], worker: &mut Worker) {
        let columns = [pixels[0].column, pixels[pixels.len() - 1].column + 1];
        worker.asks.clear((columns[1] - columns[0]) as usize, worker.most_asks);
        let depth = self.frame.depth().texels();
        let mut column = None;
        for pixel in pixels {
            if column != Some(pixel.column) {
                column = Some(pixel.column);
                worker.asks.begin(pixel.column - columns[0]);
            }
            worker.asks.push(self.answerer.end(depth[pixel.place as usize]));
        }
        self.answer(slice, fan, columns, worker);
    }

    /// Writes a pixel's share, or lists it to be answered by a slice nearer to it.
    #[inline(always)]
    fn finish_pixel(&self, pixel: &GapPixel, level: u32, split: &mut Vec<GapPixel>) {
        let Refinement { tolerance, floor, halvings, walks_rest } = self.refinement;
        let channels = self.answerer.channels;
        if level < halvings || walks_rest {
            // What a shadow's edge somewhere in the gap would change: most in its middle, nothing at a slice.
            let doubt = 2.0 * pixel.part * (1.0 - pixel.part);
            let differs = (0..channels).any(|channel| {
                let (a, b) = (pixel.before[channel], pixel.behind[channel]);
                (b - a).abs() * doubt > tolerance * (0.5 * (a + b)).max(floor)
            });
            if differs && level < halvings {
                split.push(*pixel);
                return;
            }
            if differs && walks_rest {
                return; // The slot stays empty.
            }
        }
        for channel in 0..channels {
            let (a, b) = (pixel.before[channel], pixel.behind[channel]);
            if a.min(b) < 0.0 {
                continue; // In the ring: the slot stays empty.
            }
            self.shares.put(pixel.place as usize, channel, a + pixel.part * (b - a));
        }
    }

    /// Puts a slice through the middle of a gap for some of its pixels, which come column by column.
    fn halve(&self, fan: &Fan, between: [&Slice; 2], level: u32, pixels: &[GapPixel], worker: &mut Worker) {
        let [a, b] = between;
        let middle = Slice::through(&self.answerer.epipole, fan.major, 0.5 * (a.exit + b.exit));
        self.ask_all(&middle, fan, pixels, worker);
        // Both halves take their answers before one of them needs the room.
        let below = level as usize + 1;
        let mut halves = std::mem::take(&mut worker.levels[below]);
        halves.iter_mut().for_each(Vec::clear);
        for (index, pixel) in pixels.iter().enumerate() {
            let along = f64::from(pixel.column) + 0.5;
            let [from, cut, to] = [a, &middle, b].map(|slice| slice.minor_at(fan.major, along));
            let cut = if to > from { ((cut - from) / (to - from)) as f32 } else { 0.5 };
            let mut own = *pixel;
            let side = usize::from(pixel.part >= cut);
            for channel in 0..self.answerer.channels {
                let share = worker.asks.shares(channel)[index];
                if side == 0 { own.behind[channel] = share } else { own.before[channel] = share }
            }
            let [offset, width] = if side == 0 { [pixel.part, cut] } else { [pixel.part - cut, 1.0 - cut] };
            own.part = if width > 0.0 { (offset / width).clamp(0.0, 1.0) } else { 0.5 };
            self.finish_pixel(&own, level + 1, &mut halves[side]);
        }
        for (side, half) in halves.iter().enumerate() {
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

impl Line {
    /// Follows slice `index` of a fan through its columns.
    fn follow(&mut self, level: Level, fan: &Fan, pixels: &FanPixels, slices: &[Slice], index: usize) {
        let slice = &slices[index];
        let start = slice.minor_at(fan.major, f64::from(pixels.columns[0]) + 0.5) - 0.5;
        let count = pixels.ranges.len();
        self.minors.resize(count, 0.0);
        self.borders.resize(count, 0);
        at_level!(level, {
            let lines = self.minors.iter_mut().zip(&mut self.borders).zip(&pixels.ranges);
            for (offset, ((minor, border), range)) in lines.enumerate() {
                let exact = start + slice.slope * offset as f64;
                *minor = exact as f32;
                *border = (exact.ceil() as i32).clamp(range[0], range[1]);
            }
        });
        // The outermost lines are shared with other fans, and every pixel is on one side of them.
        if index == 0 || index + 1 == slices.len() {
            let end = usize::from(index > 0);
            for (border, range) in self.borders.iter_mut().zip(&pixels.ranges) {
                *border = range[end];
            }
        }
    }
}
