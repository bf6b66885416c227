//! The line of one slice through the pixels of its fan.

use scatter_core::{Level, at_level};

use crate::geometry::{Fan, FanPixels, Slice};

/// Where a slice passes through each column of its fan.
#[derive(Debug, Default)]
pub struct Borders {
    /// Its minor coordinate in the middle of each column, less ½: pixel k's centre is at k.
    pub minors: Vec<f32>,
    /// The first pixel behind it.
    pub pixels: Vec<i32>,
    /// Where its shared view rays end, by their number; empty if none are shared.
    pub ends: Vec<f32>,
}

impl Borders {
    /// Room for `columns` columns.
    pub fn reserve(&mut self, columns: usize) {
        self.minors.clear();
        self.minors.reserve(columns);
        self.pixels.clear();
        self.pixels.reserve(columns);
        self.ends.clear();
        self.ends.reserve(columns + 1);
    }

    /// Follows slice `index` of a fan.
    pub fn follow(&mut self, simd: Level, fan: &Fan, pixels: &FanPixels, slices: &[Slice], index: usize) {
        let slice = &slices[index];
        let start = slice.minor_at(fan.major, f64::from(pixels.columns[0]) + 0.5) - 0.5;
        let count = pixels.ranges.len();
        self.minors.resize(count, 0.0);
        self.pixels.resize(count, 0);
        at_level!(simd, {
            let lines = self.minors.iter_mut().zip(&mut self.pixels).zip(&pixels.ranges);
            for (offset, ((minor, border), range)) in lines.enumerate() {
                let exact = start + slice.slope * offset as f64;
                *minor = exact as f32;
                *border = (exact.ceil() as i32).clamp(range[0], range[1]);
            }
        });
        // The outermost lines are shared with other fans, and every pixel is on one side of them.
        if index == 0 || index + 1 == slices.len() {
            let end = usize::from(index > 0);
            for (border, range) in self.pixels.iter_mut().zip(&pixels.ranges) {
                *border = range[end];
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.minors.capacity() + self.pixels.capacity() + self.ends.capacity())
    }
}
