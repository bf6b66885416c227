//! The definition: every run before every query's end.

use super::problem::{Problem, Terms, add};

/// O(queries · runs).
pub fn integrate<const N: usize>(problem: &Problem<'_, N>, out: &mut [Terms<N>]) {
    for (query, sum) in out.iter_mut().enumerate() {
        let (rank, end) = (problem.queries.ranks[query], problem.queries.runs[query] as usize);
        *sum = [0.0; N];
        for run in 0..end {
            if problem.runs.lit[run] > rank {
                add(sum, &problem.runs.whole(run));
            }
        }
        add(sum, &problem.last_part(query));
    }
}
