//! Exact min/max on a GPU: which trees stand over a light's maps, which passes make and read them, and what that costs.
//!
//! ```text
//! extrema_low     texels ──▶ nearest and farthest depth of blocks of 4×4 to 64×64
//! extrema_high    ──▶ of coarser blocks
//! traverse        every pixel's own ray through the trees ──▶ lit runs ──▶ image
//! ```
//!
//! The CPU twin is `minmax-mipmap`'s exact mode, of which `descent.rs` has the same walk in f64; Chen et al. 2011, section 4,
//! for the test of a node. Departures: a quadtree over the whole map instead of a binary one over a rectified row (no
//! rectification, and any camera); nodes are depths themselves, not codes; rays enter at blocks of 64×64 texels and go a
//! level up where they leave a parent.

mod modules;
mod plan;
mod tree_layer;

pub use modules::{EXTREMA, MODULES, TRAVERSE_FLOAT, TRAVERSE_HALF};
pub use plan::{Looks, MinMaxPlan};
pub use tree_layer::{COARSEST, FINEST, TreeLayer};
