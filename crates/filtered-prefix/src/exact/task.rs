//! What is to be integrated exactly of a slice, whichever way does it.

use epipolar::driver::{LightSums, SliceView};

use crate::runs::{Asked, Runs};
use crate::weights::Fog;

/// View rays that are summed before their shares are read.
pub const BATCH: usize = 64;

/// How a frame's rows are integrated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ways {
    /// Whether the light is a sun in a uniform medium.
    pub is_plain_sun: bool,
    /// A sun's height fog.
    pub fog: Option<Fog>,
    /// Ratio of 1/sin β over a band of [`SummedSun`], of each channel.
    pub ratios: [f64; 3],
}

/// What is to be integrated exactly.
pub struct ExactTask<'a> {
    /// The slice.
    pub slice: &'a SliceView<'a>,
    /// Its runs.
    pub runs: Runs<'a>,
    /// Its view rays.
    pub asked: &'a Asked,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
}

/// The share of a ray that is lit; a ray without light, as beside a cone, has no shadow: its neighbours may have light.
#[inline(always)]
pub fn share_of(sums: &LightSums, ray: usize, channel: usize, channels: usize, white: bool) -> f32 {
    let [_, whole] = sums.light(ray, channel, channels);
    if whole > 0.0 { sums.share(ray, channel, channels, white) } else { 1.0 }
}
