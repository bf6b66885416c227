//! Scenes for volumetric shadows: everything that a technique must not know.

mod builtin;
mod scene;

pub use builtin::{BuiltinFile, BuiltinFiles, BuiltinShot, ExportError, builtin_shots, export};
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
