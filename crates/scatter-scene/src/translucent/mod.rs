//! Smoke and hair: spheres and polylines that dim light on its way (MODEL.md, "Translucent occluders").
//!
//! In order of work: a loader fills a [`Scene`](crate::Scene) with [`Particle`]s and [`Strands`]; [`Occluders`] checks them
//! and puts them into a tree; `capture` names the segments of a map's texels to techniques, through `map_rays` and
//! `map_bounds`; `closest` and `passes` say for one light ray which strands dim it, and where. The ray-cast truth asks the
//! same two for its own light rays.

mod capture;
mod closest;
mod map_bounds;
mod map_rays;
mod occluders;
mod particle;
mod passes;
#[cfg(test)]
pub(crate) mod second_way;
mod strands;
#[cfg(test)]
mod tests;
mod values;

pub(crate) use closest::{Closest, closest_on_segment};
pub(crate) use occluders::Occluder;
pub use occluders::{OccluderError, Occluders};
pub use particle::Particle;
pub(crate) use passes::{NearSegment, each_pass};
pub use strands::{StrandVertex, Strands};
pub(crate) use values::{
    OccluderValues, ParticleValues, StrandValues, checked_density, checked_opacity, checked_radius,
};
