//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.

mod epipole;
mod slices;
mod fan_pixels;

mod factor;

pub use epipole::Epipole;
pub use fan_pixels::FanPixels;
pub use slices::{Fan, Major, Slice, SliceSet};
pub use factor::{Factorisation, Factors};
