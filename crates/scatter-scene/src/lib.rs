//! Scenes for volumetric shadows: everything that a technique must not know.

mod builtin;
mod error;
mod gltf;
mod load;
mod obj;
mod scene;

pub use builtin::{BuiltinFile, BuiltinFiles, BuiltinShot, ExportError, builtin_shots, export};
pub use error::{Fault, SceneError};
pub use load::{MAX_COORDINATE, MAX_POSITIONS, MAX_TRIANGLES, load_scene};
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
