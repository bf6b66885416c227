//! The ladder's rungs that need a GPU, in one process: a software driver compiles every shader once.

mod marcher;
mod robustness;
mod support;
