//! The pixels between two slices, as a list for each thing that is known of them.
//!
//! Where slices are close a column has one pixel between two of them, or two, or none, and no branch predictor foresees
//! which: a loop over the pixels of a column is mispredicted once a column, which costs as much as the pixel. So the numbers of a
//! column's pixels are written eight at a time, however many of them are kept, and all that follows is one long loop over
//! all pixels after another, without a branch.

use super::borders::Borders;
use super::refinement::Refinement;
use super::shares::{EMPTY, Shares};
use crate::geometry::{Major, Slice};

/// Pixels that are written side by side; what is too many is overwritten by the next column.
const AHEAD: usize = 8;

/// Pixels of a gap, column by column.
#[derive(Debug, Default)]
pub struct PixelsBetween {
    pub(super) count: usize,
    /// Column in the image.
    pub(super) columns: Vec<u32>,
    /// Index within the column.
    pub(super) rows: Vec<i32>,
    /// Index in the image.
    pub(super) places: Vec<u32>,
    /// Where their rays end.
    pub(super) ends: Vec<f32>,
    /// Distance from the first slice over the gap's width, 0 to 1.
    pub(super) parts: Vec<f32>,
    /// What each has asked last, an index into the queries.
    pub(super) asked: Vec<u32>,
    /// Where answers are shared: indices of those that ask themselves, and where the rays of each of the fan's columns would end
    /// on one surface, on the slice before and behind.
    pub(super) askers: Vec<u32>,
    pub(super) asker_count: usize,
    pub(super) planes: Vec<[f32; 2]>,
    /// Answers of the slice before and of the one behind, per channel.
    pub(super) answers: [[Vec<f32>; 3]; 2],
    /// Bit 0: in the gap's second half, once it is halved; bit 1: to be answered by a slice nearer to it.
    pub(super) flags: Vec<u32>,
    /// Pixels of the columns before each of the fan's columns, and a few more behind the last.
    pub(super) before_columns: Vec<u32>,
}

/// The half of its gap that a pixel is in, as a flag.
const SECOND_HALF: u32 = 1;
/// Its two slices differ.
const IN_DOUBT: u32 = 2;
/// It takes the answers of shared view rays.
pub(super) const SHARED: u32 = 4;

/// How columns and pixels of a fan lie in the image.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// The fan's first column.
    pub first_column: u32,
    /// Distance of two columns in memory, and of two pixels of a column.
    pub strides: [u32; 2],
}

/// The columns of a fan that a list is made for.
#[derive(Debug, Clone, Copy)]
pub struct Offsets {
    /// The first one.
    pub start: usize,
    /// The one after the last.
    pub end: usize,
    /// One in how many.
    pub stride: usize,
    /// How many the fan has.
    pub all: usize,
}

impl PixelsBetween {
    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Columns of the first and of the last pixel.
    pub fn span(&self) -> [u32; 2] {
        [self.columns[0], self.columns[self.count - 1]]
    }

    /// Column of each in the image.
    pub fn columns(&self) -> &[u32] {
        &self.columns[..self.count]
    }

    /// Index of each in the image.
    pub fn places(&self) -> &[u32] {
        &self.places[..self.count]
    }

    /// Where the ray of each ends.
    pub fn ends(&self) -> &[f32] {
        &self.ends[..self.count]
    }

    /// What each asks, to be filled in.
    pub fn asked_mut(&mut self) -> (&[u32], &mut [u32]) {
        (&self.columns[..self.count], &mut self.asked[..self.count])
    }

    /// What each asks.
    pub fn asked(&self) -> &[u32] {
        &self.asked[..self.count]
    }

    /// Pixels of the columns before each of the fan's columns.
    pub fn before_columns(&self) -> &[u32] {
        &self.before_columns
    }

    /// Forgets all pixels; room for `count` of them with answers in some channels.
    pub fn clear(&mut self, count: usize, channels: usize) {
        (self.count, self.asker_count) = (0, 0);
        let room = count + AHEAD;
        if self.columns.len() < room {
            for list in [&mut self.columns, &mut self.places, &mut self.asked, &mut self.flags] {
                list.resize(room, 0);
            }
            self.rows.resize(room, 0);
            self.ends.resize(room, 0.0);
            self.parts.resize(room, 0.0);
        }
        for answers in self.answers.iter_mut().flat_map(|answers| &mut answers[..channels]) {
            if answers.len() < room {
                answers.resize(room, 0.0);
            }
        }
    }

    /// No pixels at all in a fan of `all` columns.
    pub fn list_none(&mut self, all: usize, stride: usize, channels: usize) {
        self.clear(0, channels);
        self.before_columns.clear();
        self.before_columns.resize(all + stride + 1, 0);
    }

    /// Lists the pixels between two slices.
    #[inline(always)]
    pub fn list(&mut self, grid: Grid, lines: [&Borders; 2], offsets: Offsets, channels: usize) {
        let [own, next] = lines;
        let most: i32 = own.pixels.iter().zip(&next.pixels).map(|(&from, &to)| (to - from).max(0)).sum();
        self.clear(most as usize, channels);
        self.number(lines, offsets);
        self.flags[..self.count].fill(0);
        self.find_parts(lines);
        let [column_stride, stride] = grid.strides;
        let pixels = self.columns[..self.count].iter_mut().zip(&mut self.places).zip(&self.rows);
        for ((column, place), &row) in pixels {
            *column += grid.first_column;
            *place = *column * column_stride + row as u32 * stride;
        }
    }

    /// Numbers the pixels between two slices: columns from the fan's first on, and rows.
    #[inline(always)]
    fn number(&mut self, [own, next]: [&Borders; 2], offsets: Offsets) {
        let Offsets { start, end, stride, all } = offsets;
        // Whoever looks for the column behind the last one finds one.
        self.before_columns.resize(all + stride + 1, 0);
        self.before_columns[..start].fill(0);
        let mut count = 0;
        for offset in (start..end).step_by(stride) {
            self.before_columns[offset] = count as u32;
            let (mut row, end) = (own.pixels[offset], next.pixels[offset]);
            loop {
                let columns = &mut self.columns[count..count + AHEAD];
                let rows = &mut self.rows[count..count + AHEAD];
                for lane in 0..AHEAD {
                    columns[lane] = offset as u32;
                    rows[lane] = row + lane as i32;
                }
                count += (end - row).clamp(0, AHEAD as i32) as usize;
                row += AHEAD as i32;
                if row >= end {
                    break;
                }
            }
        }
        self.before_columns[end..].fill(count as u32);
        self.count = count;
    }

    /// Finds where in their gap pixels lie that have just been numbered.
    #[inline(always)]
    fn find_parts(&mut self, [own, next]: [&Borders; 2]) {
        let count = self.count;
        // First all look-ups, then all quotients. Answers are still to come, so there is room for a number a pixel.
        let (nexts, parts) = (&mut self.answers[0][0][..count], &mut self.parts[..count]);
        for ((next_line, line), &offset) in nexts.iter_mut().zip(&mut *parts).zip(&self.columns) {
            *line = own.minors[offset as usize];
            *next_line = next.minors[offset as usize];
        }
        for ((&next_line, part), &row) in nexts.iter().zip(parts).zip(&self.rows) {
            let (line, gap) = (*part, next_line - *part);
            let own = (row as f32 - line) / gap;
            // Pixels of a gap without width are as far from both.
            *part = if gap > 0.0 { own.clamp(0.0, 1.0) } else { 0.5 };
        }
    }

    /// Looks up where the pixels' rays end, beyond `longest` at it.
    #[inline(always)]
    pub fn find_ends(&mut self, depth: &[f32], longest: f32) {
        for (end, &place) in self.ends.iter_mut().zip(&self.places[..self.count]) {
            let own = depth[place as usize];
            *end = if own < longest { own } else { longest };
        }
    }

    /// Takes the answers of the slice before the gap (`side` 0) or behind it (1).
    #[inline(always)]
    pub fn answer(&mut self, side: usize, channel: usize, shares: &[f32]) {
        let answers = &mut self.answers[side][channel][..self.count];
        for (answer, &asked) in answers.iter_mut().zip(&self.asked) {
            *answer = shares[asked as usize];
        }
    }

    /// Puts all pixels at one place of the gap.
    pub fn place_at(&mut self, part: f32) {
        self.parts[..self.count].fill(part);
    }

    /// Reads what [`Self::put`] wrote.
    pub fn read(&self, shares: &Shares, channel: usize, out: &mut Vec<f32>) {
        out.clear();
        out.extend(self.places[..self.count].iter().map(|&place| shares.get(place as usize, channel)));
    }

    /// Finds the pixels whose two slices differ by more than may be interpolated over; returns whether there are any.
    #[inline(always)]
    pub fn doubt(&mut self, refinement: &Refinement, channels: usize) -> bool {
        let Refinement { tolerance, floor, .. } = *refinement;
        let [before, behind] = &self.answers;
        let mut any = 0;
        for channel in 0..channels {
            let answers = before[channel].iter().zip(&behind[channel]).zip(&self.parts);
            for (flags, ((&a, &b), &part)) in self.flags[..self.count].iter_mut().zip(answers) {
                // What a shadow's edge somewhere in the gap would change: most in its middle, nothing at a slice.
                let doubt = 2.0 * part * (1.0 - part);
                let sum = 0.5 * (a + b);
                let differs = (b - a).abs() * doubt > tolerance * if sum > floor { sum } else { floor };
                *flags |= if differs { IN_DOUBT } else { 0 };
                any |= *flags;
            }
        }
        any & IN_DOUBT != 0
    }

    /// Writes the shares of all pixels, and leaves those in doubt empty.
    #[inline(always)]
    pub fn put(&self, shares: &Shares, channels: usize) {
        let [before, behind] = &self.answers;
        for channel in 0..channels {
            let answers = before[channel].iter().zip(&behind[channel]).zip(&self.parts);
            let pixels = self.places[..self.count].iter().zip(&self.flags);
            for ((&place, &flags), ((&a, &b), &part)) in pixels.zip(answers) {
                // In the ring a slice says nothing.
                let known = (a.min(b) >= 0.0) & (flags & IN_DOUBT == 0);
                let share = if known { a + part * (b - a) } else { EMPTY };
                shares.put(place as usize, channel, share);
            }
        }
    }

    /// Lists the pixels in doubt: all of them, or those of one half; without their doubts.
    #[inline(always)]
    pub fn take_doubtful(&mut self, from: &Self, half: Option<usize>, channels: usize) {
        let (mask, wanted) = match half {
            None => (IN_DOUBT, IN_DOUBT),
            Some(half) => (IN_DOUBT | SECOND_HALF, IN_DOUBT | if half == 0 { 0 } else { SECOND_HALF }),
        };
        self.clear(from.count, channels);
        // The list of queries is free until the pixels ask again.
        let picks = &mut self.asked;
        let mut count = 0;
        for (index, &flags) in from.flags[..from.count].iter().enumerate() {
            picks[count] = index as u32;
            count += usize::from(flags & mask == wanted);
        }
        self.count = count;
        let picks = &self.asked[..count];
        let take = |to: &mut [u32], from: &[u32]| {
            to.iter_mut().zip(picks).for_each(|(to, &pick)| *to = from[pick as usize]);
        };
        take(&mut self.columns, &from.columns);
        take(&mut self.places, &from.places);
        let take = |to: &mut [f32], from: &[f32]| {
            to.iter_mut().zip(picks).for_each(|(to, &pick)| *to = from[pick as usize]);
        };
        take(&mut self.ends, &from.ends);
        take(&mut self.parts, &from.parts);
        for (to, from) in self.answers.iter_mut().zip(&from.answers) {
            to[..channels].iter_mut().zip(from).for_each(|(to, from)| take(to, from));
        }
    }

    /// Replaces the gap by its halves on both sides of the slice `middle`, which has answered all pixels in their order.
    #[inline(always)]
    pub fn halve(&mut self, major: Major, [a, middle, b]: [&Slice; 3], shares: [&[f32]; 3], channels: usize) {
        // The slices are lines over the columns.
        let lines = [a, middle, b].map(|slice| [slice.minor_at(major, 0.5), slice.slope]);
        let pixels = self.columns[..self.count].iter().zip(&mut self.parts).zip(&mut self.flags);
        for ((&column, part), flags) in pixels {
            let [from, cut, to] = lines.map(|[start, slope]| start + slope * f64::from(column));
            let cut = if to > from { ((cut - from) / (to - from)) as f32 } else { 0.5 };
            let behind = *part >= cut;
            let (offset, width) = if behind { (*part - cut, 1.0 - cut) } else { (*part, cut) };
            *part = if width > 0.0 { (offset / width).clamp(0.0, 1.0) } else { 0.5 };
            *flags = if behind { SECOND_HALF } else { 0 };
        }
        let [before, behind] = &mut self.answers;
        for channel in 0..channels {
            let answers = before[channel].iter_mut().zip(&mut behind[channel]);
            let pixels = answers.zip(&self.flags[..self.count]).zip(shares[channel]);
            for (((before, behind), &flags), &share) in pixels {
                let second = flags & SECOND_HALF != 0;
                *before = if second { share } else { *before };
                *behind = if second { *behind } else { share };
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let numbers =
            [&self.columns, &self.places, &self.asked, &self.askers, &self.flags, &self.before_columns]
                .map(Vec::capacity);
        let answers = self.answers.iter().flatten().map(Vec::capacity).sum::<usize>();
        4 * (numbers.iter().sum::<usize>()
            + self.rows.capacity()
            + self.ends.capacity()
            + self.parts.capacity()
            + 2 * self.planes.capacity()
            + answers)
    }
}
