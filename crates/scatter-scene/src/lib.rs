//! Scenes for volumetric shadows: everything that a technique must not know.

mod atomic;
mod builtin;
mod caster;
mod cutout;
mod error;
mod exr_file;
mod fit;
mod gltf;
mod image_file;
mod limits;
mod load;
mod map_resolution;
mod maps;
mod obj;
mod radiance_image;
#[cfg(feature = "raster")]
mod raster;
mod regular_file;
mod scene;
mod shot;
mod texels;
mod text;
mod translucent;
mod tree;
mod truth;

pub use atomic::{WriteSeek, write_atomically};
pub use builtin::{
    BuiltinFile, BuiltinFiles, BuiltinShot, ExportError, builtin_shots, builtin_variants, export,
};
pub use caster::{CasterError, SceneCaster};
pub use cutout::{AlphaMask, Cutout, Wrap};
pub use error::{Fault, SceneError};
pub use exr_file::{ExrSource, read_exr, read_exr_with_source, write_exr};
pub use fit::{FittedMap, fit_map};
pub use image_file::{Mask, encode_png, read_linear_rgb, read_mask, write_png};
pub use limits::{MAX_COORDINATE, MAX_OCCLUDERS, MAX_POSITIONS, MAX_TRIANGLES};
pub use load::load_scene;
pub use map_resolution::MapResolution;
pub use maps::ShotMaps;
pub use radiance_image::{MAX_PIXELS, MAX_SIDE, RadianceImage};
#[cfg(feature = "raster")]
pub use raster::{
    DeviceChoice, DeviceInfo, DeviceKind, RasterDevice, RasterError, RasterOptions, RasterScene,
    raster_devices,
};
#[doc(no_inline)]
pub use scatter_core::{MapError, MapSource};
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
pub use shot::{OwnedTexture, Shot, ShotLight, load_shot};
pub use translucent::{OccluderError, Occluders, Particle, StrandVertex, Strands};
pub use truth::RaycastTruth;
