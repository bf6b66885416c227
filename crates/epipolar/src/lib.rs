//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.

mod epipole;
mod slices;
mod fan_pixels;
mod slice_plane;

mod simd_level;
mod map_line;
mod row;

mod integrate;

mod factor;

pub use epipole::Epipole;
pub use fan_pixels::FanPixels;
pub use slices::{Fan, Major, Slice, SliceSet};
pub use integrate::*;
pub use map_line::*;
pub use row::Row;
pub use slice_plane::SlicePlane;
pub use factor::{Factorisation, Factors};
