//! Epipolar integration of volumetric shadows: Baran et al. 2010 in full, and what goes beyond it.

mod epipole;
mod fan_pixels;
mod slice_plane;
mod slices;

mod map_line;
mod row;
mod simd_level;
mod tint;

mod bands;
mod factor;
mod integrand;

mod integrate;

mod answer;
mod probe;
mod resolve;
mod shares;
mod slice_pass;

mod options;
mod technique;

pub use bands::Bands;
pub use epipole::Epipole;
pub use factor::{Factorisation, Factors, LampBands, LampFactors, LampMedium, MAX_RANK};
pub use fan_pixels::FanPixels;
pub use integrate::{Integrator, IntegratorScratch, Problem, Queries, RunIndex, Terms, integrate};
pub use map_line::{ColumnOrder, Gamma, MapLine, direction_of_turn, turn};
pub use options::{Around, EpipolarTechnique, Options, TECHNIQUE};
pub use probe::Aim;
pub use row::{Cells, Row, Seen};
pub use simd_level::{Level, chosen as chosen_level};
pub use slice_pass::{MOST_HALVINGS, Refinement, Resampling};
pub use slice_plane::{STEEPEST, SlicePlane};
pub use slices::{Fan, Major, Slice, SliceSet};
pub use technique::{Epipolar, ID};
