//! Baran's paper as it stands, where something better became the default: kept to be measured, and to be compared with.
//!
//! Cells that are sampled ([`SampledCells`]), sums by a partial-sum tree ([`tree`]) and by a [`cursor`], factors by an SVD
//! (feature `svd`), a marched ring around the epipole ([`leave_ring`]), rectified results that are resampled.

pub(crate) mod cursor;
mod rectified_resampling;
mod ring;
mod sampled_cells;
#[cfg(feature = "svd")]
mod svd;
pub(crate) mod tree;

pub use sampled_cells::SampledCells;

pub(crate) use ring::{RING_DEGREES, leave_ring};
#[cfg(feature = "svd")]
pub(crate) use svd::Decomposition;
