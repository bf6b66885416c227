//! Trees over the rows of epipolar slices, and view rays that are marched through them.
//!
//! ```text
//! slice_row        a slice's lines through the maps, in blocks, and the nodes over them (tree_kind: whose)
//! traversal        a view ray along a row ──▶ its lit runs
//! colours          lit runs cut where the light's texture changes
//! march            all of that for one ray after the other; lit runs in closed form by `epipolar`'s `LightSums`
//! tree_integrator  mode `slices`: every pixel asks its two slices
//! ```

mod colours;
mod march;
mod slice_row;
mod traversal;
mod tree_integrator;
mod tree_kind;

pub use march::{MarchCounts, SliceMarch};
pub use slice_row::SliceRow;
pub use traversal::{Looks, SliceRay};
pub use tree_integrator::TreeIntegrator;
pub use tree_kind::TreeKind;
