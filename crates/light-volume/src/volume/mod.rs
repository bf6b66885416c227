//! Light volumes of a shadow map: a closed mesh of caps and walls, or of triangles between texels' centres.
//!
//! ```text
//! cells       texels of about one depth become squares       (adaptive tessellation)
//! patch_faces caps and walls of a patch of 8×8 texels, or of a larger square
//! stepped     all patches of a layer, and a tree of the depths between which their faces lie
//! flatness    cells of about one plane become quads                  (adaptive tessellation)
//! stitching   sixteen ways to divide a quad beside finer ones        facet  one of its parts, in codes (code)
//! height_field  the interpolated surface: quads between centres, and a tree of their depths
//! square_tree what the image pass asks of either
//! polygons, triangles  the two as polygons in the world: for export, and to show that the mesh is closed
//! ```
//!
//! The mesh encloses what lies in the **shadow**, under all lights: our model is lit outside of the map, where the paper's
//! prism is dark, so the map's border is a wall from each texel's depth to infinity. [`polygons`] closes lamps' meshes the
//! paper's way, towards the lamp.

pub mod cells;
mod code;
pub mod face;
pub mod facet;
pub mod flatness;
pub mod height_field;
mod patch_faces;
pub mod polygons;
mod square_tree;
mod stepped;
pub mod stitching;
pub mod triangles;

pub use cells::Tolerance;
pub use code::code_of;
pub use face::{Axis, Chunk, Face};
pub use facet::{Facet, PackedFacet};
pub use height_field::HeightField;
pub use square_tree::SquareTree;
pub use stepped::{Patch, SteppedVolume, Tessellation};
