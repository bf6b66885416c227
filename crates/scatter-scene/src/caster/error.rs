//! Why no rays can be cast against a scene.

use crate::translucent::OccluderError;

/// A scene that no rays can be cast against.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CasterError {
    /// A vertex that is not a point.
    #[error("vertex {index} is ({x}, {y}, {z}); give finite coordinates within ±1e15")]
    BadVertex {
        /// Its index in [`Scene::positions`](crate::Scene::positions).
        index: usize,
        /// Its coordinates.
        x: f64,
        /// Its coordinates.
        y: f64,
        /// Its coordinates.
        z: f64,
    },
    /// A triangle that names a vertex that is not there.
    #[error("triangle {triangle} uses vertex {vertex} of {count}; give indices below {count}")]
    BadIndex {
        /// Its index in [`Scene::triangles`](crate::Scene::triangles).
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// More triangles or vertices than 32-bit indices can name.
    #[error("the scene has {found} {what}; at most {limit} can be cast against; split the scene")]
    TooMany {
        /// `triangles` or `vertices`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// Smoke or hair that cannot dim light.
    #[error(transparent)]
    Occluder(#[from] OccluderError),
    /// A cut-out that is none.
    #[error("cut-out {index} {problem}")]
    BadCutout {
        /// Its index in [`Scene::cutouts`](crate::Scene::cutouts).
        index: usize,
        /// What is wrong, and the cure.
        problem: &'static str,
    },
}
