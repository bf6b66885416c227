//! The samples of one slice: where they lie, which are marched, and what the others are interpolated from (Yusov 2012, Sections
//! 6.1, 6.2 and 6.5).
//!
//! A slice enters the image at the epipole, or at the border, and leaves it at its exit. Between the two, samples are evenly
//! spaced, a pixel apart at the least: where a slice has fewer pixels than samples, it has fewer samples ("rescaled lines"), one in
//! the middle of each column of the image that it crosses, or of every second, third or fourth.
//!
//! A bit a sample says whether it is marched: one in [`initial`](crate::Options::initial), more of them near the epipole, the
//! last one, and both sides of every edge. So no edge lies within a stretch between two that are marched, and the samples
//! there are interpolated between its ends.
//!
//! Departure from the paper: what is interpolated is what does not change with the length of a ray. Where both ends of a stretch end
//! in the light, that is what their rays lack; where both end in the dark, what they have. The paper interpolates
//! radiance, which is wrong for lit rays of different lengths by as much as the closed form curves.

use epipolar::driver::SliceView;
use epipolar::geometry::{Epipole, Major, Slice};
use scatter_core::{Frame, sun_interval_f32};

use crate::slices::SliceRay;

/// Bits of a word of flags.
const WORD: usize = u64::BITS as usize;

/// Share of the image's diagonal within which samples are denser.
const NEAR: f64 = 0.05;

/// The samples of one slice; buffers.
#[derive(Debug, Default)]
pub struct LineSamples {
    /// Place of the first along the slice's major axis \[pixels\].
    pub first: f64,
    /// Distance of two along that axis, with its sign; not 0.
    pub step: f64,
    /// Number of samples, 0 where the slice misses the image.
    pub count: usize,
    /// Where the ray of each ends.
    pub ends: Vec<f32>,
    /// The rays, in the slice's plane.
    pub rays: Vec<SliceRay>,
    /// The share of its light that each sees lit, `[channel][sample]`.
    pub shares: [Vec<f32>; 3],
    /// Of marched samples, what lit runs have, and what the whole ray would have; of others the latter, where it is needed.
    pub lit: [Vec<f32>; 3],
    /// As above.
    pub whole: [Vec<f32>; 3],
    /// Around a spot, the light of each without a shadow, as a weight; empty where every ray sees light.
    pub lights: Vec<f32>,
    /// Whether the surface in which a marched sample's ray ends is lit.
    pub ends_lit: Flags,
    /// Samples behind which an edge follows.
    pub edges: Flags,
    /// Samples that are marched.
    pub marched: Flags,
    /// Those of them that have not been marched yet.
    pub fresh: Flags,
}

/// A bit a sample (Yusov 2012, Section 6.2).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Flags(Vec<u64>);

impl Flags {
    /// All off, for so many samples. Keeps its room.
    pub fn clear(&mut self, count: usize) {
        self.0.clear();
        self.0.resize(count.div_ceil(WORD), 0);
    }

    /// Room for so many.
    pub fn reserve(&mut self, count: usize) {
        self.0.clear();
        self.0.reserve(count.div_ceil(WORD));
    }

    /// Switches one on, or leaves it.
    #[inline(always)]
    pub fn set(&mut self, index: usize, on: bool) {
        self.0[index / WORD] |= u64::from(on) << (index % WORD);
    }

    /// Whether one is on.
    #[inline(always)]
    pub fn get(&self, index: usize) -> bool {
        self.0[index / WORD] >> (index % WORD) & 1 != 0
    }

    /// How many are on.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The first that is on at `index` or behind it.
    #[inline(always)]
    pub fn next(&self, index: usize) -> Option<usize> {
        let mut word = index / WORD;
        let mut bits = *self.0.get(word)? & (u64::MAX << (index % WORD));
        while bits == 0 {
            word += 1;
            bits = *self.0.get(word)?;
        }
        Some(word * WORD + bits.trailing_zeros() as usize)
    }

    /// The same ones as others.
    fn copy_of(&mut self, other: &Self) {
        self.0.clone_from(&other.0);
    }

    /// Switches on what lies on both sides of the edges behind samples `edges`: they and the next ones, word by word.
    fn both_sides_of(&mut self, edges: &Self) {
        let mut carry = 0;
        for (own, &edge) in self.0.iter_mut().zip(&edges.0) {
            *own |= edge | edge << 1 | carry;
            carry = edge >> (WORD - 1);
        }
    }
}

/// How samples are laid.
#[derive(Debug, Clone, Copy)]
pub struct SampleSettings {
    /// Most samples of a slice.
    pub samples: usize,
    /// One in how many is marched to begin with.
    pub initial: usize,
    /// How many times as many near the epipole.
    pub density: usize,
    /// Relative difference of depths that is an edge.
    pub threshold: f32,
}

impl LineSamples {
    /// Room for slices of so many samples, in some channels.
    pub fn reserve(&mut self, count: usize, channels: usize) {
        self.ends.clear();
        self.ends.reserve(count);
        self.rays.clear();
        self.rays.reserve(count);
        self.lights.clear();
        self.lights.reserve(count);
        for buffers in [&mut self.shares, &mut self.lit, &mut self.whole] {
            for buffer in &mut buffers[..channels] {
                buffer.clear();
                buffer.reserve(count);
            }
        }
        for flags in [&mut self.ends_lit, &mut self.edges, &mut self.marched, &mut self.fresh] {
            flags.reserve(count);
        }
    }

    /// Lays the samples of a slice, finds where their rays end, the edges between them, and which are marched.
    pub fn lay(
        &mut self,
        frame: &Frame<'_>,
        epipole: &Epipole,
        (slice, major, ascending): (&Slice, Major, bool),
        settings: &SampleSettings,
        channels: usize,
    ) {
        let size = frame.size().map(f64::from);
        let [length, breadth] = if major == Major::X { size } else { [size[1], size[0]] };
        let centre = (epipole.image.z > 0.0).then(|| major.of(epipole.image.truncate()) / epipole.image.z);
        let span = span_in_image(slice, major, [length, breadth], centre, ascending);
        let stretch = (1.0 + slice.slope * slice.slope).sqrt();
        let pixels = (span[1] - span[0]) * stretch;
        self.count = 0;
        self.lights.clear();
        if !(pixels > 0.0) {
            return;
        }
        // Light is closest to the epipole: what is left over of a line that begins there is at the border.
        let left_before = match centre {
            Some(centre) if span.contains(&centre) => f64::from(u8::from(!ascending)),
            _ => 0.5,
        };
        let (ends, wanted) = laid_in(span, pixels, settings.samples, left_before);
        let step = (ends[1] - ends[0]) / (wanted - 1) as f64;
        (self.first, self.step) = if ascending { (ends[0], step) } else { (ends[1], -step) };
        self.count = wanted;
        self.find_ends(frame, slice, major, [length, breadth]);
        for buffers in [&mut self.shares, &mut self.lit, &mut self.whole] {
            for buffer in &mut buffers[..channels] {
                buffer.clear();
                buffer.resize(wanted, 0.0);
            }
        }
        self.ends_lit.clear(wanted);
        self.find_edges(settings.threshold);
        self.marched.clear(wanted);
        let near = NEAR * size[0].hypot(size[1]);
        // Samples before this one are near the epipole.
        let dense = centre.map_or(0.0, |centre| {
            let from = (self.first - centre).abs() * stretch;
            ((near - from) / (step * stretch)).max(0.0)
        });
        let mut index = 0;
        while index < wanted {
            self.marched.set(index, true);
            let finer = if (index as f64) < dense { settings.density } else { 1 };
            index += (settings.initial / finer).max(1);
        }
        self.marched.set(wanted - 1, true);
    }

    /// Lays the view rays of all samples in the slice's plane; returns the farthest light ray in which one of them ends.
    #[inline(always)]
    pub fn lay_rays(&mut self, slice: &SliceView<'_>) -> f32 {
        let Self { rays, ends, first, step, count, .. } = self;
        rays.resize(*count, SliceRay { sine: 1.0, cosine: 0.0, rank: 0.0, end: 0.0 });
        let (first, step) = (*first - 0.5, *step);
        let rays = &mut rays[..*count];
        for (index, (ray, &end)) in rays.iter_mut().zip(&*ends).enumerate() {
            *ray = SliceRay::new(slice, first + step * index as f64, f64::from(end));
        }
        let reach = rays.iter().fold(0.0f64, |reach, ray| {
            let own = light_ray(slice, ray.end, ray.sine, ray.cosine);
            if own > reach { own } else { reach }
        });
        reach as f32
    }

    /// Fills in what all rays would have without a shadow, under a sun in uniform air.
    #[inline(always)]
    pub fn fill_wholes(&mut self, sigma_t: [f32; 3], channels: usize) {
        for (channel, whole) in self.whole[..channels].iter_mut().enumerate() {
            let sigma = sigma_t[channel];
            for (whole, &end) in whole.iter_mut().zip(&self.ends) {
                let own = sun_interval_f32(sigma, 0.0, end);
                // One channel is the sum of three that are alike, as `LightSums` has it.
                *whole = if channels == 1 { own + own + own } else { own };
            }
        }
    }

    /// Where the rays of samples end: at the depth of the pixel in which they lie.
    fn find_ends(&mut self, frame: &Frame<'_>, slice: &Slice, major: Major, [length, breadth]: [f64; 2]) {
        let limit = frame.max_distance() as f32;
        let width = frame.size()[0] as usize;
        let strides = if major == Major::X { [1, width] } else { [width, 1] };
        let depth = frame.depth().texels();
        let minor = slice.minor_at(major, self.first);
        let per_sample = slice.slope * self.step;
        self.ends.clear();
        self.ends.extend((0..self.count).map(|index| {
            let along = (self.first + self.step * index as f64).max(0.0).min(length - 1.0) as usize;
            let across = (minor + per_sample * index as f64).max(0.0).min(breadth - 1.0) as usize;
            depth[along * strides[0] + across * strides[1]].min(limit)
        }));
    }

    fn find_edges(&mut self, threshold: f32) {
        self.edges.clear(self.count);
        for (index, pair) in self.ends.windows(2).enumerate() {
            let [near, far] = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            // Two endless rays do not differ.
            self.edges.set(index, near < far && far - near > threshold * near);
        }
    }

    /// Whether a sample would see light if nothing cast a shadow.
    #[inline(always)]
    pub fn sees_light(&self, index: usize) -> bool {
        self.lights.get(index).is_none_or(|&light| light > 0.0)
    }

    /// Adds the edges between samples that see light and others that see none.
    pub fn find_rims(&mut self) {
        for (index, pair) in self.lights.windows(2).enumerate() {
            self.edges.set(index, (pair[0] > 0.0) != (pair[1] > 0.0));
        }
    }

    /// Has both sides of all edges marched.
    pub fn march_edges(&mut self) {
        self.marched.both_sides_of(&self.edges);
        self.fresh.copy_of(&self.marched);
        // The last sample has nothing behind it.
        debug_assert!(self.marched.next(self.count).is_none());
    }

    /// The next stretch of samples that are not marched, as the two marched ones around it, from a marched one on.
    fn next_stretch(&self, from: usize) -> Option<[usize; 2]> {
        let mut before = self.marched.next(from)?;
        loop {
            let behind = self.marched.next(before + 1)?;
            if behind > before + 1 {
                return Some([before, behind]);
            }
            before = behind;
        }
    }

    /// What is interpolated over a stretch.
    fn kept(&self, ends: [usize; 2], channels: usize, white: bool) -> Kept {
        let all = |share: f32| {
            self.shares[..channels].iter().all(|list| ends.iter().all(|&index| list[index] == share))
        };
        match ends.map(|index| self.ends_lit.get(index)) {
            // Rays between two that are dark, or lit all along, are so, too.
            _ if all(0.0) || (white && all(1.0)) => Kept::Share,
            [true, true] if white => Kept::Lacking,
            [false, false] => Kept::Lit,
            _ => Kept::Share,
        }
    }

    /// Has the middle marched of every stretch whose two ends differ by more than `contrast` of their shares, or of `floor`; returns
    /// whether there are any.
    pub fn march_contrasts(&mut self, contrast: f32, floor: f32, channels: usize) -> bool {
        self.fresh.clear(self.count);
        let (mut from, mut any) = (0, false);
        while let Some([before, behind]) = self.next_stretch(from) {
            let differs = self.shares[..channels].iter().any(|shares| {
                let [a, b] = [shares[before], shares[behind]];
                (a - b).abs() > contrast * (0.5 * (a + b)).max(floor)
            });
            if differs {
                self.fresh.set((before + behind) / 2, true);
                any = true;
            }
            from = behind;
        }
        for (marched, fresh) in self.marched.0.iter_mut().zip(&self.fresh.0) {
            *marched |= fresh;
        }
        any
    }

    /// Calls `each` for the samples that are not marched and whose whole rays are asked for.
    pub fn for_each_whole(&self, channels: usize, white: bool, mut each: impl FnMut(usize)) {
        let mut from = 0;
        while let Some(ends) = self.next_stretch(from) {
            if self.kept(ends, channels, white) != Kept::Share {
                (ends[0] + 1..ends[1]).for_each(&mut each);
            }
            from = ends[1];
        }
    }

    /// Fills in the shares of samples that were not marched, from those beside them that were.
    pub fn interpolate(&mut self, channels: usize, white: bool) {
        let mut from = 0;
        while let Some(ends) = self.next_stretch(from) {
            let kept = self.kept(ends, channels, white);
            for channel in 0..channels {
                self.interpolate_stretch(channel, ends, kept, white);
            }
            from = ends[1];
        }
    }

    fn interpolate_stretch(&mut self, channel: usize, [before, behind]: [usize; 2], kind: Kept, white: bool) {
        let (shares, whole) = (&mut self.shares[channel], &self.whole[channel]);
        let ends = [before, behind].map(|index| {
            let (lit, whole, share) = (self.lit[channel][index], whole[index], shares[index]);
            match kind {
                Kept::Lacking => whole - lit,
                Kept::Lit => lit,
                Kept::Share => share,
            }
        });
        let per_sample = 1.0 / (behind - before) as f32;
        let between = before + 1..behind;
        for (index, (share, &whole)) in shares[between.clone()].iter_mut().zip(&whole[between]).enumerate() {
            let part = (index + 1) as f32 * per_sample;
            let value = ends[0] + part * (ends[1] - ends[0]);
            let own = match kind {
                Kept::Lacking => 1.0 - value / whole,
                Kept::Lit => value / whole,
                Kept::Share => value,
            };
            // Without any light, or with an endless amount of it, the share does not matter.
            let own = if own.is_finite() { own.max(0.0) } else { 1.0 };
            *share = if white { own.min(1.0) } else { own };
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = [&self.shares, &self.lit, &self.whole];
        let values: usize = lists.iter().flat_map(|list| list.iter()).map(Vec::capacity).sum();
        let flags: usize = [&self.ends_lit, &self.edges, &self.marched, &self.fresh]
            .iter()
            .map(|flags| flags.0.capacity())
            .sum();
        4 * (values + self.ends.capacity() + self.lights.capacity())
            + 8 * flags
            + self.rays.capacity() * size_of::<SliceRay>()
    }
}

/// What is interpolated over a stretch.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    /// What rays lack: both ends are lit.
    Lacking,
    /// What they have: both ends are dark.
    Lit,
    /// The share that is lit.
    Share,
}

/// The light ray in which a view ray ends, a little farther than it is: rows end there in f32.
#[inline(always)]
pub fn light_ray(slice: &SliceView<'_>, end: f64, sine: f64, cosine: f64) -> f64 {
    let end = end.min(f64::from(f32::MAX));
    (slice.light.light_ray(end, sine, cosine) * (1.0 + 1e-6)).min(f64::from(f32::MAX))
}

/// Columns of the image that samples in the middle of columns are apart at the most: as many may be left over at the image's
/// border, which take the last sample for their own.
const FARTHEST: f64 = 4.0;

/// Part of the samples that there may be which must be laid if they are to lie in the middle of columns.
const FEWEST: f64 = 0.75;

/// Where the first and the last of the samples of a span lie, and how many there are: in the middle of every column of the image,
/// of every second, third or fourth, so that nothing has to be interpolated along the slice there; where that is more than there may
/// be, or far fewer, evenly. `left_before`: which part of the columns that are left over is before the first one.
fn laid_in(span: [f64; 2], pixels: f64, most: usize, left_before: f64) -> ([f64; 2], usize) {
    let evenly = (pixels.floor() as usize + 1).clamp(2, most);
    let middles = [(span[0] - 0.5).ceil() + 0.5, (span[1] - 0.5).floor() + 0.5];
    let columns = middles[1] - middles[0] + 1.0;
    let apart = (columns / most as f64).ceil().max(1.0);
    let steps = ((columns - 1.0) / apart).floor();
    let are_enough = steps >= FEWEST * most as f64 || apart == 1.0;
    if steps >= 1.0 && apart <= FARTHEST && are_enough {
        let first = middles[0] + (left_before * (columns - 1.0 - steps * apart)).floor();
        return ([first, first + steps * apart], steps as usize + 1);
    }
    (span, evenly)
}

/// Where a slice's line enters the image and where it leaves it, along its major axis; not before the epipole.
fn span_in_image(
    slice: &Slice,
    major: Major,
    [length, breadth]: [f64; 2],
    centre: Option<f64>,
    ascending: bool,
) -> [f64; 2] {
    let (mut from, mut to) = (0.0f64, length);
    let start = slice.minor_at(major, 0.0);
    if slice.slope != 0.0 {
        let (a, b) = (-start / slice.slope, (breadth - start) / slice.slope);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    } else if !(start >= 0.0 && start <= breadth) {
        return [0.0; 2];
    }
    if let Some(centre) = centre {
        if ascending { from = from.max(centre) } else { to = to.min(centre) }
    }
    [from, to]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_bits(bits: &[bool]) -> Flags {
        let mut flags = Flags::default();
        flags.clear(bits.len());
        bits.iter().enumerate().for_each(|(index, &on)| flags.set(index, on));
        flags
    }

    #[test]
    fn flags_are_what_a_list_of_truths_says() {
        let mut random = scatter_testing::Random(7);
        for count in [1, 2, 63, 64, 65, 127, 128, 129, 300] {
            for rarity in [1, 3, 40] {
                let bits: Vec<bool> = (0..count).map(|_| random.below(rarity) == 0).collect();
                let flags = of_bits(&bits);
                for index in 0..count + 70 {
                    let naive = (index..count).find(|&place| bits[place]);
                    assert_eq!(flags.next(index), naive, "{count} {index}");
                }
                assert_eq!(flags.count(), bits.iter().filter(|on| **on).count() as u64);
                // An edge behind the last sample is none.
                let edges: Vec<bool> = (0..count).map(|place| place + 1 < count && bits[place]).collect();
                let mut both = Flags::default();
                both.clear(count);
                both.both_sides_of(&of_bits(&edges));
                for place in 0..count {
                    let naive = edges[place] || (place > 0 && edges[place - 1]);
                    assert_eq!(both.get(place), naive, "{count} {place}");
                }
            }
        }
    }

    #[test]
    fn samples_lie_in_the_middle_of_columns_where_they_may_be_as_many() {
        let laid = |span, most, left| laid_in(span, 25.0, most, left);
        assert_eq!(laid([20.2, 40.0], 64, 0.5), ([20.5, 39.5], 20));
        assert_eq!(laid([20.5, 39.5], 20, 0.5), ([20.5, 39.5], 20));
        assert_eq!(laid([20.6, 39.4], 64, 0.5), ([21.5, 38.5], 18));
        // Every second, and of the three columns that are left over of every fourth one before the first.
        assert_eq!(laid([20.2, 40.0], 11, 0.0), ([20.5, 38.5], 10));
        assert_eq!(laid([20.2, 40.0], 11, 1.0), ([21.5, 39.5], 10));
        assert_eq!(laid([20.2, 40.0], 5, 0.5), ([21.5, 37.5], 5));
        // A column more than there may be samples, too few of them, and a single column: evenly from end to end.
        assert_eq!(laid([20.2, 40.0], 19, 0.5), ([20.2, 40.0], 19));
        assert_eq!(laid([20.2, 40.0], 4, 0.5), ([20.2, 40.0], 4));
        assert_eq!(laid([20.2, 20.9], 64, 0.5), ([20.2, 20.9], 26));
    }

    #[test]
    fn spans_end_at_the_border_and_at_the_epipole() {
        let slice = Slice { exit: glam::DVec2::new(40.0, 10.0), slope: 0.5 };
        // y = 10 + (x − 40)/2: at the top at x = 20.
        let span = |centre, ascending| span_in_image(&slice, Major::X, [40.0, 30.0], centre, ascending);
        assert_eq!(span(None, true), [20.0, 40.0]);
        assert_eq!(span(Some(-100.0), true), [20.0, 40.0]);
        assert_eq!(span(Some(25.0), true), [25.0, 40.0]);
        assert_eq!(span(Some(25.0), false), [20.0, 25.0]);
    }
}
