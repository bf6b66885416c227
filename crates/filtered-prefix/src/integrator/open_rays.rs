//! Which view rays of a slice are to be summed at all: where each ends, and what the row's extremes decide.

use epipolar::driver::{SliceQueries, SliceView};

use super::scratch::PrefixScratch;
use crate::runs::Runs;

impl PrefixScratch {
    /// Finds the run in which each view ray ends.
    #[inline(always)]
    pub(super) fn find_runs(&mut self, slice: &SliceView<'_>, runs: Runs<'_>, queries: &SliceQueries) {
        // Rays may be endless; behind the start of the last run there is nothing to be found.
        let reach = slice.reach().min(runs.starts[runs.starts.len() - 2]);
        self.index.fill(runs.starts, reach, queries.len());
        self.index.find(runs.starts, queries.gammas(), &mut self.query_runs);
    }

    /// Answers what the row's extremes decide (all of a ray's light is lit, or none), and lists the rest.
    #[inline(always)]
    pub(super) fn find_open(
        &mut self,
        slice: &SliceView<'_>,
        runs: Runs<'_>,
        (queries, channels): (&mut SliceQueries, usize),
    ) {
        let Self { query_runs, extremes, asked, counts, .. } = self;
        let last = query_runs[..queries.len()].iter().fold(0, |a, &b| a.max(b));
        extremes.fill(runs.lit, last as usize);
        let is_white = runs.colours.is_none();
        let open = queries.open(0..queries.len());
        let mut shares = open.shares;
        let all_queries = open.columns.len();
        asked.make_room(all_queries);
        let mut count = 0;
        for (query, (&column, &gamma)) in open.columns.iter().zip(open.gammas).enumerate() {
            let rank = slice.order.rank(slice.order.columns[0] + column);
            let [all, any] = extremes.all_and_any(query_runs[query], rank);
            let share = if any { 1.0 } else { 0.0 };
            shares[..channels].iter_mut().for_each(|shares| shares[query] = share);
            // Without a branch: what is settled is overwritten by the next one.
            asked.queries[count] = query as u32;
            asked.columns[count] = column;
            asked.ranks[count] = rank;
            asked.gammas[count] = gamma;
            asked.ends[count] = query_runs[query];
            count += usize::from(any & !(all & is_white));
        }
        asked.truncate(count);
        counts.uniform += (all_queries - count) as u64;
    }
}
