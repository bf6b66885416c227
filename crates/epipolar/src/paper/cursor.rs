//! The cursor: view rays from the light on, with block sums and a prefix that moves along with the depth.
//!
//! Neighbouring pixels end in neighbouring runs, so the prefix at one query is a few blocks away from that at the
//! last. Cost: O(runs + queries·block + total variation of the depth / block).

use super::tree::{Visit, sweep_view_rays};
use crate::baran::sums::problem::{BLOCK, Problem, SumScratch, Terms, add, groups};

/// Sums by cursor.
#[inline(always)]
pub fn integrate<const N: usize>(problem: &Problem<'_, N>, scratch: &mut SumScratch, out: &mut [Terms<N>]) {
    let runs = problem.runs.lit.len();
    let leaves = groups::<N>(&mut scratch.sums, runs);
    let blocks = groups::<N>(&mut scratch.blocks, runs.div_ceil(BLOCK) + 1);
    blocks.fill([0.0; N]);
    for run in 0..runs {
        leaves[run] = if problem.runs.lit_columns(run) > 0 { problem.runs.whole(run) } else { [0.0; N] };
        add(&mut blocks[run / BLOCK], &leaves[run]);
    }
    // Sum of the blocks before `at`.
    let (mut before, mut at) = ([0.0; N], 0);
    sweep_view_rays(problem, &mut scratch.heads, &mut scratch.next, |visit| match visit {
        Visit::End(run) => {
            let gone = leaves[run].map(|term| -term);
            leaves[run] = [0.0; N];
            add(&mut blocks[run / BLOCK], &gone);
            if run / BLOCK < at {
                add(&mut before, &gone);
            }
        }
        Visit::Query(query) => {
            let end = problem.queries.runs[query] as usize;
            while at < end / BLOCK {
                add(&mut before, &blocks[at]);
                at += 1;
            }
            while at > end / BLOCK {
                at -= 1;
                let block = blocks[at].map(|term| -term);
                add(&mut before, &block);
            }
            let mut sum = before;
            for leaf in &leaves[at * BLOCK..end] {
                add(&mut sum, leaf);
            }
            add(&mut sum, &problem.last_part(query));
            out[query] = sum;
        }
    });
}
