//! Depth and shadow maps by a Vulkan raster pass: what the ray casts give, texel for texel, at a GPU's speed.
//!
//! ```text
//! RasterDevice::open     loader, instance, choice of a device, its queue
//! RasterScene::new       the caster's welded triangles, uploaded once; the depth-only pipelines
//! DepthPass              a map's or a camera's rows, composed in f64 relative to the lamp, the eye or the map's middle
//! Target::render         draw, copy back in strips, decode to linear depth
//! ```
//!
//! A rasteriser snaps vertices to a grid of 1/256 texel or finer, so silhouettes may differ from ray casts by that much,
//! and depth by as much as a surface changes within it. All of the crate's unsafe code is in this module.

mod choice;
mod device;
mod error;
mod instance;
mod memory;
mod mesh;
mod pass;
mod pipeline;
mod scene;
mod target;
#[cfg(test)]
mod tests;

pub use choice::{DeviceChoice, DeviceInfo, DeviceKind};
pub use device::{RasterDevice, RasterOptions, raster_devices};
pub use error::RasterError;
pub use scene::RasterScene;
