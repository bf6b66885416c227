//! `epipolar` on a GPU (Baran et al. 2010): for each view ray of a slice what it sees lit, `Σ Γ over γ < D, S(γ) > β`, by the dual
//! sweep.
//!
//! ```text
//! CPU       epipole, slices, lines through the maps, bands, tables of the factors: f64, then bytes   (EpipolarPlan)
//! rows      a workgroup a slice:    the maps' texels ──▶ runs of light rays
//! sums      a workgroup a task:     runs, and the pixels beside the slice ──▶ shares × weights, added up a pixel
//! edges     the same in height fog: every view ray visits its runs, and takes a closed form where lit and dark meet
//! resolve   a thread a pixel:       unoccluded closed form × share ──▶ image
//! ```
//!
//! Slices whose rows do not fit one buffer are integrated in batches: `rows` and `sums` of one after those of the other.
//!
//! Prefixes are `round(2²⁹·∫Γ/max)` a term, so that sums telescope: a ray that sees all lit gets exactly its own prefix, one that
//! sees nothing 0, and any order of threads gives the same bits. The CPU twin is the crate `epipolar`, of which geometry, lines,
//! bands and factors are taken as they are. Departures from it: slices are even (no measured spacing, no halving, no shared
//! answers); integers; at most four terms; rows have room for two runs a texel column, two a pixel column and 256 more, beyond which texels are
//! not cut; answers are added in fixed point.

mod factor_tables;
mod mirror;
mod modules;
mod plan;
mod records;
mod room;
mod settings;
mod slice_records;

pub use factor_tables::{BAND_RATIO, FactorTable, FactorTables, TERMS, prefix_at};
pub use mirror::{Run, sum_mirror};
pub use modules::{EDGES, MODULES, RESOLVE_FLOAT, RESOLVE_HALF, ROWS, SUMS, SUMS_RAW};
pub use plan::{EpipolarCounts, EpipolarPlan};
pub use records::{
    CHUNK, COLUMNS, EpipolarUniform, GROUPS_A_ROW, MOST_BANDS, SliceData, SliceLine, SliceTask, UNIFORM,
    WHOLE, flags,
};
pub use room::Room;
pub use settings::EpipolarSettings;
