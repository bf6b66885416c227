//! Maps of curves: one for each layer of the light, built from a frame and looked up by texel.

pub mod curve_maps;
pub mod layer;
pub mod layout;
pub mod node_lists;
pub mod opaque;
pub mod pyramid;
pub mod texels;
