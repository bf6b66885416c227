//! For tests, tools and reports on machines with a driver: a device of one's own, and every technique of this crate as a
//! `VolumetricShadow` that uploads a frame, submits, waits and reads back. Engines do none of that.

mod adapter;
mod device;
mod epipolar_tool;
mod functions;
mod technique;
mod timing;
mod tool;

pub use adapter::{NoAdapter, adapter_names};
pub use device::{Bound, HarnessDevice};
pub use functions::{FunctionCheck, check_functions, functions_module};
pub use technique::{EPIPOLAR_GPU_ID, GpuTechnique, MARCH_GPU_ID, MINMAX_GPU_ID};
pub use timing::{FrameTimes, PassTime, timed};
pub use tool::{MarchSteps, NoOptions, TECHNIQUES, technique};
