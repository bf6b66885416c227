//! Volumetric shadows by min/max mipmaps of the shadow map, after Chen et al. 2011 and Yusov 2012.
//!
//! A node of a min/max mipmap holds the nearest and the farthest depth of its texels. A view ray that stays before the
//! nearest one is lit all along the node, one that stays behind the farthest is dark all along; only where it does neither
//! does it descend. So a ray looks closely where shadows begin and end, and nowhere else.
//!
//! ```text
//! exact   MinMaxTree of each layer ──▶ view rays cut by the layers ──▶ descent ──▶ lit intervals ──▶ image
//! ```
//!
//! # Exact mode
//!
//! A quadtree over the whole map, traversed by every pixel's **own** ray; crossings with borders and with texels are solved,
//! so that the lit intervals are those of the exact walk through the map, and each is integrated in closed form. All lights,
//! maps, cameras and media of the model.

mod depth_codes;
mod exact;
mod options;
mod technique;
mod tool;
mod tree;

pub use depth_codes::DepthCodes;
pub use exact::Exact;
pub use options::{ID, Mode, Options};
pub use technique::{CAPABILITIES, MinMaxMipmap};
pub use tool::{MinMaxMipmapTechnique, TECHNIQUE};
pub use tree::{MinMaxTree, Node};
