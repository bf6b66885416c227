//! The paper's integrator: view rays from the light on, runs zeroed in a partial-sum tree as they end.

use crate::baran::sums::fenwick::Fenwick;
use crate::baran::sums::problem::{Problem, SumScratch, Terms, add, groups};

/// End of a list.
const NONE: u32 = u32::MAX;

/// Calls `end_run` and `query` in the order of the view rays: before each query, every run that has ended.
#[inline(always)]
pub fn sweep_view_rays<const N: usize>(
    problem: &Problem<'_, N>,
    heads: &mut [u32],
    next: &mut [u32],
    mut visit: impl FnMut(Visit),
) {
    let columns = problem.runs.column_count();
    let heads = &mut heads[..columns];
    heads.fill(NONE);
    for (run, next) in next[..problem.runs.lit.len()].iter_mut().enumerate() {
        let lit = problem.runs.lit_columns(run);
        if lit > 0 && lit < columns {
            *next = heads[lit];
            heads[lit] = run as u32;
        }
    }
    let mut ended = 0;
    let count = problem.queries.ranks.len();
    for step in 0..count {
        let query = if problem.ascending { step } else { count - 1 - step };
        let column = problem.column(query);
        while ended <= column {
            let mut run = heads[ended];
            while run != NONE {
                visit(Visit::End(run as usize));
                run = next[run as usize];
            }
            ended += 1;
        }
        visit(Visit::Query(query));
    }
}

/// What a sweep over view rays meets.
pub enum Visit {
    /// A run is dark from here on.
    End(usize),
    /// A query is to be answered.
    Query(usize),
}

/// O((runs + queries)·log runs).
#[inline(always)]
pub fn integrate<const N: usize>(problem: &Problem<'_, N>, scratch: &mut SumScratch, out: &mut [Terms<N>]) {
    let runs = problem.runs.lit.len();
    let nodes = groups::<N>(&mut scratch.sums, runs + 1);
    for run in 0..runs {
        nodes[run + 1] = if problem.runs.lit_columns(run) > 0 { problem.runs.whole(run) } else { [0.0; N] };
    }
    let mut tree = Fenwick::of_entries(nodes);
    sweep_view_rays(problem, &mut scratch.heads, &mut scratch.next, |visit| match visit {
        Visit::End(run) => tree.add(run, &problem.runs.whole(run).map(|term| -term)),
        Visit::Query(query) => {
            let mut sum = tree.prefix(problem.queries.runs[query] as usize);
            add(&mut sum, &problem.last_part(query));
            out[query] = sum;
        }
    });
}
