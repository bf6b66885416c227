//! Scenes for volumetric shadows: everything that a technique must not know.

mod scene;

pub use scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};
