//! What a scene file holds once it is loaded: world-space triangles in f64, its cameras and its lights.

use glam::{DMat4, DVec3};

use crate::cutout::{AlphaMask, Cutout};
use crate::translucent::{Particle, Strands};

/// Two-sided triangles in world space, opaque or cut out by masks, with the cameras and lights that the file names.
///
/// Vertices are f64: a glTF position is f32 times its f64 node matrix, an OBJ position is parsed as f64.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// World-space positions. All finite. Equal positions are *not* welded here (the caster does that).
    pub positions: Vec<DVec3>,
    /// Vertex indices, three a triangle, all `< positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of which only a part is there, ascending by [`Cutout::triangle`], at most one entry a triangle. All
    /// others are opaque.
    pub cutouts: Vec<Cutout>,
    /// The masks that [`Self::cutouts`] name.
    pub masks: Vec<AlphaMask>,
    /// Spheres of smoke that dim light, in the order of the file.
    pub particles: Vec<Particle>,
    /// Hair and other polylines that dim light, in the order of the file.
    pub strands: Strands,
    /// Cameras in the order of the file's node hierarchy.
    pub cameras: Vec<SceneCamera>,
    /// KHR_lights_punctual lights in the order of the file's node hierarchy.
    pub lights: Vec<SceneLight>,
    /// What the loader left out (point and line primitives, say): one sentence each, for people.
    pub notes: Vec<String>,
}

/// A camera node: it looks along −z of `world_from_camera`, y up.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCamera {
    /// The node's name, or the camera's, or `camera-INDEX`.
    pub name: String,
    /// Node matrix; its scale does not matter to a camera.
    pub world_from_camera: DMat4,
    /// The lens.
    pub lens: SceneLens,
}

/// The lens of a [`SceneCamera`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneLens {
    /// Vertical field of view \[radians\], in (0, π).
    Perspective {
        /// Vertical field of view \[radians\].
        vertical_fov: f64,
    },
    /// Height of the view volume (twice glTF's `ymag`) in world units, > 0.
    Orthographic {
        /// World units from the bottom to the top of the image.
        height: f64,
    },
}

/// A light node: it shines along −z of `world_from_light`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLight {
    /// The node's name, or the light's, or `light-INDEX`.
    pub name: String,
    /// Node matrix.
    pub world_from_light: DMat4,
    /// Colour times intensity: irradiance (directional) or radiant intensity (point, spot), taken as given.
    pub strength: [f64; 3],
    /// The kind, with a spot's half angles.
    pub kind: SceneLightKind,
}

/// The kind of a [`SceneLight`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneLightKind {
    /// A sun.
    Directional,
    /// A lamp that shines in all directions.
    Point,
    /// A lamp with a cone; half angles \[radians\], 0 ≤ inner ≤ outer ≤ π/2.
    Spot {
        /// Full strength within this half angle.
        inner: f64,
        /// No light beyond this half angle.
        outer: f64,
    },
}
