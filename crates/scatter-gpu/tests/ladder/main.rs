//! The ladder's rungs that need a GPU, in one process: a software driver compiles every shader once.

mod epipolar;
mod epipolar_stages;
mod functions;
mod marcher;
mod minmax;
mod minmax_stages;
mod robustness;
mod support;
