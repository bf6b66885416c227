//! Back to pixels: each pixel between two slices from the two samples beside it on either (Yusov 2012, Section 6.6).
//!
//! The pixels of a gap come column by column (row by row in a steep fan), so that the four samples of a column are fetched once
//! for all of its pixels. Pixels that no sample serves are listed, to be marched by their own rays, or, without correction,
//! take the sample that is nearest in depth.

use epipolar::driver::{Borders, Shares};
use epipolar::geometry::{Fan, FanPixels, Major};
use scatter_core::Frame;

use super::bilateral::{LEAST_WEIGHT, weight};
use super::lattice::Lattice;
use super::line_columns::LineColumns;
use super::line_samples::LineSamples;

/// Pixels that wait to be marched before a gap goes on.
pub const LEFT_AT_ONCE: usize = 1024;

/// What all gaps of a frame share.
#[derive(Clone, Copy)]
pub struct GapPass<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Where shares go.
    pub shares: &'a Shares,
    /// What pixels would have without a shadow; `None` where every ray sees light.
    pub lights: Option<&'a [f32]>,
    /// Which pixels are found from slices.
    pub lattice: Lattice,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
    /// Relative difference of depths within which samples count in full.
    pub threshold: f32,
    /// Whether pixels that no sample serves are listed.
    pub correction: bool,
}

/// One side of a gap: a slice's line through the fan's pixels, its samples, and what the fan's columns take of them.
#[derive(Debug, Default)]
pub struct Side {
    /// The samples.
    pub samples: LineSamples,
    /// The line.
    pub line: Borders,
    /// The samples by column.
    pub columns: LineColumns,
}

impl GapPass<'_> {
    /// Fills the pixels between two slices, or lists those that are to be marched, as `[column, row]` along and across the fan:
    /// from the fan's column `first` on, until [`LEFT_AT_ONCE`] are listed. Returns the column at which it goes on.
    #[inline(always)]
    pub fn fill(
        &self,
        (fan, pixels): (&Fan, &FanPixels),
        sides: [&Side; 2],
        first: usize,
        left: &mut Vec<[u32; 2]>,
    ) -> usize {
        let [width, height] = self.frame.size();
        let flat = fan.major == Major::X;
        let strides = if flat { [1, width as usize] } else { [width as usize, 1] };
        let [length, breadth] = if flat { [width, height] } else { [height, width] };
        let depth = self.frame.depth().texels();
        let limit = self.frame.max_distance() as f32;
        let lattice = self.lattice;
        let count = pixels.ranges.len();
        // Of a nearer and a farther one, the difference is a part of the nearer one.
        let (more, less) = (1.0 + self.threshold, 1.0 / (1.0 + self.threshold));
        let [own, next] = sides;
        let borders = own.line.pixels[..count].iter().zip(&next.line.pixels[..count]);
        for (offset, (&from, &to)) in borders.enumerate().skip(first) {
            let column = pixels.columns[0] + offset as u32;
            if from >= to || !lattice.holds(column, length) {
                continue;
            }
            if left.len() >= LEFT_AT_ONCE {
                return offset;
            }
            let line = own.line.minors[offset];
            let gap = next.line.minors[offset] - line;
            let per_gap = if gap > 0.0 { 1.0 / gap } else { 0.0 };
            let half = if gap > 0.0 { 0.0 } else { 0.5 };
            // Between these depths a pixel's ray ends if all four samples count in full for it: most pixels. Nowhere, if the
            // place is beyond one of the slices.
            let alike = [
                less * own.columns.farthest[offset].max(next.columns.farthest[offset]),
                more * own.columns.nearest[offset].min(next.columns.nearest[offset]),
            ];
            let at_column = column as usize * strides[0];
            for row in lattice.within(from, to, breadth) {
                let part = ((row as f32 - line) * per_gap + half).clamp(0.0, 1.0);
                let place = at_column + row as usize * strides[1];
                let end = depth[place].min(limit);
                if self.lights.is_none() && end >= alike[0] && end <= alike[1] {
                    let between = own.columns.shares[..self.channels].iter().zip(&next.columns.shares);
                    for (channel, (own, next)) in between.enumerate() {
                        let (one, other) = (own[offset], next[offset]);
                        self.shares.put(place, channel, one + part * (other - one));
                    }
                } else if !self.fill_by_depth(sides, offset, place, end, part) {
                    left.push([column, row as u32]);
                }
            }
        }
        count
    }

    /// Fills one pixel by the weights of the four samples beside it, around a spot times their light; `false` if it is to be marched.
    #[inline(never)]
    fn fill_by_depth(&self, sides: [&Side; 2], offset: usize, place: usize, end: f32, part: f32) -> bool {
        if self.lights.is_some_and(|lights| lights[place] == 0.0) {
            (0..self.channels).for_each(|channel| self.shares.put(place, channel, 0.0));
            return true;
        }
        let pairs = sides.map(|side| side.columns.pair(&side.samples, offset));
        let samples = sides.map(|side| &side.samples);
        let ends = [pairs[0].ends[0], pairs[0].ends[1], pairs[1].ends[0], pairs[1].ends[1]];
        let across = [1.0 - part, part];
        let mut lights = [1.0f32; 4];
        let mut weights = [0.0f32; 4];
        let (mut served, mut sum) = (0.0, 0.0);
        for tap in 0..4 {
            let bilinear = across[tap / 2] * pairs[tap / 2].parts[tap % 2];
            let own = bilinear * weight(end, ends[tap], self.threshold);
            if self.lights.is_some() {
                let index = pairs[tap / 2].indices[tap % 2];
                lights[tap] = samples[tap / 2].lights.get(index).copied().unwrap_or(0.0);
            }
            served += if lights[tap] > 0.0 { own } else { 0.0 };
            weights[tap] = own * lights[tap];
            sum += weights[tap];
        }
        if !(served >= LEAST_WEIGHT && sum > 0.0) {
            if self.correction {
                return false;
            }
            weights = [0.0; 4];
            weights[nearest(end, &ends, &lights, samples)] = 1.0;
            sum = 1.0;
        }
        for channel in 0..self.channels {
            let mut share = 0.0;
            for (tap, weight) in weights.iter().enumerate() {
                let side = tap / 2;
                if samples[side].count > 0 {
                    share += weight * samples[side].shares[channel][pairs[side].indices[tap % 2]];
                }
            }
            self.shares.put(place, channel, share / sum);
        }
        true
    }
}

/// The sample whose ray ends nearest, of those that see light if there are any.
#[inline(always)]
fn nearest(end: f32, ends: &[f32; 4], lights: &[f32; 4], samples: [&LineSamples; 2]) -> usize {
    let mut best = (0, f32::NEG_INFINITY);
    for (tap, &other) in ends.iter().enumerate() {
        if samples[tap / 2].count > 0 {
            // How near they are, as a quotient: endless rays are as near as can be.
            let near = if end == other { 1.0 } else { end.min(other) / end.max(other) };
            let near = if lights[tap] > 0.0 { near } else { -1.0 };
            if near > best.1 {
                best = (tap, near);
            }
        }
    }
    best.0
}
