//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.

mod factor;

pub use factor::{Factorisation, Factors};
