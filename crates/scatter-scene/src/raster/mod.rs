//! Depth and shadow maps by a Vulkan raster pass: what the ray casts give, texel for texel, at a GPU's speed.
//!
//! ```text
//! RasterDevice::open     loader, instance, choice of a device, its queue
//! RasterScene::new       the caster's welded triangles and its cut-outs, uploaded once; the depth-only pipelines
//! DepthPass              a map's or a camera's rows, composed in f64 relative to the lamp, the eye or the map's middle
//! Target::render         draw, copy back in strips, decode to linear depth
//! texels_in_doubt        the few that the device's grid may have got wrong, which rays decide
//! ```
//!
//! A rasteriser snaps vertices to a grid of 1/256 texel, so silhouettes, cracks and surfaces seen edge on may differ from
//! ray casts; so may the borders of a cut-out's texels. Those texels are found from the triangles in f64 and cast (`doubt.rs`, `mask_doubt.rs`); all others hold the device's depth.
//! All of the crate's unsafe code is in this module.

mod cards;
mod choice;
mod device;
mod doubt;
mod error;
mod instance;
mod mask_doubt;
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
