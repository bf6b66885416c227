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
//!   the next: along a slice the answer is that of the exact walk through the map ([`SliceView::rectify`](driver::SliceView::rectify)).
//! - **Tiles that are one run are not read**: the extrema of 16×16 texels say that all light rays of a stretch end behind the
//!   same view ray ([`MinMaxTiles`](rows::MinMaxTiles)). Indoors that is four texels in ten (`nave`) to seven (Sponza's gallery).
//! - **Light rays are runs** of neighbours that end at the same view ray; sums over runs are the same sums.
//! - **Bands of 1/sin β with shared factors** instead of a marched ring around the epipole ([`Around`]).
//! - **The answer is a share**: a quotient of two sums with the same factors, times the closed form. Unoccluded and dark
//!   pixels are exact at any rank.
//! - **Slices are spaced by measurement**: a sample of gaps is compared with a slice through its middle, and gaps whose
//!   two slices differ are halved for the pixels in doubt ([`Refinement`](driver::Refinement), [`ErrorTarget`](driver::ErrorTarget)).
//! - **Lamps** without 1/d² (it cancels against the Jacobian), γ as a monotone number without an arc tangent ([`diamond_angle`](geometry::diamond_angle)).
//!
//! # What was measured, and why the defaults are what they are
//!
//! 1280×960, 4096² maps, one thread (AMD EPYC, AVX-512), even slices one pixel apart
//! (`cargo xtask render --method epipolar --quality film --set spacing=1 --set halvings=0 --set split=0.25 … --threads 1
//! --compare shadow-map`): milliseconds of all slices, and p99 of the error in percent. Medians of three, good to about 5 %.
//!
//! | what | `arcade` | Sibenik's rose | `grove` |
//! | --- | --- | --- | --- |
//! | nothing else | 104, 0.92 | 111, 1.42 | 169, 3.14 |
//! | `integrator=blocks` | 109 | 114 | 177 |
//! | `integrator=sweep` | 107 | 109 | 169 |
//! | `integrator=tree`, the paper's | 114 | 121 | 197 |
//! | `integrator=cursor` | 112 | 117 | 185 |
//! | `factorisation=svd`, rank 4, the paper's | 105, 0.92 | 111, 1.42 | 170, 3.14 |
//! | Chebyshev, rank 4 | 102, 0.92 | 110, 1.42 | 174, 3.14 |
//! | `cells=uniform`, no prefilter | 139, 1.81 | 164, 2.89 | 207, 6.54 |
//! | `cells=modes`, four taps, the paper's | 234, 1.11 | 294, 1.83 | 370, 3.20 |
//! | `cells=box` | 271, 0.99 | 333, 2.18 | 416, 3.19 |
//! | `split=0`, exact: film's default | 111, 0.91 | 114, 1.13 | 181, 3.14 |
//! | `split=1` | 96, 1.00 | 108, 1.76 | 146, 3.15 |
//! | `resampling=rectified`, the paper's | 102, 1.02 (RMSE 7.2 %) | 112, 1.55 (4.9 %) | 166, 8.15 (5.7 %) |
//! | `around=ring`, the paper's (resolve included) | 116 | 128 | 179 |
//!
//! The first row with all other stages is 120, 128 and 186. A ring costs more than bands where it is on screen (the rose),
//! even though its 2,179 pixels are walked fast. The four integrators differ by a tenth or two, since a row is read in the
//! time that it takes to sum it; blocks gain a little where slices are far apart (Sponza's gallery, 4 px: blocks 53.5 ms,
//! sweep 54.2, tree 55.1, cursor 54.6), the sweep where they are close, and the default chooses by slice. What Baran et al.
//! report of prefiltering (ten times the samples without it) is here a factor of two in the error at one and the same
//! spacing. Cells that are sampled are slower than exact ones, which are vectors and step over uniform tiles.
//!
//! # Where the time goes
//!
//! `arcade`, slices 4 px apart, by a sampling profiler: sums and shares 45 %, rectifying rows 17 %, resolve 13 %, listing
//! pixels and handing answers out 15 %, the map's extrema 8 %. Reading the whole map once takes 6 ms (64 MB, 11 GB/s), so
//! that a frame is 12 to 16 times that. The statistics have the stages `extrema`, `probe`, `slices` (rows and sums run slice
//! by slice, so that rows stay in the innermost cache) and `resolve`. Summing bounds it where slices are coarse: 13 ns a
//! query, of which there are two a pixel. Rectifying weighs more where they are fine: nearly two fifths of Sibenik's rose and
//! of `grove`, a quarter of it and more waiting for texels.
//!
//! # What it cannot do
//!
//! Orthographic cameras, cascades, and lamps in media with |g| > 0.99 are `Unsupported`. What is thinner than the gap
//! between two slices that agree is not seen. Factors of a lamp whose measured error is above 0.4 % (backward lobes over
//! long rays in thin fog) are not used: its pixels are walked one by one, which is slow.

pub mod geometry;

pub mod rows;

pub mod driver;

pub mod baran;

mod paper;

mod options;
mod technique;
mod tool;

pub use baran::{Baran, DirectIntegrator};
pub use driver::{SliceDriver, SliceIntegrator};
pub use options::{Around, ID, Options};
pub use paper::SampledCells;
pub use technique::Epipolar;
pub use tool::{EpipolarTechnique, TECHNIQUE};
