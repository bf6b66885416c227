//! Scenes for volumetric shadows: everything that a technique must not know.

mod builtin;
mod caster;
mod error;
mod fit;
mod gltf;
mod load;
mod maps;
mod obj;
mod scene;
mod truth;

pub use builtin::{BuiltinFile, BuiltinFiles, BuiltinShot, ExportError, builtin_shots, export};
pub use caster::{CasterError, SceneCaster};
pub use error::{Fault, SceneError};
pub use fit::{FittedMap, fit_map};
pub use load::{MAX_COORDINATE, MAX_POSITIONS, MAX_TRIANGLES, load_scene};
pub use maps::ShotMaps;
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
pub use truth::RaycastTruth;
