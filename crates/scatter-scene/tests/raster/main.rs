//! The raster pass against the ray casts, and what it does to a machine.

mod agreement;
mod cutouts;
mod driver;
mod robustness;
