//! The light in the grid: how much there would be in each slice, and how much of it reaches the samples.

pub mod glass;
pub mod lamp;
pub mod occlusion;
pub mod paths;
pub mod sums;
pub mod sun;
