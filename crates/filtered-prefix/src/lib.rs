//! Volumetric shadows from prefix-filtered rows of the shadow map: Klehm et al. 2014 (Fourier bases), Peters et al. 2016 and 2017
//! (power moments), with a certificate a pixel.
//!
//! In a rectified row a view ray is one depth, and "how much of it is lit" is how many of the row's surfaces lie behind it: a
//! shadow test against many surfaces at once. A basis makes the test linear, so that one prefix sum along the row answers all view
//! rays of a slice, wherever they end, in a few flops each.
//!
//! ```text
//! slice ──▶ runs (epipolar's rows) ──▶ extremes: all lit, or none?  ──▶ 1 or 0
//!                                  ──▶ weights of reference rays ──▶ prefix sums (moments, fourier) ──▶ share, certificate
//!                                  ──▶ where the certificate does not suffice: lit stretches, in closed form (exact)
//! ```
//!
//! Rows may be those of a map of the technique's own ([`projective`]), and all rows of that map may be filtered, with one fetch a
//! pixel, as in the paper ([`filtered_map`]).
//!
//! The slices, their spacing and the way back to pixels are [`epipolar::driver`]'s.

#[cfg(test)]
mod basis_tests;
#[cfg(test)]
mod certificate_tests;
mod estimate;
mod exact;
pub mod filtered_map;
pub mod fourier;
mod integrator;
mod measured_depths;
pub mod moments;
mod options;
pub mod projective;
mod runs;
mod storage;
mod technique;
mod tool;
mod weights;

pub use integrator::PrefixIntegrator;
pub use options::{Basis, DepthRange, Depths, Fetch, Filter, ID, Options, Rectification, Weighting};
pub use storage::Storage;
pub use technique::{CAPABILITIES, FilteredPrefix};
pub use tool::{FilteredPrefixTechnique, TECHNIQUE};
