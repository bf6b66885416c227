//! What the light rays of a slice meet in the maps of the light: rectification.
//!
//! [`MapLine`] (a slice's line through one map, texel by texel) → [`for_each_line`] (through all maps of a light, each light
//! ray once) → [`Row`] (light rays as runs that end at the same view ray), stepping over what [`MinMaxTiles`] leave no doubt
//! of → [`TexturedRow`] (the same, cut where the light's colour changes).

mod exact_cells;
mod lamp_line;
mod light_lines;
mod lit_edges;
mod map_line;
mod min_max_tiles;
mod row;
mod run_index;
mod sun_line;
mod textured_row;

pub use light_lines::{for_each_line, for_each_sun_line, line_through};
pub use lit_edges::LitEdges;
pub use map_line::{DepthAlong, Gamma, MapLine, MapLineRecord, ViewRayLine};
pub use min_max_tiles::{LayerTiles, MinMaxTiles, TILE_SIDE, TileSide};
pub use row::{Row, RowSettings};
pub use run_index::RunIndex;
pub use textured_row::TexturedRow;

pub(crate) use map_line::FARTHEST;
