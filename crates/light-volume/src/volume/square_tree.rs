//! A tree of squares over a map, which bounds the depths of what rays may cross in each.

use super::height_field::HeightField;
use super::stepped::SteppedVolume;

/// What the image pass goes down to find what rays may cross.
pub trait SquareTree {
    /// Columns and rows of what the squares are made of: `PATCH` of them along the side of a finest one.
    fn cells(&self) -> [u32; 2];
    /// Where the first of them begins \[texels\].
    fn origin(&self) -> f32;
    /// The coarsest level, that of a single square.
    fn coarsest(&self) -> usize;
    /// Nearest and farthest depth in a square of a level; the first is greater where there is nothing.
    fn bounds(&self, level: usize, place: [u32; 2]) -> [f32; 2];
    /// Whether a square above the finest level has a list of its own, and nothing under it.
    fn is_whole(&self, level: usize, place: [u32; 2]) -> bool;
}

impl SquareTree for SteppedVolume {
    fn cells(&self) -> [u32; 2] {
        self.size()
    }

    fn origin(&self) -> f32 {
        0.0
    }

    fn coarsest(&self) -> usize {
        self.coarsest()
    }

    #[inline(always)]
    fn bounds(&self, level: usize, place: [u32; 2]) -> [f32; 2] {
        self.bounds(level, place)
    }

    #[inline(always)]
    fn is_whole(&self, level: usize, place: [u32; 2]) -> bool {
        self.patch(place.map(|n| n << level)).level() == level
    }
}

impl SquareTree for HeightField {
    fn cells(&self) -> [u32; 2] {
        self.cells()
    }

    fn origin(&self) -> f32 {
        -0.5
    }

    fn coarsest(&self) -> usize {
        self.coarsest()
    }

    #[inline(always)]
    fn bounds(&self, level: usize, place: [u32; 2]) -> [f32; 2] {
        self.bounds(level, place)
    }

    #[inline(always)]
    fn is_whole(&self, level: usize, place: [u32; 2]) -> bool {
        self.is_one_quad(level, place)
    }
}
