//! What makes maps of a frame's scene on request: ray casts, a raster pass, an engine's own renderer.

use crate::camera::Camera;
use crate::error::ModelError;
use crate::map_projection::MapProjection;

/// Makes depth and shadow maps of one scene, with the model's conventions (MODEL.md), texel for texel: for the frame
/// itself, and for techniques that want a map of their own.
///
/// Every method resizes `out` and fills all of it, `[row][column]` with row 0 on top, `+∞` for no surface. Surfaces before
/// the near plane of a parallel map count, at depth 0: they shadow all that the map sees.
pub trait MapSource: Sync {
    /// The distance along each pixel's ray to its first surface \[world units\].
    fn depth_map(&self, camera: &Camera, out: &mut Vec<f32>) -> Result<(), MapError>;

    /// The depth of the first surface along the light ray through each texel's centre, linear along the projection's
    /// axis: what a [`ShadowLayer`](crate::ShadowLayer) takes.
    fn shadow_map(&self, projection: &MapProjection, out: &mut Vec<f32>) -> Result<(), MapError>;

    /// The six faces around `position`, `[face][row][column]`: what a [`CubeShadow`](crate::CubeShadow) takes.
    fn cube_map(&self, position: [f64; 3], size: u32, out: &mut Vec<f32>) -> Result<(), MapError>;

    /// The depth `z/w` of the first surface (the smallest) through any column-major matrix, x right, y up,
    /// `size = [width, height]`: maps that no [`MapProjection`] describes, such as reversed or oblique ones.
    ///
    /// Surfaces before the near plane (`z < 0`) count, clamped to 0; what is behind the projection's centre
    /// (`w ≤ 0`) and beyond `z = w` does not.
    fn clip_map(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        out: &mut Vec<f32>,
    ) -> Result<(), MapError>;
}

/// Why a map could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The camera, the light, the projection or a size. Cure: in the message.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The source itself: a device without memory, say. Cure: in the message.
    #[error("{0}")]
    Source(String),
}

impl MapError {
    /// For a matrix of [`MapSource::clip_map`] without an inverse.
    pub fn singular_matrix() -> Self {
        Self::Model(ModelError::Degenerate {
            what: "clip_from_world",
            problem: "it is singular or not finite",
            cure: "give an invertible matrix",
        })
    }
}
