//! The f32 tree over boxes in f64 space, and the walk of a ray through it: it proposes, f64 arithmetic decides.

mod bvh;
mod core_box;
mod ray_walk;

pub(crate) use bvh::{Bvh, F32_ROUNDING, Node, Pending};
pub(crate) use ray_walk::RayWalk;
