//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, what goes beyond it, and the slice framework on
//! which further techniques stand.
//!
//! All view rays of an epipolar slice share the slice's light rays. A light ray is lit up to one depth and dark behind
//! it, so one pass over a slice finds what every one of its view rays sees of the light, instead of one march a pixel.
//!
//! ```text
//! geometry   camera, light ──▶ Epipole ──▶ SliceSet (sinh-spaced lines in fans) ──▶ FanPixels (each pixel in one gap)
//! driver     SliceDriver:  for each slice a SliceView and its SliceQueries ──▶ SliceIntegrator ──▶ shares
//! rows           its light rays:   for_each_line ──▶ MapLine ──▶ Row (runs; steps over MinMaxTiles)
//! baran          Baran:            Factors (Γ·B) + Row + queries ──▶ sums (blocks, sweep); height fog: edges of Row + closed forms
//! driver     gaps whose slices differ get a slice in between ──▶ shares of the unoccluded light ──▶ Resolve ──▶ image
//! ```
//!
//! A technique on slices implements [`SliceIntegrator`]: [`DirectIntegrator`] is the shortest, `examples/slice_technique.rs`
//! a whole technique. The paper's own ways, where something better became the default, are in a module apart, as options.
//!
//! # Departures from the paper
//!
//! - **The view ray's coordinate is the pixel column**, not the angle β: monotone in β, one division, and rectified view
//!   rays are the image's own. Each pixel queries its two slices with its own depth; nothing is resampled.
//! - **Cells end at the true texel crossings**, and a texel's flat surface is cut where it passes from one view ray to the
//!   next: along a slice the answer is that of the exact walk through the map ([`rectify`](driver::SliceView::rectify)).
//! - **Tiles that are one run are not read**: the extrema of 16×16 texels say that all light rays of a stretch end behind
//!   the same view ray ([`MinMaxTiles`](rows::MinMaxTiles)).
//! - **Light rays are runs** of neighbours that end at the same view ray; sums over runs are the same sums.
//! - **Bands of 1/sin β with shared factors** instead of a marched ring around the epipole ([`NearEpipole`]).
//! - **The answer is a share**: a quotient of two sums with the same factors, times the closed form. Unoccluded and dark
//!   pixels are exact at any rank.
//! - **Slices are spaced by measurement**: in a sample of gaps a line between two slices is interpolated, halved as its pixels
//!   would be, and compared with the slice through it; gaps whose two slices differ are halved for the pixels in doubt
//!   ([`Refinement`](driver::Refinement), [`ErrorTarget`](driver::ErrorTarget)).
//! - **Height fog** under a sun is not factorised: a lit stretch is a difference of transmittances, and a query sums closed forms
//!   over the edges of what it sees lit, exactly (`baran/fog`; README).
//! - **Pixels on one surface share answers** where slices are pixels apart: a slice has one view ray a column for those that
//!   end where its neighbours' do; pixels at depth edges ask themselves ([`Options::shared_columns`]).
//! - **Pixels on the epipole**, or as good as on it, are walked ([`Epipole::too_near`](geometry::Epipole::too_near)).
//! - **Lamps** without 1/d² (it cancels against the Jacobian), γ as a [`diamond_angle`](geometry::diamond_angle).
//! - **Cascades and cube faces** are cut from a slice by its light rays ([`for_each_line`](rows::for_each_line)).
//!
//! What these choices cost and gain is measured in the crate's README.
//!
//! # What it cannot do
//!
//! Orthographic cameras, lamps in height fog, and lamps in media with |g| > 0.99 are `Unsupported`. What is thinner than the gap
//! between two slices that agree is not seen. Factors of a lamp whose measured error is above 0.4 % (backward lobes over
//! long rays in thin fog) are not used: its pixels are walked one by one, which is slow.

pub mod geometry;

pub mod rows;

pub mod driver;

pub mod baran;

mod paper;

pub mod estimate;
mod options;
mod technique;
mod tool;

pub use baran::{Baran, DirectIntegrator};
pub use driver::{SliceDriver, SliceIntegrator};
pub use options::{ID, NearEpipole, Options};
pub use paper::SampledCells;
pub use technique::{CAPABILITIES, Epipolar};
pub use tool::{EpipolarTechnique, TECHNIQUE};
