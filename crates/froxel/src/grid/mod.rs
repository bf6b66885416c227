//! The grid: where its slices, its samples and its columns lie, and which pixels read them.

pub mod footing;
pub mod jitter;
pub mod reach;
pub mod slices;
