//! Pixels that end on one surface share the answers of a few of their slice's view rays.
//!
//! Along a slice the lit share of a pixel's light changes slowly, for every column adds a little to the same shafts; and
//! where four view rays around a pixel (two slices, two columns) end on one surface, the pixel's share lies between theirs.
//! So one column in a few of every slice has a view ray of its own, as long as that of the nearest pixel; pixels between four of
//! them take the mean of them, weighed by how near they are, if they end where a plane through the four ends would; all
//! others ask with their own depth. Baran et al. 2010 (Section 4) and Yusov 2012 (Sections 6.3 to 6.6) interpolate rectified
//! results, too; what the pixels of a depth edge ask themselves keeps it from blurring.
//!
//! Where slices are several pixels apart this leaves few queries: one a few columns and slice instead of two a pixel.

use super::borders::Borders;
use super::pixels_between::{Grid, PixelsBetween, SHARED};
use super::queries::SliceQueries;
use super::refinement::Refinement;
use super::resampling::Resampling;
use crate::geometry::FanPixels;

/// Largest difference of the four ends, of the nearest: a plane at a grazing angle is straight in the inverse of depth alone,
/// from which at this ratio the straight line in depth is off by a fiftieth.
const APART: f32 = 0.25;

/// Largest part of its length by which a pixel's ray may end away from the plane, however much an answer may be off: previews
/// of halls, whose dark rays end in light, miss their level at three times as much.
const MOST_BENT: f32 = 0.05;

/// Pixels between slices, times the columns of a shared view ray, from which on sharing is faster than asking.
const WORTH_IT: f64 = 2.5;

/// Which view rays are shared, and by whom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfaces {
    /// One column in how many has one, a power of two.
    stride: u32,
    /// By which part of its length a ray may end away from the plane: what lies there is at most that part of its light.
    bent: f32,
}

impl Surfaces {
    /// For shared view rays in one column of `stride`, at a distance of slices \[pixels\]; `None` if nothing is shared: rectified
    /// results are shared by everybody anyway.
    pub fn new(resampling: Resampling, stride: u32, spacing: f64, refinement: &Refinement) -> Option<Self> {
        if stride == 0 {
            return None;
        }
        let stride = 1u32 << stride.min(16).ilog2();
        let bent = refinement.tolerance.min(MOST_BENT);
        let shares = resampling == Resampling::Pixels && spacing * f64::from(stride) >= WORTH_IT;
        shares.then_some(Self { stride, bent })
    }

    /// The number of the shared column at or before a column.
    #[inline(always)]
    fn number(self, column: u32) -> u32 {
        column >> self.stride.trailing_zeros()
    }

    /// The columns of a slice, offsets from the fan's first, with the shared ones before and behind them.
    pub fn widened(self, first_column: u32, [from, to]: [usize; 2], all: usize) -> [usize; 2] {
        let first = first_column as usize;
        let stride = self.stride as usize;
        let [from, last] = [first + from, first + to - 1];
        let start = (from / stride * stride).max(first) - first;
        let end = ((last.div_ceil(stride) * stride).max(last) - first + 1).min(all);
        [start, end]
    }

    /// Finds where the shared view rays of a slice end: as that of the pixel nearest to it in the column.
    #[inline(always)]
    pub fn find_ends(
        self,
        line: &mut Borders,
        pixels: &FanPixels,
        grid: Grid,
        depth: &[f32],
        limits: (u32, f32),
    ) {
        let (breadth, longest) = limits;
        let [first, end] = pixels.columns;
        let number = self.number(first);
        let count = if end > first { self.number(end - 1) - number + 1 } else { 0 };
        line.ends.resize(count as usize, 0.0);
        for (index, ray_end) in line.ends.iter_mut().enumerate() {
            let column = ((number + index as u32) * self.stride).max(first);
            let row = (line.minors[(column - first) as usize].round().max(0.0) as u32).min(breadth - 1);
            let own = depth[(column * grid.strides[0] + row * grid.strides[1]) as usize];
            *ray_end = if own < longest { own } else { longest };
        }
    }

    /// The number of the shared column at or before a column, and how far it is to the next one, 0 to 1.
    #[inline(always)]
    fn place(self, column: u32) -> (u32, f32) {
        (self.number(column), (column & (self.stride - 1)) as f32 / self.stride as f32)
    }

    /// Whether a column has a shared view ray.
    #[inline(always)]
    fn has(self, column: u32) -> bool {
        column & (self.stride - 1) == 0
    }
}

/// How far fans reach along an axis, for the columns of a slice.
#[derive(Debug, Clone, Copy)]
pub struct SharedColumns {
    pub surfaces: Surfaces,
    /// The fan's columns.
    pub fan: [u32; 2],
}

impl PixelsBetween {
    /// Marks the pixels that lie between four shared view rays of one surface.
    #[inline(always)]
    pub fn find_shared(&mut self, shared: SharedColumns, [own, next]: [&Borders; 2]) {
        let SharedColumns { surfaces, fan: [first, end] } = shared;
        // The plane through the four ends, column by column, on both slices; no number where there is none.
        let width = (end - first) as usize;
        if self.planes.len() < width {
            self.planes.resize(width, [f32::NAN; 2]);
        }
        if self.count == 0 {
            return;
        }
        let [from, to] = self.span().map(|column| column - first);
        let start = surfaces.number(first);
        for (offset, plane) in (from..=to).zip(&mut self.planes[from as usize..]) {
            let (number, weight) = surfaces.place(first + offset);
            let next_number = number + u32::from(weight > 0.0);
            let inside = number * surfaces.stride >= first && next_number * surfaces.stride < end;
            *plane = [f32::NAN; 2];
            if inside {
                let at = |number: u32| (number - start) as usize;
                let [a, b] =
                    [number, next_number].map(|number| [own.ends[at(number)], next.ends[at(number)]]);
                let nearest = a[0].min(a[1]).min(b[0].min(b[1]));
                let farthest = a[0].max(a[1]).max(b[0].max(b[1]));
                if farthest - nearest <= APART * nearest {
                    *plane = [0, 1].map(|side| a[side] + weight * (b[side] - a[side]));
                }
            }
        }
        let pixels = self.columns[..self.count].iter().zip(&self.parts).zip(&self.ends);
        for (((&column, &part), &ray_end), flags) in pixels.zip(&mut self.flags) {
            let [one, other] = self.planes[(column - first) as usize];
            let plane = one + part * (other - one);
            let on_it = (ray_end - plane).abs() <= surfaces.bent * ray_end;
            *flags = if on_it { SHARED } else { 0 };
        }
        // Which pixels ask themselves.
        if self.askers.len() < self.count {
            self.askers.resize(self.columns.len(), 0);
        }
        let mut count = 0;
        for (index, &flags) in self.flags[..self.count].iter().enumerate() {
            self.askers[count] = index as u32;
            count += usize::from(flags & SHARED == 0);
        }
        self.asker_count = count;
        self.asked[..self.count].fill(0);
    }

    /// Takes the answers of a slice that was asked by [`SliceQueries::merge_shared`], whose first column is `first`.
    #[inline(always)]
    pub fn answer_shared(&mut self, side: usize, channel: usize, queries: &SliceQueries, first: u32) {
        let (shares, along) = (queries.shares(channel), &queries.along);
        let answers = &mut self.answers[side][channel][..self.count];
        for (answer, &column) in answers.iter_mut().zip(&self.columns) {
            *answer = along[(column - first) as usize];
        }
        for &index in &self.askers[..self.asker_count] {
            answers[index as usize] = shares[self.asked[index as usize] as usize];
        }
    }
}

impl SliceQueries {
    /// The shared view rays of a slice ask, and the pixels that share none; in the order of columns. The slice's columns are
    /// `range`, offsets from the fan's first one.
    #[inline(always)]
    pub(super) fn merge_shared(
        &mut self,
        gaps: [&mut PixelsBetween; 2],
        shared: SharedColumns,
        [from, to]: [usize; 2],
        (ends, channels): (&[f32], usize),
    ) {
        let SharedColumns { surfaces, fan: [fan_first, _] } = shared;
        let (first, width) = (fan_first + from as u32, to - from);
        if self.before_columns.len() < width + 1 {
            self.before_columns.resize(width + 1, 0);
            self.along.resize(width + 1, 0.0);
        }
        // Queries of each column, then those before it.
        let before = &mut self.before_columns[..=width];
        for (offset, count) in before.iter_mut().enumerate() {
            *count = u32::from(surfaces.has(first + offset as u32) && offset < width);
        }
        for gap in &gaps {
            for &index in &gap.askers[..gap.asker_count] {
                before[(gap.columns[index as usize] - first) as usize] += 1;
            }
        }
        let mut sum = 0;
        for count in before.iter_mut() {
            (*count, sum) = (sum, sum + *count);
        }
        self.clear(sum as usize, channels);
        self.count = sum as usize;
        // Whoever asks himself comes first in his column, and moves its start; so shared view rays end up before it.
        for gap in gaps {
            for &index in &gap.askers[..gap.asker_count] {
                let index = index as usize;
                let offset = (gap.columns[index] - first) as usize;
                let query = self.before_columns[offset];
                self.before_columns[offset] += 1;
                gap.asked[index] = query;
                self.columns[query as usize] = offset as u32;
                self.ends[query as usize] = gap.ends[index];
            }
        }
        let start = surfaces.number(fan_first);
        for offset in 0..width {
            let column = first + offset as u32;
            if surfaces.has(column) {
                let query = self.before_columns[offset] as usize;
                self.columns[query] = offset as u32;
                self.ends[query] = ends[(surfaces.number(column) - start) as usize];
            }
        }
    }

    /// Interpolates the answers of shared view rays along the slice, whose columns are counted from `first`.
    #[inline(always)]
    pub(super) fn interpolate(&mut self, surfaces: Surfaces, first: u32, width: usize, channel: usize) {
        let shares = &self.shares[channel];
        let answer = |number: u32| {
            let offset = (number * surfaces.stride).checked_sub(first)? as usize;
            (offset < width).then(|| shares[self.before_columns[offset] as usize])
        };
        for (offset, along) in self.along[..width].iter_mut().enumerate() {
            let (number, weight) = surfaces.place(first + offset as u32);
            let (Some(a), Some(b)) = (answer(number), answer(number + u32::from(weight > 0.0))) else {
                continue;
            };
            // What is left to be walked tells nothing of its neighbours.
            *along = if a.min(b) < 0.0 { a.min(b) } else { a + weight * (b - a) };
        }
    }
}
