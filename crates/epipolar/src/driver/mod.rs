//! From slices to pixels, whatever sums a slice: the part that all techniques on epipolar slices share.
//!
//! [`SliceDriver`] lays slices, estimates how far apart they may be ([`measured`] of [`SpacingSample`]s), hands each as a [`SliceView`] with
//! its [`SliceQueries`] to a [`SliceIntegrator`], halves the gaps between slices that differ ([`Refinement`]), and turns
//! [`Shares`] of the unoccluded light into radiance ([`Resolve`]).

mod borders;
mod light_sums;
mod near_ends;
mod pass;
mod pixels_between;
mod queries;
mod refinement;
mod resampling;
mod resolve;
mod shares;
mod slice_driver;
mod slice_facts;
mod slice_integrator;
mod slice_view;
mod spacing;
mod spacing_sample;
mod surfaces;

pub use borders::Borders;
pub use light_sums::{FrameLight, LightSums, channels_of};
pub use queries::{OpenQueries, SliceQueries};
pub use refinement::{MOST_HALVINGS, Refinement};
pub use resampling::Resampling;
pub use resolve::Resolve;
pub use shares::{EMPTY, Shares};
pub use slice_driver::{SliceDriver, SliceSettings};
pub use slice_facts::SliceFacts;
pub use slice_integrator::{SliceIntegrator, SliceRoom, SliceSetup, TileUse};
pub use slice_view::{SliceAngles, SliceLight, SliceScene, SliceView};
pub use spacing_sample::{Confidence, ErrorTarget, Measured, SpacingSample, measured};

pub(crate) use pixels_between::{Offsets, PixelsBetween};
