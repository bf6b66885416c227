//! Ray casts against a scene: an f32 tree proposes triangles, f64 arithmetic on welded vertices decides.

mod cards;
mod error;
mod map_casts;
mod ray_plane;
mod scene_caster;
mod weld;

#[cfg(feature = "raster")]
pub(crate) use cards::Cards;
pub use error::CasterError;
#[cfg(feature = "raster")]
pub(crate) use map_casts::TexelLines;
pub(crate) use ray_plane::{PlanePoint, RayPlane, Segment};
pub use scene_caster::SceneCaster;
