//! In-slice sums of `epipolar` on a GPU: for each view ray of a slice what it sees lit, `Σ Γ over γ < D, S(γ) > β` (Baran et
//! al. 2010, section 4), in integers.
//!
//! ```text
//! InSlice     runs, prefixes and asks of slices ──▶ tasks, asks sorted by chunks of runs
//! sums        the dual sweep, a workgroup a task   ──▶ answers
//! direct      every run before each ask's end      ──▶ the same bits
//! ```
//!
//! Prefixes are `round(2²⁹·∫Γ/max)` a term, so that sums telescope: a ray that sees all lit gets exactly its own prefix, one
//! that sees nothing 0, and any order of threads gives the same bits. The CPU twin is `epipolar`'s `baran::sums`; departures:
//! integers, four terms together, columns of a wide slice in several tasks.

mod mirror;
mod modules;
mod problem;

pub use mirror::answers_mirror;
pub use modules::{DIRECT, MODULES, SUMS};
pub use problem::{Ask, CHUNK, COLUMNS, InSlice, Task};
