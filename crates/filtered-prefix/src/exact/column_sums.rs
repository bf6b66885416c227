//! Sums over the lit runs of a row for many view rays at once: runs come from the eye on and are added at the column up to which they
//! are lit; a view ray is asked when the run in which it ends comes.

/// Columns of a block, and blocks of a group. Larger ones cost every view ray more, smaller ones need a fourth level.
const SIDE: usize = 16;

/// End of a list.
const NONE: u32 = u32::MAX;

/// Floats that are added side by side.
const LANES: usize = 16;

/// Numbers that are summed side by side: 1, 2, 4 or 8.
pub type Terms<const N: usize> = [f32; N];

/// Runs of a row, and which columns ask.
#[derive(Clone, Copy)]
pub struct WeighedRuns<'a, const N: usize> {
    /// Columns, counted from the light, that see each run lit.
    pub lit: &'a [u32],
    /// What each run weighs, finite.
    pub weights: &'a [Terms<N>],
    /// First column that asks, counted from the light.
    pub first: u32,
    /// How many columns from there on ask, ≥ 1.
    pub columns: usize,
}

/// Sums of weights by the column up to which they are lit, in three levels: columns, blocks of them, groups of blocks. The column
/// farthest from the light comes first, so that what a column sees lit is what lies before it.
///
/// A run is three additions whatever it holds, a view ray one block of columns, one group of blocks and the groups before it, without a
/// branch that the scene decides: that is why rows of leaves cost no more than others. (The dual sweep of `epipolar`'s sums, with
/// blocks in place of a tree.)
#[derive(Debug, Default)]
pub struct ColumnSums {
    columns: Vec<f32>,
    blocks: Vec<f32>,
    groups: Vec<f32>,
    /// View rays that end in a run, as lists.
    heads: Vec<u32>,
    next: Vec<u32>,
}

/// Factors of what lies before a place among [`SIDE`], from `SIDE − place` on.
const BEFORE: [f32; 2 * SIDE] = {
    let mut factors = [0.0; 2 * SIDE];
    let mut place = 0;
    while place < SIDE {
        factors[place] = 1.0;
        place += 1;
    }
    factors
};

/// Adds those of sixteen sums that lie before a place.
#[inline(always)]
fn add_before<const N: usize>(sums: &[Terms<N>], place: usize, lanes: &mut [f32; LANES]) {
    let sums = &sums[place / SIDE * SIDE..][..SIDE];
    let factors = &BEFORE[SIDE - place % SIDE..][..SIDE];
    for (sums, factors) in sums.chunks_exact(LANES / N).zip(factors.chunks_exact(LANES / N)) {
        for (own, (sum, factor)) in sums.iter().zip(factors).enumerate() {
            for term in 0..N {
                lanes[own * N + term] += factor * sum[term];
            }
        }
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut Terms<N>, terms: &Terms<N>) {
    *sum = std::array::from_fn(|term| sum[term] + terms[term]);
}

impl ColumnSums {
    /// Room for so many runs, columns, queries and terms.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize, terms: usize) {
        let blocks = columns / SIDE + 1;
        let groups = blocks / SIDE + 1;
        for (list, length) in [
            (&mut self.columns, blocks * SIDE),
            (&mut self.blocks, groups * SIDE),
            (&mut self.groups, groups),
        ] {
            list.resize((length * terms).max(list.len()), 0.0);
        }
        self.heads.resize(runs.max(self.heads.len()), NONE);
        self.next.resize(queries.max(self.next.len()), NONE);
    }

    /// Writes for each view ray what the lit runs before the one in which it ends weigh. `asked` tells its column, counted from the
    /// light, and that run.
    ///
    /// O(runs + view rays), and a clear of the columns.
    #[inline(always)]
    pub fn sum<const N: usize>(
        &mut self,
        runs: WeighedRuns<'_, N>,
        asked: impl Fn(usize) -> (u32, u32),
        out: &mut [Terms<N>],
    ) {
        let WeighedRuns { lit, weights, first, columns } = runs;
        self.reserve(lit.len(), columns, out.len(), N);
        let Self { columns: sums, blocks, groups, heads, next } = self;
        let block_count = columns / SIDE + 1;
        let group_count = block_count / SIDE + 1;
        let sums = &mut sums.as_chunks_mut::<N>().0[..block_count * SIDE];
        let blocks = &mut blocks.as_chunks_mut::<N>().0[..group_count * SIDE];
        let groups = &mut groups.as_chunks_mut::<N>().0[..group_count];
        for list in [&mut *sums, &mut *blocks, &mut *groups] {
            list.fill([0.0; N]);
        }
        let heads = &mut heads[..lit.len()];
        heads.fill(NONE);
        for (query, next) in next[..out.len()].iter_mut().enumerate() {
            *next = std::mem::replace(&mut heads[asked(query).1 as usize], query as u32);
        }
        for ((&lit, weight), &head) in lit.iter().zip(weights).zip(&*heads) {
            let mut query = head;
            while query != NONE {
                let index = query as usize;
                let seen_before = columns - (asked(index).0 - first) as usize;
                let block = seen_before / SIDE;
                let mut lanes = [0.0; LANES];
                add_before(sums, seen_before, &mut lanes);
                add_before(blocks, block, &mut lanes);
                let mut sum: Terms<N> = std::array::from_fn(|term| {
                    // Halves on halves: as many wide additions as there are.
                    let mut width = LANES / 2;
                    let mut lanes = lanes;
                    while width >= N {
                        for lane in 0..width {
                            lanes[lane] += lanes[lane + width];
                        }
                        width /= 2;
                    }
                    lanes[term]
                });
                groups[..block / SIDE].iter().for_each(|group| add(&mut sum, group));
                out[index] = sum;
                query = next[index];
            }
            // Lit for no column: behind all that is asked for.
            let place = columns - ((lit.max(first) - first) as usize).min(columns);
            add(&mut sums[place], weight);
            add(&mut blocks[place / SIDE], weight);
            add(&mut groups[place / SIDE / SIDE], weight);
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = self.columns.capacity() + self.blocks.capacity() + self.groups.capacity();
        4 * (floats + self.heads.capacity() + self.next.capacity())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sums_of<const N: usize>(
        sums: &mut ColumnSums,
        lit: &[u32],
        [first, columns]: [u32; 2],
        asked: &[(u32, u32)],
    ) {
        let weight = |run: usize| 1.0 + (run % 7) as f32 / 8.0;
        let terms = |value: f32| std::array::from_fn(|term| (term + 1) as f32 * value);
        let weights: Vec<Terms<N>> = (0..lit.len()).map(|run| terms(weight(run))).collect();
        let mut out = vec![[f32::NAN; N]; asked.len()];
        let runs = WeighedRuns { lit, weights: &weights, first, columns: columns as usize };
        sums.sum(runs, |query| asked[query], &mut out);
        for (&(rank, end), found) in asked.iter().zip(out) {
            let exact: f32 = (0..end as usize).filter(|&run| lit[run] > rank).map(weight).sum();
            // Eighths up to 2¹²: exact.
            assert_eq!(found, terms(exact), "{rank} {end}");
        }
    }

    proptest! {
        #[test]
        fn sums_are_those_of_the_lit_runs(
            lit in prop::collection::vec(0u32..700, 1..400),
            first in 0u32..40,
            columns in 1u32..600,
            asked in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..60),
        ) {
            let asked: Vec<_> = asked
                .iter()
                .map(|(rank, run)| (first + rank.index(columns as usize) as u32, run.index(lit.len()) as u32))
                .collect();
            let mut sums = ColumnSums::default();
            // What an earlier slice has left behind must not matter.
            sums_of::<8>(&mut sums, &[30, 1, 500, 2].repeat(100), [0, 700], &[(3, 399), (3, 0)]);
            sums_of::<4>(&mut sums, &lit, [first, columns], &asked);
            sums_of::<1>(&mut sums, &lit, [first, columns], &asked);
            sums_of::<2>(&mut sums, &lit, [first, columns], &asked);
            sums_of::<8>(&mut sums, &lit, [first, columns], &asked);
        }
    }
}
