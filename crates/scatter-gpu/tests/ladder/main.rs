//! The ladder's rungs that need a GPU, in one process: a software driver compiles every shader once.

mod functions;
mod in_slice;
mod marcher;
mod minmax;
mod minmax_stages;
mod robustness;
mod support;
