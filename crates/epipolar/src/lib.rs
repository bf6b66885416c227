//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.
//!
//! All view rays of an epipolar slice share the slice's light rays. A light ray is lit up to one depth and dark behind
//! it, so one pass over a slice finds what every one of its view rays sees of the light, instead of one march a pixel.
//!
//! ```text
//! camera, light ──▶ Epipole ──▶ SliceSet (sinh-spaced lines in fans) ──▶ FanPixels (each pixel in one gap)
//!                                        │
//! shadow map ──▶ Extrema (of its tiles)  │
//!      for each slice:   MapLine ──▶ Row (light rays as runs: rectify)
//!                        Factors (Γ·B) + Row + pixels ──▶ Integrator (blocks, sweep, tree, cursor) ──▶ shares
//!                                        │
//!      gaps whose slices differ get a slice in between ──▶ shares of the unoccluded light ──▶ resolve ──▶ image
//! ```
//!
//! # Departures from the paper
//!
//! - **The view ray's coordinate is the pixel column**, not the angle β: monotone in β, one division, and rectified view
//!   rays are the image's own. Each pixel asks its two slices with its own depth; nothing is resampled.
//! - **Cells end at the true texel crossings**, and a texel's flat surface is cut where it passes from one view ray to
//!   the next: along a slice the answer is that of the exact walk through the map ([`Cells::Exact`]).
//! - **Tiles that are one run are not read**: the extrema of 16×16 texels say that all light rays of a stretch end behind the
//!   same view ray ([`Extrema`]). Indoors that is four texels in ten (`nave`) to seven (Sponza's gallery).
//! - **Light rays are runs** of neighbours that end at the same view ray; sums over runs are the same sums.
//! - **Bands of 1/sin β with shared factors** instead of a marched ring around the epipole ([`Around`]).
//! - **The answer is a share**: a quotient of two sums with the same factors, times the closed form. Unoccluded and dark
//!   pixels are exact at any rank.
//! - **Slices are spaced by measurement**: a sample of gaps is compared with a slice through its middle, and gaps whose
//!   two slices differ are halved for the pixels in doubt ([`Refinement`], [`Aim`]).
//! - **Lamps** without 1/d² (it cancels against the Jacobian), γ as a monotone number without an arc tangent ([`turn`]).
//!
//! # What it cannot do
//!
//! Orthographic cameras, cascades, and lamps in media with |g| > 0.99 are `Unsupported`. What is thinner than the gap
//! between two slices that agree is not seen. Factors of a lamp whose measured error is above 0.4 % (backward lobes over
//! long rays in thin fog) are not used: its pixels are walked one by one, which is slow.

mod epipole;
mod fan_pixels;
mod slice_plane;
mod slices;

mod exact_cells;
mod extrema;
mod map_line;
mod row;
mod tint;

mod bands;
mod factor;
mod integrand;

mod integrate;

mod asks;
mod tables;

mod answer;
mod probe;
mod resolve;
mod shares;
mod slice_pass;

mod options;
mod technique;
mod tool;

pub use bands::Bands;
pub use epipole::Epipole;
pub use extrema::{Extrema, LayerExtrema, TILE};
pub use factor::{Factorisation, Factors, LampBands, LampFactors, LampMedium, MAX_RANK};
pub use fan_pixels::FanPixels;
pub use integrate::{
    Blocks, Integrator, IntegratorScratch, Problem, Queries, RunIndex, Runs, Terms, integrate,
};
pub use map_line::{ColumnOrder, Gamma, MapLine, direction_of_turn, turn};
pub use options::{Around, ID, Options};
pub use probe::Aim;
pub use row::{Cells, Row, Seen};
pub use slice_pass::{MOST_HALVINGS, Refinement, Resampling};
pub use slice_plane::{STEEPEST, SlicePlane};
pub use slices::{Fan, Major, Slice, SliceSet};
pub use technique::Epipolar;
pub use tool::{EpipolarTechnique, TECHNIQUE};
