//! Mode `slices`: every pixel by the trees of its two slices, on the slice driver.

use epipolar::SliceIntegrator;
use epipolar::driver::{FrameLight, SliceQueries, SliceRoom, SliceSetup, SliceView, TileUse, channels_of};
use scatter_core::RenderStats;

use super::march::SliceMarch;
use super::traversal::SliceRay;
use super::tree_kind::TreeKind;

/// Rays that are marched before their sums are read.
const BATCH: usize = 64;

/// Sums slices by marching each query's view ray through the slice's tree (Yusov 2012, Algorithm 2).
///
/// Along a slice shares are exact but for f32; O(queries · runs · log columns) a slice.
#[derive(Debug)]
pub struct TreeIntegrator {
    /// Which tree.
    pub kind: TreeKind,
    channels: usize,
}

impl TreeIntegrator {
    /// With a tree.
    pub fn new(kind: TreeKind) -> Self {
        Self { kind, channels: 1 }
    }
}

impl SliceIntegrator for TreeIntegrator {
    type Scratch = SliceMarch;

    fn set_up(&mut self, setup: &SliceSetup<'_>) {
        self.channels = channels_of(setup.setup.light(), setup.setup.medium());
    }

    fn tiles(&self) -> TileUse {
        if self.kind == TreeKind::None { TileUse::Never } else { TileUse::Always }
    }

    fn channels(&self) -> usize {
        self.channels
    }

    fn reserve(&self, room: &SliceRoom<'_>, march: &mut SliceMarch) {
        march.reserve(room.frame, BATCH);
    }

    #[inline(always)]
    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, march: &mut SliceMarch) {
        let light = FrameLight::new(slice.frame());
        let simd = slice.scene().simd;
        let white = slice.frame().texture().is_none();
        march.lay(slice, self.kind);
        let first_column = slice.order.columns[0];
        let mut first = 0;
        while first < queries.len() {
            let range = first..(first + BATCH).min(queries.len());
            first = range.end;
            let open = queries.open(range);
            march.clear();
            let mut of_column = None;
            for (&column, &end) in open.columns.iter().zip(open.ends) {
                let ray = match of_column {
                    Some((own, ray)) if own == column => ray,
                    _ => SliceRay::new(slice, f64::from(first_column + column), 0.0),
                };
                of_column = Some((column, ray));
                march.ray(slice, self.kind, &light, &SliceRay { end: end.into(), ..ray });
            }
            march.sums.finish(&light, simd, false);
            for (channel, shares) in open.shares.into_iter().enumerate() {
                for (ray, share) in shares.iter_mut().enumerate() {
                    *share = march.sums.share(ray, channel, if white { self.channels } else { 3 }, white);
                }
            }
        }
    }

    fn report(&self, marches: &mut dyn Iterator<Item = &SliceMarch>, stats: &mut RenderStats) {
        let (mut nodes, mut columns, mut read, mut runs) = (0, 0, 0, 0);
        for march in marches {
            nodes += march.counts.looks.nodes;
            columns += march.counts.looks.columns;
            read += march.counts.columns_read;
            runs += march.sums.integrated;
        }
        stats.counts.push("nodes", nodes);
        stats.counts.push("texel columns", columns);
        stats.counts.push("texel columns read", read);
        stats.counts.push("lit runs", runs);
    }

    fn scratch_bytes(march: &SliceMarch) -> usize {
        march.memory_bytes()
    }
}
