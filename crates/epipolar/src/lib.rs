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
//! # What was measured, and why the defaults are what they are
//!
//! 1280×960, 4096² maps, one thread (AMD EPYC, AVX-512), even slices one pixel apart
//! (`cargo xtask render --method epipolar --quality film --set spacing=1 --set halvings=0 … --threads 1 --compare
//! shadow-map`): milliseconds of all slices, and p99 of the error in percent. Medians of three, good to about 5 %.
//!
//! | what | `arcade` | Sibenik's rose | `grove` |
//! | --- | --- | --- | --- |
//! | the default | 153, 0.92 | 171, 1.42 | 281, 3.14 |
//! | `integrator=blocks` | 156 | 175 | 266 |
//! | `integrator=sweep` | 161 | 182 | 264 |
//! | `integrator=tree`, the paper's | 173 | 191 | 291 |
//! | `integrator=cursor` | 171 | 190 | 282 |
//! | `factorisation=svd`, rank 4, the paper's | 156, 0.92 | 172, 1.42 | 265, 3.14 |
//! | Chebyshev, rank 4 | 160, 0.92 | 175, 1.42 | 258, 3.14 |
//! | `cells=uniform`, no prefilter | 164, 1.81 | 207, 2.89 | 250, 6.54 |
//! | `cells=modes`, four taps, the paper's | 256, 1.11 | 345, 1.83 | 407, 3.20 |
//! | `cells=box` | 305, 0.99 | 387, 2.18 | 478, 3.19 |
//! | exact, `split=0` | 164, 0.91 | 179, 1.13 | 275, 3.14 |
//! | exact, `split=1` | 142, 1.00 | 173, 1.76 | 237, 3.15 |
//! | `resampling=rectified`, the paper's | 140, 1.02 (RMSE 7.2 %) | 163, 1.55 (4.9 %) | 232, 8.15 (5.7 %) |
//! | `around=ring`, the paper's (resolve included) | 176 | 239 | 273 |
//!
//! The default with resolve is 173, 189 and 302. A ring costs more than bands where it is on screen (the rose), even though
//! its 2,179 pixels are walked fast. The four integrators differ by a tenth, since a row is read in the time that it takes
//! to sum it; blocks gain where slices are far apart (Sponza's gallery, 4 px: blocks 82 ms, sweep 91, tree 94, cursor 97),
//! the sweep where they are close, and the default chooses by slice. What Baran et al. report of prefiltering (ten times the
//! samples without it) is here a factor of two in the error at one and the same spacing.
//!
//! # Where the time goes
//!
//! `arcade` at film, by a sampling profiler: sums and shares 48 %, rectifying rows 22 %, handing pixels out 15 %, resolve
//! 7 %, the map's extrema 5 %. Reading the whole map once takes 6 ms (64 MB, 11 GB/s), so that a frame is 20 to 25 times
//! that. The statistics have the stages `extrema`, `probe`, `slices` (rows and sums run slice by slice, so that rows stay in
//! the innermost cache) and `resolve`. Summing bounds it where slices are coarse, rectifying where they are fine: of `grove`
//! 30 %, of Sibenik's rose 38 %, half of it waiting for texels.
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

mod borders;
mod gap_pixels;

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
