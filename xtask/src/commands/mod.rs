//! One file a command: each reads its flags, calls the libraries, prints.

pub mod calibrate;
pub mod compare;
mod foreign;
#[cfg(feature = "gpu")]
pub mod gpu_report;
mod light_curves;
pub mod methods;
pub mod mutants;
mod page;
pub mod plan;
mod plan_survey;
pub mod render;
#[cfg(feature = "gpu")]
pub mod shaders;
pub mod shots;
pub mod stress;
mod sweep;
pub mod test;
pub mod tradeoff;
pub mod validate;
