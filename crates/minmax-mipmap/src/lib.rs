//! Volumetric shadows by min/max mipmaps of the shadow map, after Chen et al. 2011 and Yusov 2012.
//!
//! A node of a min/max mipmap holds the nearest and the farthest depth of its texels. A view ray that stays before the
//! nearest one is lit all along the node, one that stays behind the farthest is dark all along; only where it does neither
//! does it descend. So a ray looks closely where shadows begin and end, and nowhere else.
//!
//! ```text
//! exact   MinMaxTree of each layer ──▶ view rays cut by the layers ──▶ descent ──▶ lit intervals ──▶ image
//!
//! slices     SliceRow with its tree, of each epipolar slice ──▶ a ray's lit runs ──▶ shares of its light
//! sampling   samples along slices ──▶ some marched, the others interpolated ──▶ pixels between slices ──▶ image
//! ```
//!
//! # Exact mode
//!
//! A quadtree over the whole map, traversed by every pixel's **own** ray; crossings with borders and with texels are solved,
//! so that the lit intervals are those of the exact walk through the map, and each is integrated in closed form. All lights,
//! maps, cameras and media of the model.
//!
//! # Modes on slices
//!
//! All view rays of an epipolar slice cross the same row of texels, so a binary tree over that row serves them all ([`slices`]).
//! Mode `slices` marches every pixel's ray through the trees of its two slices; mode `sampling` is epipolar sampling
//! ([`sampling`]): a few rays a slice, and interpolation. Both need an eye: orthographic cameras are refused. Interpolation promises
//! no error; what it misses is thinner than the gap between two slices, or between two samples, that agree.

mod depth_codes;
mod estimate;
mod exact;
mod options;
pub mod sampling;
pub mod slices;
mod technique;
mod tool;
mod tree;

pub use depth_codes::DepthCodes;
pub use exact::Exact;
pub use options::{Downscale, Edges, ID, MOST_HALVINGS, Mode, Options};
pub use sampling::Sampling;
pub use technique::{CAPABILITIES, MinMaxMipmap, SLICES_CAPABILITIES};
pub use tool::{MinMaxMipmapTechnique, TECHNIQUE};
pub use tree::{MinMaxTree, Node};
