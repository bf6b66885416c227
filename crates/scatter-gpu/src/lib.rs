//! Volumetric shadows on the GPU: encodes god rays into an engine's own wgpu command buffer.
//!
//! [`Gpu`] a device, [`View`] a camera and light; a frame is [`View::prepare`] (CPU set-up, `queue.write_buffer`),
//! [`View::encode`] (compute passes in the engine's encoder) and [`View::encode_composite`] (one full-screen triangle). Nothing
//! here submits, polls or maps.

pub mod capabilities;
mod composite;
mod error;
mod gpu;
#[cfg(all(feature = "harness", not(target_family = "wasm")))]
pub mod harness;
mod inputs;
mod technique;
mod view;

pub use error::GpuError;
pub use gpu::{Gpu, GpuOptions};
pub use inputs::Inputs;
pub use scatter_kernels as kernels;
pub use scatter_kernels::epipolar::EpipolarSettings;
pub use scatter_kernels::{GpuFrame, ShadowDepth};
pub use technique::Technique;
pub use view::{Compose, Output, Timing, View, ViewOptions};
pub use wgpu;
