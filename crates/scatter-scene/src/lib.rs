//! Scenes for volumetric shadows: everything that a technique must not know.

mod caster;
mod scene;
mod truth;

pub use caster::{CasterError, SceneCaster};
pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
pub use truth::RaycastTruth;
