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
    /// Which pixels are found from slices.
    pub lattice: Lattice,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
    /// Relative difference of depths within which samples count in full.
    pub threshold: f32,
    /// Whether pixels that no sample serves are listed.
    pub correction: bool,
}

/// Two neighbouring samples of one slice, around a place.
#[derive(Clone, Copy)]
struct Pair {
    ends: [f32; 2],
    /// Weights of the two: 0 for both where the place is beyond the slice.
    parts: [f32; 2],
    indices: [usize; 2],
}

impl Pair {
    #[inline(always)]
    fn new(samples: &LineSamples, along: f64) -> Self {
        if samples.count == 0 {
            return Self { ends: [0.0; 2], parts: [0.0; 2], indices: [0; 2] };
        }
        let place = ((along - samples.first) / samples.step) as f32;
        let last = (samples.count - 1) as f32;
        // Pixels a sample or a pixel before the first one still see it.
        let slack = 1.0f32.max((1.0 / samples.step.abs()) as f32);
        let inside = place >= -slack && place <= last + slack;
        let clamped = place.max(0.0).min(last);
        let one = (clamped as usize).min(samples.count.saturating_sub(2));
        let other = (one + 1).min(samples.count - 1);
        let part = clamped - one as f32;
        let parts = if inside { [1.0 - part, part] } else { [0.0; 2] };
        Self { ends: [samples.ends[one], samples.ends[other]], parts, indices: [one, other] }
    }
}

impl GapPass<'_> {
    /// Fills the pixels between two slices, or lists those that are to be marched, as `[column, row]` along and across the fan:
    /// from the fan's column `first` on, until [`LEFT_AT_ONCE`] are listed. Returns the column at which it goes on.
    #[inline(always)]
    pub fn fill(
        &self,
        (fan, pixels): (&Fan, &FanPixels),
        [own, next]: [&Borders; 2],
        samples: [&LineSamples; 2],
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
        for offset in first..pixels.ranges.len() {
            if left.len() >= LEFT_AT_ONCE {
                return offset;
            }
            let [from, to] = [own.pixels[offset], next.pixels[offset]];
            let column = pixels.columns[0] + offset as u32;
            if from >= to || !lattice.holds(column, length) {
                continue;
            }
            let along = f64::from(column) + 0.5;
            let pairs = samples.map(|samples| Pair::new(samples, along));
            let ends = [pairs[0].ends[0], pairs[0].ends[1], pairs[1].ends[0], pairs[1].ends[1]];
            let mut shares = [[0.0f32; 4]; 3];
            for (channel, shares) in shares[..self.channels].iter_mut().enumerate() {
                for (side, (pair, samples)) in pairs.iter().zip(samples).enumerate() {
                    if samples.count > 0 {
                        shares[2 * side] = samples.shares[channel][pair.indices[0]];
                        shares[2 * side + 1] = samples.shares[channel][pair.indices[1]];
                    }
                }
            }
            let line = own.minors[offset];
            let gap = next.minors[offset] - line;
            let per_gap = if gap > 0.0 { 1.0 / gap } else { 0.0 };
            let half = if gap > 0.0 { 0.0 } else { 0.5 };
            let mut along = [[0.0f32; 2]; 3];
            for (along, shares) in along.iter_mut().zip(&shares) {
                *along = [0, 1].map(|side| {
                    let [one, other] = pairs[side].parts;
                    one * shares[2 * side] + other * shares[2 * side + 1]
                });
            }
            let alike = alike(&pairs, &ends, self.threshold);
            for row in lattice.within(from, to, breadth) {
                let part = ((row as f32 - line) * per_gap + half).clamp(0.0, 1.0);
                let place = column as usize * strides[0] + row as usize * strides[1];
                let end = depth[place].min(limit);
                if end >= alike[0] && end <= alike[1] {
                    for (channel, [one, other]) in along[..self.channels].iter().enumerate() {
                        self.shares.put(place, channel, one + part * (other - one));
                    }
                    continue;
                }
                let sides = [1.0 - part, part];
                let mut weights = [0.0f32; 4];
                let mut sum = 0.0;
                for tap in 0..4 {
                    let bilinear = sides[tap / 2] * pairs[tap / 2].parts[tap % 2];
                    weights[tap] = bilinear * weight(end, ends[tap], self.threshold);
                    sum += weights[tap];
                }
                if !(sum >= LEAST_WEIGHT) {
                    if self.correction {
                        left.push([column, row as u32]);
                        continue;
                    }
                    weights = [0.0; 4];
                    weights[nearest(end, &ends, samples)] = 1.0;
                    sum = 1.0;
                }
                for (channel, own) in shares[..self.channels].iter().enumerate() {
                    let share = weights.iter().zip(own).map(|(weight, own)| weight * own).sum::<f32>();
                    self.shares.put(place, channel, share / sum);
                }
            }
        }
        pixels.ranges.len()
    }
}

/// Between which depths a pixel's ray ends if all four samples count in full for it: most pixels. Nowhere, if the place is beyond
/// one of the slices.
#[inline(always)]
fn alike(pairs: &[Pair; 2], ends: &[f32; 4], threshold: f32) -> [f32; 2] {
    if pairs.iter().any(|pair| pair.parts == [0.0; 2]) {
        return [f32::INFINITY, f32::NEG_INFINITY];
    }
    let nearest = ends.iter().fold(f32::INFINITY, |a, &b| a.min(b));
    let farthest = ends.iter().fold(0.0f32, |a, &b| a.max(b));
    // Of a nearer and a farther one, the difference is a part of the nearer one.
    [farthest / (1.0 + threshold), nearest * (1.0 + threshold)]
}

/// The sample whose ray ends nearest.
#[inline(always)]
fn nearest(end: f32, ends: &[f32; 4], samples: [&LineSamples; 2]) -> usize {
    let mut best = (0, f32::NEG_INFINITY);
    for (tap, &other) in ends.iter().enumerate() {
        if samples[tap / 2].count > 0 {
            // How near they are, as a quotient: endless rays are as near as can be.
            let near = if end == other { 1.0 } else { end.min(other) / end.max(other) };
            if near > best.1 {
                best = (tap, near);
            }
        }
    }
    best.0
}
