//! Which two slices a pixel lies between, and how far from the first of them: the way back from pixels to slices.

use super::fan_pixels::FanPixels;
use super::slices::{Fan, Major, Slice, SliceSet};

/// The slices of a frame with the pixels of their fans: the way from a pixel back to its slices (Yusov 2012, Section
/// 6.6, takes the two nearest slices, too).
#[derive(Debug, Clone, Copy)]
pub struct SliceMap<'a> {
    /// The slices.
    pub slices: &'a SliceSet,
    /// The pixels of each fan.
    pub pixels: &'a [FanPixels],
}

/// A pixel's place among slices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelPlace {
    /// Index of its fan.
    pub fan: usize,
    /// Index of the slice before it in [`SliceSet::slices`]; the one behind it is the next.
    pub slice: usize,
    /// Distance from the slice before it over the gap's width along the pixel's column, 0 to 1.
    pub part: f32,
}

impl SliceMap<'_> {
    /// The place of pixel `(x, y)`; `None` for one that is too near to the epipole. O(fans + log slices).
    pub fn locate(&self, [x, y]: [u32; 2]) -> Option<PixelPlace> {
        for (index, (fan, pixels)) in self.slices.fans.iter().zip(self.pixels).enumerate() {
            let (column, row) = match fan.major {
                Major::X => (x, y as i32),
                Major::Y => (y, x as i32),
            };
            let Some(offset) = column.checked_sub(pixels.columns[0]) else { continue };
            let Some(range) = pixels.ranges.get(offset as usize) else { continue };
            if !(range[0]..range[1]).contains(&row) {
                continue;
            }
            let slices = &self.slices.slices[fan.first..][..fan.count];
            let minor = |slice: &Slice| border_minor(fan, pixels, slice, offset as usize);
            // The outermost lines are shared with other fans, and every pixel is on one side of them.
            let behind = slices[1..fan.count - 1].partition_point(|slice| minor(slice).ceil() as i32 <= row);
            let [own, next] = [minor(&slices[behind]) as f32, minor(&slices[behind + 1]) as f32];
            return Some(PixelPlace { fan: index, slice: fan.first + behind, part: part_of(row, own, next) });
        }
        None
    }
}

/// The minor coordinate of a slice in the middle of a fan's column, less ½: the centre of pixel k is at k.
#[inline(always)]
pub(crate) fn border_minor(fan: &Fan, pixels: &FanPixels, slice: &Slice, offset: usize) -> f64 {
    let start = slice.minor_at(fan.major, f64::from(pixels.columns[0]) + 0.5) - 0.5;
    start + slice.slope * offset as f64
}

/// Where pixel `row` of a column lies between two slices; half way in a gap without width.
#[inline(always)]
pub(crate) fn part_of(row: i32, own: f32, next: f32) -> f32 {
    let gap = next - own;
    let part = (row as f32 - own) / gap;
    if gap > 0.0 { part.clamp(0.0, 1.0) } else { 0.5 }
}
