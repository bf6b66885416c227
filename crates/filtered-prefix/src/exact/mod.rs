//! The exact integral of a slice's rows, for the view rays whose certificate does not suffice: every lit stretch of their own
//! row, in closed form, by the pixel's own transmittances; or sums over all lit runs, for all view rays of the slice at once.

mod coloured;
mod column_sums;
mod edge_sums;
mod lit_prefix;
mod stretches;
mod summed_lamp;
mod summed_sun;
mod task;

pub use stretches::{ExactSums, has_many_edges};
pub use summed_lamp::{LampFactors, SummedLamp};
pub use summed_sun::band_ratio;
pub use task::{ExactTask, Ways};
