//! The exact integral of a slice's rows, for the view rays whose certificate does not suffice: every lit stretch of their own
//! row, in closed form, by the pixel's own transmittances.

mod coloured;
#[cfg(test)]
mod lit_prefix;
mod plain_sun;
mod stretches;

pub use stretches::{ExactSums, ExactTask};
