//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.

mod epipole;
mod fan_pixels;
mod slice_plane;
mod slices;

mod map_line;
mod row;
mod tint;
mod simd_level;

mod bands;
mod integrand;
mod factor;

mod integrate;

mod planes;
mod resolve;
mod slice_pass;

mod options;
mod technique;

pub use bands::Bands;
pub use epipole::Epipole;
pub use factor::{Factorisation, Factors};
pub use fan_pixels::FanPixels;
pub use integrate::*;
pub use map_line::*;
pub use options::{EpipolarTechnique, Options, TECHNIQUE};
pub use row::Row;
pub use slice_plane::SlicePlane;
pub use slices::{Fan, Major, Slice, SliceSet};
pub use technique::{Epipolar, ID};
