//! A rectified shadow map of the technique's own: one matrix that makes view rays rows of constant depth (Klehm et al. 2014,
//! Section 4.2), so that whoever renders shadow maps renders it.
//!
//! ```text
//! camera, light ──▶ rectification (axes, ranges) ──▶ a matrix a split ──▶ MapSource::clip_map ──▶ texels [split][row][column]
//!                                                                  └──▶ without a source: the given map, resampled
//! slice ──▶ its row of texels ──▶ runs of light rays, with the columns that see them lit
//! ```

mod columns;
mod map;
mod reach;
mod rectification;
mod resampling;

pub use map::{MOST_SPLITS, OwnMap, OwnMapSettings};
pub use reach::Reach;
pub use rectification::{Extent, NotRectified, Rectification};
