//! View rays of a slice, marched through its row and summed: what both modes on slices ask for.

use epipolar::driver::{FrameLight, LightSums, SliceView};
use glam::DVec3;
use scatter_core::Frame;

use super::colours::SliceColours;
use super::slice_row::SliceRow;
use super::traversal::{Looks, SliceRay};
use super::tree_kind::TreeKind;

/// Part of a ray's length from which on it counts as lit to its end.
const NEARLY: f64 = 0.98;

/// What marches through a slice counted.
#[derive(Debug, Clone, Copy, Default)]
pub struct MarchCounts {
    /// Rays.
    pub rays: u64,
    /// Nodes and texel columns that were looked at.
    pub looks: Looks,
    /// Texel columns that were read from maps.
    pub columns_read: u64,
}

/// One worker's row, colours and sums; buffers.
#[derive(Debug, Default)]
pub struct SliceMarch {
    row: SliceRow,
    colours: SliceColours,
    /// The sums of the rays since the last [`Self::clear`].
    pub sums: LightSums,
    /// Counts of the slices that were laid since the frame began.
    pub counts: MarchCounts,
}

impl SliceMarch {
    /// Room for any slice of a frame and for so many rays at a time; forgets what was counted.
    pub fn reserve(&mut self, frame: &Frame<'_>, rays: usize) {
        self.row.reserve(frame);
        self.colours.reserve(frame);
        self.sums.reserve(rays);
        self.sums.integrated = 0;
        self.counts = MarchCounts::default();
    }

    /// Forgets all rays.
    pub fn clear(&mut self) {
        self.sums.clear();
    }

    /// Lays a slice up to its reach.
    #[inline(never)]
    pub fn lay(&mut self, slice: &SliceView<'_>, kind: TreeKind) {
        self.row.lay(slice, kind);
        if let Some(texture) = slice.frame().texture() {
            self.colours.lay(slice, texture);
        }
    }

    /// Marches a ray of the slice that was laid, as the next one of the sums. Returns whether it is lit where it ends, or was so
    /// at 98 % of its length: surfaces shadow themselves a little.
    #[inline(never)]
    pub fn ray(
        &mut self,
        slice: &SliceView<'_>,
        kind: TreeKind,
        light: &FrameLight<'_>,
        ray: &SliceRay,
    ) -> bool {
        let Self { row, colours, sums, counts } = self;
        let simd = slice.scene().simd;
        sums.begin(direction(slice, ray), ray.end as f32);
        counts.rays += 1;
        let before = row.columns_read();
        let mut lit_to = 0.0;
        if slice.frame().texture().is_none() {
            row.lit_runs(slice, kind, ray, &mut counts.looks, |a, b| {
                lit_to = b;
                sums.add(light, simd, [a, b]);
            });
        } else {
            row.lit_runs(slice, kind, ray, &mut counts.looks, |a, b| {
                lit_to = b;
                colours.pieces(slice, ray, [a, b], |run, colour| sums.add_coloured(light, simd, run, colour));
            });
        }
        counts.columns_read += row.columns_read() - before;
        lit_to >= NEARLY * ray.end
    }

    /// The next ray of the sums, without light: for what it would have without a shadow.
    #[inline(always)]
    pub fn unlit_ray(&mut self, slice: &SliceView<'_>, ray: &SliceRay) {
        self.sums.begin(direction(slice, ray), ray.end as f32);
    }

    /// Calls `each(index, lit)` for all of some rays, whose surfaces at their ends are lit or not: [`SliceRow::end_is_lit`].
    #[inline(never)]
    pub fn ends_are_lit(
        &mut self,
        slice: &SliceView<'_>,
        rays: &[SliceRay],
        mut each: impl FnMut(usize, bool),
    ) {
        let before = self.row.columns_read();
        for (index, ray) in rays.iter().enumerate() {
            each(index, self.row.end_is_lit(slice, ray));
        }
        self.counts.columns_read += self.row.columns_read() - before;
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.row.memory_bytes() + self.colours.memory_bytes() + self.sums.memory_bytes()
    }
}

/// A ray's direction in the world.
#[inline(always)]
fn direction(slice: &SliceView<'_>, ray: &SliceRay) -> DVec3 {
    slice.plane.across * ray.sine + slice.plane.to_light * ray.cosine
}
