//! Sums over the lit light rays before each pixel: the in-slice problem `Σ Γ(γ)` over `γ < D, S(γ) > β` (Baran et al.
//! 2010, Sections 4 and 5), by five algorithms that are exact to each other.
//!
//! - [`SumAlgorithm::Blocks`]: view rays are swept towards the light; runs are added where they become lit, to prefix sums
//!   in three levels. A query is three look-ups, whatever the number of runs.
//! - [`SumAlgorithm::Tree`]: the paper's. View rays are swept from the light on; runs that end are zeroed in a
//!   half-stored partial-sum tree (Fenwick 1994), queries are prefix sums.
//! - [`SumAlgorithm::Cursor`]: the same sweep, with block sums and a prefix that moves along with the depth.
//! - [`SumAlgorithm::Sweep`]: the dual. Runs are swept from the eye on and added where they end; a query is a suffix sum
//!   over the view rays behind its own, asked when the sweep passes its depth.
//! - [`SumAlgorithm::Direct`]: O(queries·runs), the definition.

mod blocks;
mod direct;
pub(crate) mod fenwick;
pub mod problem;
mod sweep;

use self::problem::{Problem, SumScratch, Terms};
use crate::paper::{cursor, tree};

/// Which algorithm sums lit runs before each query (Baran et al. 2010, Sections 4 and 5: the tree). All are equal to the bit
/// where sums are exact; in f32 they differ by the order of summation. With r runs, q queries and c columns:
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SumAlgorithm {
    /// Prefix sums in three levels: O(r·(32 + r/256) + q).
    #[default]
    Blocks,
    /// Dual streaming sweep: O((r + q)·log c).
    Sweep,
    /// Primal partial-sum tree, the paper's: O((r + q)·log r).
    Tree,
    /// Primal blocks with a moving prefix: O(r + 16·q + the variation of where rays end / 16).
    Cursor,
    /// The definition, term by term: O(r·q).
    Direct,
}

impl SumAlgorithm {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Blocks, Self::Sweep, Self::Tree, Self::Cursor, Self::Direct];

    /// The fastest for a slice: blocks make queries cheap, the sweep runs. Measured to be equal at about as many of the one
    /// as of the other (foliage with slices half a pixel apart).
    pub fn fastest_for(queries: usize, runs: usize) -> Self {
        if queries >= runs { Self::Blocks } else { Self::Sweep }
    }
}

/// Sums the lit parts of every query's ray into `out`.
#[inline(always)]
pub fn sum_lit_runs<const N: usize>(
    algorithm: SumAlgorithm,
    problem: &Problem<'_, N>,
    scratch: &mut SumScratch,
    out: &mut [Terms<N>],
) {
    match algorithm {
        SumAlgorithm::Blocks => blocks::integrate(problem, scratch, out),
        SumAlgorithm::Sweep => sweep::integrate(problem, scratch, out),
        SumAlgorithm::Tree => tree::integrate(problem, scratch, out),
        SumAlgorithm::Cursor => cursor::integrate(problem, scratch, out),
        SumAlgorithm::Direct => direct::integrate(problem, out),
    }
}

#[cfg(test)]
mod tests;
