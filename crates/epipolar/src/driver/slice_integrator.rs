//! The one thing in which techniques on epipolar slices differ: how the lit light of a slice is summed.

use scatter_core::{Frame, RenderStats, Setup};

use super::queries::SliceQueries;
use super::slice_view::SliceView;
use crate::geometry::{Epipole, SliceSet};

/// Whether the extrema of the map's tiles are read for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TileUse {
    /// Rows do without them.
    Never,
    /// Rows of [`SliceView::rectify`] are the same without them: they are read where so many slices cross the map that they
    /// save more than they cost.
    IfWorthwhile,
    /// They are asked for by their places.
    Always,
}

/// Sums, for the view rays of one slice, what they see of the slice's light.
///
/// [`SliceDriver`](super::SliceDriver) does the rest: fans, gaps and their halving, the measured spacing, the walk of what is
/// left, and the way back to pixels. Implementations are monomorphic and should be `#[inline(always)]`: they are compiled
/// anew for every instruction set. [`DirectIntegrator`](crate::DirectIntegrator) is the shortest one.
pub trait SliceIntegrator: Send + Sync {
    /// Buffers of one worker, kept from slice to slice and from frame to frame.
    type Scratch: Default + Send + std::fmt::Debug;

    /// Prepares what all slices of a frame share, once their places are known.
    fn set_up(&mut self, _setup: &SliceSetup<'_>) {}

    /// Whether [`Self::integrate`] keeps its error on the frame that was set up; else all its pixels are walked, one by
    /// one.
    fn is_accurate(&self) -> bool {
        true
    }

    /// Whether [`Self::integrate`] reads rows whose texels are not all cut, unless a slice is to be
    /// [exact](SliceView::exactly).
    fn leaves_texels_uncut(&self) -> bool {
        false
    }

    /// How [`Self::integrate`] uses the extrema of the map's tiles.
    fn tiles(&self) -> TileUse {
        TileUse::IfWorthwhile
    }

    /// Channels whose shares differ, 1 or 3; a textured light has 3 in any case.
    fn channels(&self) -> usize {
        1
    }

    /// Where rays end that are longer, for the sums \[world units\].
    fn longest_ray(&self) -> f64 {
        f64::INFINITY
    }

    /// Grows buffers to what any slice of the frame may need, so that the second frame allocates nothing.
    fn reserve(&self, _room: &SliceRoom<'_>, _scratch: &mut Self::Scratch) {}

    /// Writes the share of its unoccluded light, ≥ 0, that each query's view ray sees lit, per channel; or
    /// [`EMPTY`](super::EMPTY), to have the pixel walked.
    ///
    /// Queries come in the order of their columns. Without a texture shares are at most 1.
    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut Self::Scratch);

    /// Adds what was counted since [`Self::reserve`] to the statistics of the frame.
    fn report(&self, _scratches: &mut dyn Iterator<Item = &Self::Scratch>, _stats: &mut RenderStats) {}

    /// Bytes held between frames, scratch not counted.
    fn memory_bytes(&self) -> usize {
        0
    }

    /// Bytes that one worker holds.
    fn scratch_bytes(_scratch: &Self::Scratch) -> usize {
        0
    }
}

/// What is known of a frame before the first slice is read.
#[derive(Clone, Copy)]
pub struct SliceSetup<'a> {
    /// Camera, light, medium, and where the maps look: no texel is read.
    pub setup: &'a Setup<'a>,
    /// Where its slices meet.
    pub epipole: Epipole,
    /// The slices, as they are laid first.
    pub slices: &'a SliceSet,
    /// The longest view ray \[world units\].
    pub longest_ray: f64,
}

/// The largest slice of a frame.
#[derive(Clone, Copy)]
pub struct SliceRoom<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Most columns of a slice.
    pub columns: usize,
    /// Most queries of a slice.
    pub queries: usize,
    /// Most runs of a row, where texels are not cut more finely than their columns are.
    pub runs: usize,
    /// Channels of the shares.
    pub channels: usize,
}
