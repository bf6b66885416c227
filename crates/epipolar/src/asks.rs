//! The pixels that ask one slice, in the order of their columns, and what they are told.

use crate::borders::Borders;
use crate::gap_pixels::{GapPixels, Offsets};

/// What pixels ask one slice, in the order of their columns, and what they are told.
#[derive(Debug, Default)]
pub struct Asks {
    count: usize,
    /// Column of each, from the slice's first.
    columns: Vec<u32>,
    /// Where each ray ends.
    ends: Vec<f32>,
    /// The light ray in which it ends.
    gammas: Vec<f32>,
    /// The run that holds that light ray.
    runs: Vec<u32>,
    /// Share of the unoccluded light that the slice finds, per channel.
    shares: [Vec<f32>; 3],
}

impl Asks {
    /// Forgets all; room for `count` of them in some channels.
    pub fn clear(&mut self, count: usize, channels: usize) {
        self.count = 0;
        if self.columns.len() < count {
            self.columns.resize(count, 0);
            self.runs.resize(count, 0);
            self.ends.resize(count, 0.0);
            self.gammas.resize(count, 0.0);
        }
        for shares in &mut self.shares[..channels] {
            if shares.len() < count {
                shares.resize(count, 0.0);
            }
        }
    }

    /// Every pixel beside a slice asks, column by column: first those of the gap before it, then those of the gap behind
    /// it. `first` is the slice's first column.
    #[inline(always)]
    pub fn merge(
        &mut self,
        gaps: [&mut GapPixels; 2],
        fan_first: u32,
        stride: usize,
        first: u32,
        channels: usize,
    ) {
        let [before, behind] = gaps;
        self.clear(before.len() + behind.len(), channels);
        self.count = before.len() + behind.len();
        // In front of a pixel are those of its own list, and of the other list those of the columns before; and of its own
        // column, if the other gap comes first.
        self.place(before, behind.before_columns(), fan_first, first);
        self.place(behind, &before.before_columns()[stride..], fan_first, first);
    }

    #[inline(always)]
    fn place(&mut self, gap: &mut GapPixels, others: &[u32], fan_first: u32, first: u32) {
        let (columns, asked) = gap.asked_mut();
        for (index, (asked, &column)) in asked.iter_mut().zip(columns).enumerate() {
            *asked = index as u32 + others[(column - fan_first) as usize];
        }
        for ((&asked, &column), &end) in gap.asked().iter().zip(gap.columns()).zip(gap.ends()) {
            self.columns[asked as usize] = column - first;
            self.ends[asked as usize] = end;
        }
    }

    /// Only one view ray a column asks, as long as that of the pixel nearest to the slice, for all beside it.
    pub fn merge_rectified(
        &mut self,
        gaps: [&mut GapPixels; 2],
        lines: [&Borders; 3],
        offsets: Offsets,
        first_offset: usize,
        channels: usize,
    ) {
        let [before, behind] = gaps;
        self.clear(before.len() + behind.len(), channels);
        let mut taken = [0, 0];
        for offset in (offsets.start..offsets.end).step_by(offsets.stride) {
            let [start, own, end] = lines.map(|line| line.pixels[offset]);
            let counts = [own - start, end - own].map(|count| count.max(0) as usize);
            let all = counts[0] + counts[1];
            if all == 0 {
                continue;
            }
            let nearest = (lines[1].minors[offset].round() as i32 - start).clamp(0, all as i32 - 1) as usize;
            self.columns[self.count] = (offset - first_offset) as u32;
            self.ends[self.count] = if nearest < counts[0] {
                before.ends()[taken[0] + nearest]
            } else {
                behind.ends()[taken[1] + nearest - counts[0]]
            };
            for (side, gap) in [&mut *before, &mut *behind].into_iter().enumerate() {
                let (_, asked) = gap.asked_mut();
                asked[taken[side]..][..counts[side]].fill(self.count as u32);
                taken[side] += counts[side];
            }
            self.count += 1;
        }
    }

    /// All pixels of one list ask, in their order.
    #[inline(always)]
    pub fn take(&mut self, pixels: &GapPixels, channels: usize) {
        self.clear(pixels.len(), channels);
        self.count = pixels.len();
        let first = pixels.span()[0];
        for (own, &column) in self.columns.iter_mut().zip(pixels.columns()) {
            *own = column - first;
        }
        self.ends[..self.count].copy_from_slice(pixels.ends());
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Column of each, from the slice's first.
    pub fn columns(&self) -> &[u32] {
        &self.columns[..self.count]
    }

    /// Column and end of each ray, and room for the light ray in which it ends.
    pub fn ends_and_gammas(&mut self) -> (&[u32], &[f32], &mut [f32]) {
        let count = self.count;
        (&self.columns[..count], &self.ends[..count], &mut self.gammas[..count])
    }

    /// The light ray in which each ray ends, and the run that holds it.
    pub fn gammas_and_runs(&mut self) -> (&[f32], &mut [u32]) {
        (&self.gammas[..self.count], &mut self.runs[..self.count])
    }

    /// Columns, light rays and runs of some, and room for their shares in the channels that are asked for.
    pub fn open(&mut self, range: std::ops::Range<usize>) -> OpenAsks<'_> {
        OpenAsks {
            columns: &self.columns[range.clone()],
            gammas: &self.gammas[range.clone()],
            runs: &self.runs[range.clone()],
            shares: self.shares.each_mut().map(|shares| shares.get_mut(range.clone()).unwrap_or_default()),
        }
    }

    /// The answers of a channel.
    pub fn shares(&self, channel: usize) -> &[f32] {
        self.shares[channel].get(..self.count).unwrap_or(&[])
    }

    /// The answers of a channel, to be changed.
    pub fn shares_mut(&mut self, channel: usize) -> (&[u32], &mut [f32]) {
        (&self.columns[..self.count], &mut self.shares[channel][..self.count])
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let shares = self.shares.iter().map(Vec::capacity).sum::<usize>();
        4 * (4 * self.columns.capacity() + shares)
    }
}

/// Asks that wait for their shares.
pub struct OpenAsks<'a> {
    /// Column of each, from the slice's first.
    pub columns: &'a [u32],
    /// The light ray in which its ray ends.
    pub gammas: &'a [f32],
    /// The run that holds that light ray.
    pub runs: &'a [u32],
    /// What it is told, per channel.
    pub shares: [&'a mut [f32]; 3],
}
