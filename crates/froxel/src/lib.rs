//! Froxels: the volumetric shadows that game engines ship, as an opponent of techniques that are exact (Wronski 2014).
//!
//! The view is cut into a camera-aligned grid, columns by rows by slices. One sample of the shadow map stands for a whole
//! froxel; light is added up front to back with Hillaire's energy-conserving integral (2015); pixels interpolate. The cost is
//! that of the grid, whatever the scene.
//!
//! ```text
//! grid     slices along the rays, places of samples, which pixels read which columns
//! light    shadow maps and glass at sixteen columns' samples; the unoccluded light of a slice
//! row      samples of a row of froxels ──▶ sums along the depth
//! resolve  four columns at the pixel's distance ──▶ lit share × the pixel's closed form ──▶ radiance
//! ```
//!
//! [`Froxel`] is the technique behind [`VolumetricShadow`](scatter_core::VolumetricShadow). What it is for: media that differ from
//! froxel to froxel, many lights, a cost that is known beforehand. Where it fails: thin shafts, edges of near surfaces; see
//! the crate's README for how far.

#![expect(
    clippy::needless_range_loop,
    reason = "lanes and channels of several arrays go side by side; an index says so, and the compiler makes vectors of it"
)]

mod estimate;
mod grid;
mod light;
mod options;
mod resolve;
mod row;
mod technique;
mod tool;

pub use options::{ID, Lookup, MOST_CELLS, MOST_FRAMES, MOST_SIDE, NEAR_SHARE, Options};
pub use technique::{CAPABILITIES, Froxel};
pub use tool::{FroxelTechnique, TECHNIQUE};
