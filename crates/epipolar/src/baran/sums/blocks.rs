//! Prefix sums in three levels: view rays towards the light, runs added where they become lit.
//!
//! Every run knows the lit sum of those before it in its block of sixteen, every block that of the blocks before it in its
//! span of sixteen, and every span that of the spans before it: a query is three look-ups. Adding a run changes a block,
//! a span's blocks and the spans, each with a few wide instructions and the same number of them for every run. Slices
//! have a few hundred runs that end, and thousands of pixels that ask (each slice answers for the pixels of two gaps), so
//! the work belongs to the runs. Sums only grow, so what nothing lights stays exactly 0.

use super::problem::{BLOCK, Problem, Runs, SPAN, SumScratch, Terms, add, groups};

/// End of a list.
const NONE: u32 = u32::MAX;

/// The sums before each run, as one column after the other sees them.
pub struct Blocks<'a, const N: usize> {
    runs: Runs<'a, N>,
    /// Per run: the sum of the lit runs before it in its block.
    in_block: &'a mut [Terms<N>],
    /// Per block: the sum of the blocks before it in its span.
    in_span: &'a mut [Terms<N>],
    /// Per span: the sum of the spans before it.
    spans: &'a mut [Terms<N>],
    /// Runs that a number of columns sees, as lists.
    heads: &'a mut [u32],
    next: &'a mut [u32],
    /// The column that sees the sums as they are.
    column: usize,
}

impl<'a, const N: usize> Blocks<'a, N> {
    /// Multiplies what is added to sixteen sums: nothing up to the one's own, all behind it.
    const BEHIND: [Terms<N>; 2 * BLOCK] = {
        let mut factors = [[0.0; N]; 2 * BLOCK];
        let mut entry = BLOCK;
        while entry < 2 * BLOCK {
            factors[entry] = [1.0; N];
            entry += 1;
        }
        factors
    };

    /// Sums as the last column sees them.
    #[inline(always)]
    pub fn new(runs: Runs<'a, N>, scratch: &'a mut SumScratch) -> Self {
        let (count, columns) = (runs.lit.len(), runs.column_count());
        let span_count = count.div_ceil(SPAN);
        let in_block = groups::<N>(&mut scratch.sums, span_count * SPAN);
        let (in_span, spans) =
            groups::<N>(&mut scratch.blocks, span_count * (BLOCK + 1)).split_at_mut(span_count * BLOCK);
        let (heads, next) = (&mut scratch.heads[..columns], &mut scratch.next[..count]);
        heads.fill(NONE);
        let mut before_span = [0.0; N];
        for (span, before) in spans.iter_mut().enumerate() {
            *before = before_span;
            let mut before_block = [0.0; N];
            for (block, before) in in_span[span * BLOCK..][..BLOCK].iter_mut().enumerate() {
                *before = before_block;
                let first = span * SPAN + block * BLOCK;
                let mut sum = [0.0; N];
                for (run, before) in (first..).zip(&mut in_block[first..][..BLOCK]) {
                    *before = sum;
                    let lit = if run < count { runs.lit_columns(run) } else { 0 };
                    if lit == columns {
                        add(&mut sum, &runs.whole(run));
                    } else if lit > 0 {
                        next[run] = heads[lit];
                        heads[lit] = run as u32;
                    }
                }
                add(&mut before_block, &sum);
            }
            add(&mut before_span, &before_block);
        }
        Self { runs, in_block, in_span, spans, heads, next, column: columns - 1 }
    }

    /// Goes on to a column nearer to the light, counted from the first.
    #[inline(always)]
    pub fn advance(&mut self, column: usize) {
        while self.column > column {
            let mut run = self.heads[self.column];
            while run != NONE {
                self.add(run as usize);
                run = self.next[run as usize];
            }
            self.column -= 1;
        }
    }

    #[inline(always)]
    fn add(&mut self, run: usize) {
        let terms = self.runs.whole(run);
        Self::add_behind(self.in_block, run, &terms);
        Self::add_behind(self.in_span, run / BLOCK, &terms);
        let own = run / SPAN;
        for (span, sum) in self.spans.iter_mut().enumerate() {
            let factor = if span > own { 1.0 } else { 0.0 };
            (0..N).for_each(|term| sum[term] += factor * terms[term]);
        }
    }

    /// Adds to the sums behind one among its sixteen.
    #[inline(always)]
    fn add_behind(sums: &mut [Terms<N>], place: usize, terms: &Terms<N>) {
        let sums = &mut sums[place / BLOCK * BLOCK..][..BLOCK];
        let factors = &Self::BEHIND[BLOCK - 1 - place % BLOCK..][..BLOCK];
        for (sum, factor) in sums.iter_mut().zip(factors) {
            *sum = std::array::from_fn(|term| sum[term] + factor[term] * terms[term]);
        }
    }

    /// The sum over all lit runs before a run.
    #[inline(always)]
    pub fn before(&self, run: usize) -> Terms<N> {
        let mut sum = self.spans[run / SPAN];
        add(&mut sum, &self.in_span[run / BLOCK]);
        add(&mut sum, &self.in_block[run]);
        sum
    }
}

/// O(runs that end · (32 + runs / 256) + queries).
#[inline(always)]
pub fn integrate<const N: usize>(problem: &Problem<'_, N>, scratch: &mut SumScratch, out: &mut [Terms<N>]) {
    let mut blocks = Blocks::new(problem.runs, scratch);
    let count = out.len();
    for step in 0..count {
        let query = if problem.ascending { count - 1 - step } else { step };
        blocks.advance(problem.column(query));
        let mut sum = blocks.before(problem.queries.runs[query] as usize);
        add(&mut sum, &problem.last_part(query));
        out[query] = sum;
    }
}
