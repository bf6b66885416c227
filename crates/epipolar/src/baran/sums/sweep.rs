//! The dual sweep: runs from the eye on, added where they end; queries when the sweep passes their depth.
//!
//! `Σ over runs before D that end behind β` is a suffix sum, over the places where runs end, of all runs up to D.
//! Nothing is sorted: runs come in order, queries wait in lists at the run in which their rays end. The working set
//! is one number a column and term, not one a light ray.

use super::fenwick::Fenwick;
use super::problem::{Problem, SumScratch, Terms, add, groups};

/// End of a list.
const NONE: u32 = u32::MAX;

/// O((runs + queries)·log columns).
#[inline(always)]
pub fn integrate<const N: usize>(problem: &Problem<'_, N>, scratch: &mut SumScratch, out: &mut [Terms<N>]) {
    let runs = problem.runs.lit.len();
    let columns = problem.runs.column_count();
    let heads = &mut scratch.heads[..runs];
    heads.fill(NONE);
    let next = &mut scratch.next[..out.len()];
    for (query, &run) in problem.queries.runs.iter().enumerate() {
        next[query] = heads[run as usize];
        heads[run as usize] = query as u32;
    }
    // Entry `columns − 1 − …`: runs that end early come last, so that a suffix is a prefix.
    let mut ending = Fenwick::zeros(groups::<N>(&mut scratch.sums, columns));
    let mut lit_for_all = [0.0; N];
    for (run, &head) in heads.iter().enumerate() {
        let mut query = head;
        while query != NONE {
            let index = query as usize;
            // Columns − 1 entries: those that end behind this column, not those that all columns see.
            let mut sum = ending.prefix(columns - 1 - problem.column(index));
            add(&mut sum, &lit_for_all);
            add(&mut sum, &problem.last_part(index));
            out[index] = sum;
            query = next[index];
        }
        let lit = problem.runs.lit_columns(run);
        if lit == columns {
            add(&mut lit_for_all, &problem.runs.whole(run));
        } else if lit > 0 {
            ending.add(columns - 1 - lit, &problem.runs.whole(run));
        }
    }
}
