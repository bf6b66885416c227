//! What the pixels beside a slice ask of it, in the order of their columns, and what they are told.

use super::pixels_between::PixelsBetween;
use super::slice_view::{SliceLight, lamp_light_ray};

/// The queries of one slice: view rays by column and length, and the share of the light that each sees lit; in the order of their
/// columns. Every pixel between two slices is a query of both of them, with its own depth.
#[derive(Debug, Default)]
pub struct SliceQueries {
    pub(super) count: usize,
    /// Column of each, from the slice's first.
    pub(super) columns: Vec<u32>,
    /// Where each ray ends.
    pub(super) ends: Vec<f32>,
    /// The light ray in which it ends.
    gammas: Vec<f32>,
    /// Share of the unoccluded light that the slice finds, per channel.
    pub(super) shares: [Vec<f32>; 3],
    /// Where answers are shared: the shared view ray's query of each column, and the answers along the slice.
    pub(super) before_columns: Vec<u32>,
    pub(super) along: Vec<f32>,
}

impl SliceQueries {
    /// Forgets all; room for `count` of them in some channels.
    pub(crate) fn clear(&mut self, count: usize, channels: usize) {
        self.count = 0;
        if self.columns.len() < count {
            self.columns.resize(count, 0);
            self.ends.resize(count, 0.0);
            self.gammas.resize(count, 0.0);
        }
        for shares in &mut self.shares[..channels] {
            if shares.len() < count {
                shares.resize(count, 0.0);
            }
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Every pixel beside a slice asks, column by column: first those of the gap before it, then those of the gap behind
    /// it. `first` is the slice's first column.
    #[inline(always)]
    pub(super) fn merge(
        &mut self,
        gaps: [&mut PixelsBetween; 2],
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
    fn place(&mut self, gap: &mut PixelsBetween, others: &[u32], fan_first: u32, first: u32) {
        let (columns, asked) = gap.asked_mut();
        for (index, (asked, &column)) in asked.iter_mut().zip(columns).enumerate() {
            *asked = index as u32 + others[(column - fan_first) as usize];
        }
        for ((&asked, &column), &end) in gap.asked().iter().zip(gap.columns()).zip(gap.ends()) {
            self.columns[asked as usize] = column - first;
            self.ends[asked as usize] = end;
        }
    }

    /// All pixels of one list ask, in their order.
    #[inline(always)]
    pub(super) fn take(&mut self, pixels: &PixelsBetween, channels: usize) {
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

    /// Length of each ray, as the slice counts it.
    pub fn ends(&self) -> &[f32] {
        &self.ends[..self.count]
    }

    /// The light ray in which each ray ends.
    pub fn gammas(&self) -> &[f32] {
        &self.gammas[..self.count]
    }

    /// Finds the light ray in which each ray ends, by the angles of the columns; returns the farthest one.
    #[inline(always)]
    pub(super) fn find_light_rays(&mut self, light: SliceLight, sines: &[f32], cosines: &[f32]) -> f32 {
        let count = self.count;
        let (columns, ends, gammas) =
            (&self.columns[..count], &self.ends[..count], &mut self.gammas[..count]);
        let places = gammas.iter_mut().zip(columns.iter().zip(ends));
        match light {
            SliceLight::Sun => {
                for (gamma, (&column, &end)) in places {
                    *gamma = end * sines[column as usize];
                }
            }
            SliceLight::Lamp { distance } => {
                let distance = distance as f32;
                for (gamma, (&column, &end)) in places {
                    let (sine, cosine) = (sines[column as usize], cosines[column as usize]);
                    *gamma = lamp_light_ray(distance, end, sine, cosine);
                }
            }
        }
        // Light rays are ≥ 0: their bits are in the same order, and integers have a vector maximum that needs no order.
        f32::from_bits(gammas.iter().fold(0, |most, gamma| most.max(gamma.to_bits())))
    }

    /// Columns and light rays of some, and room for their shares in the channels that are asked for.
    pub fn open(&mut self, range: std::ops::Range<usize>) -> OpenQueries<'_> {
        OpenQueries {
            columns: &self.columns[range.clone()],
            ends: &self.ends[range.clone()],
            gammas: &self.gammas[range.clone()],
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

    /// Appends one query of a column, counted from the slice's first, with the length of its ray; there must be room.
    pub(crate) fn push(&mut self, column: u32, end: f32) {
        self.columns[self.count] = column;
        self.ends[self.count] = end;
        self.count += 1;
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let shares = self.shares.iter().map(Vec::capacity).sum::<usize>();
        4 * (3 * self.columns.capacity() + shares + 2 * self.before_columns.capacity())
    }
}

/// Queries that wait for their shares.
pub struct OpenQueries<'a> {
    /// Column of each, from the slice's first.
    pub columns: &'a [u32],
    /// Length of its ray.
    pub ends: &'a [f32],
    /// The light ray in which its ray ends.
    pub gammas: &'a [f32],
    /// What it is told, per channel.
    pub shares: [&'a mut [f32]; 3],
}
