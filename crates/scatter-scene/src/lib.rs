//! Scenes for volumetric shadows: everything that a technique must not know.

mod atomic;
mod error;
mod gltf;
mod image_file;
mod load;
mod obj;
mod scene;
mod shot;

pub use atomic::{WriteSeek, write_atomically};
pub use error::{Fault, SceneError};
pub use image_file::{
    MAX_PIXELS, MAX_SIDE, Mask, RadianceImage, read_exr, read_linear_rgb, read_mask, write_exr, write_png,
};
pub use load::{MAX_COORDINATE, MAX_POSITIONS, MAX_TRIANGLES, load_scene};
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
pub use shot::{OwnedTexture, Shot, ShotLight, load_shot};
