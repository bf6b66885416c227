//! Volumetric shadows on the GPU without a GPU API: assembled WGSL, structs, pass plans, set-up as bytes.

pub mod epipolar;
mod frame_setup;
mod frame_uniform;
pub mod minmax;
pub mod modules;
pub mod plan;

pub use frame_setup::{GpuFrame, SetupError, ShadowDepth};
pub use frame_uniform::{FARTHEST, FrameUniform, MOST_PHASES, MapLayer, PhaseTerm, flags};
pub use modules::Module;
pub use plan::{Pass, Plan, PlanBuffer, TooLarge};
