//! For tests, tools and reports on machines with a driver: a device of one's own, and every technique of this crate as a
//! `VolumetricShadow` that uploads a frame, submits, waits and reads back. Engines do none of that.

mod device;
mod epipolar_tool;
mod technique;
mod tool;

pub use device::{Bound, HarnessDevice, NoAdapter};
pub use technique::{EPIPOLAR_GPU_ID, GpuTechnique, MARCH_GPU_ID, MINMAX_GPU_ID};
pub use tool::{MarchSteps, NoOptions, TECHNIQUES, technique};
