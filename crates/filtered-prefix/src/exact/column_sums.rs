//! Sums over the lit runs of a row for many view rays at once: runs come from the eye on and are added at the column up to which they
//! are lit; a view ray is asked when the run in which it ends comes.

/// Columns of a block, and blocks that are added side by side. Larger ones cost every view ray more of its own block, smaller ones more
/// blocks.
const SIDE: usize = 16;

/// End of a list.
const NONE: u32 = u32::MAX;

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

/// Sums of weights by the column up to which they are lit, in two levels: columns, and blocks of them. The column farthest from the
/// light comes first, so that what a column sees lit is what lies before it.
///
/// A run is two additions whatever it holds, a view ray a block of columns and the blocks before it, all of them wide: that is why rows
/// of leaves cost no more than others. (The dual sweep of `epipolar`'s sums, with blocks in place of a tree. A third level makes a
/// view ray cheaper, but neighbouring runs would wait for each other's sums of it.)
#[derive(Debug, Default)]
pub struct ColumnSums {
    columns: Vec<f32>,
    blocks: Vec<f32>,
    /// Where each run is added.
    places: Vec<u32>,
    /// View rays that end in a run, as lists.
    heads: Vec<u32>,
    next: Vec<u32>,
}

/// Sums side by side, as wide as an instruction can be.
type Wide = [f32; 16];

/// Factors of what lies before a place among [`SIDE`], from `SIDE − place` on.
struct Before<const N: usize>;

impl<const N: usize> Before<N> {
    const FACTORS: [Terms<N>; 2 * SIDE] = {
        let mut factors = [[0.0; N]; 2 * SIDE];
        let mut place = 0;
        while place < SIDE {
            factors[place] = [1.0; N];
            place += 1;
        }
        factors
    };
}

/// Adds those of sixteen sums that lie before a place. (In plain lists of numbers: compilers would shuffle groups of them.)
#[inline(always)]
fn add_before<const N: usize>(lanes: &mut [Wide; 2], sums: &[Terms<N>], place: usize) {
    let sums = sums[place / SIDE * SIDE..][..SIDE].as_flattened().as_chunks::<16>().0;
    let factors = Before::<N>::FACTORS[SIDE - place % SIDE..][..SIDE].as_flattened().as_chunks::<16>().0;
    for (index, (sums, factors)) in sums.iter().zip(factors).enumerate() {
        let own = lanes[index % 2];
        lanes[index % 2] = std::array::from_fn(|lane| own[lane] + factors[lane] * sums[lane]);
    }
}

/// Adds sixteen sums.
#[inline(always)]
fn add_all<const N: usize>(lanes: &mut [Wide; 2], sums: &[Terms<N>]) {
    for (index, sums) in sums.as_flattened().as_chunks::<16>().0.iter().enumerate() {
        let own = lanes[index % 2];
        lanes[index % 2] = std::array::from_fn(|lane| own[lane] + sums[lane]);
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut Terms<N>, terms: &Terms<N>) {
    *sum = std::array::from_fn(|term| sum[term] + terms[term]);
}

/// The sum of all lanes of a term: halves on halves.
#[inline(always)]
fn total<const N: usize>([a, b]: &[Wide; 2]) -> Terms<N> {
    let sixteen: Wide = std::array::from_fn(|lane| a[lane] + b[lane]);
    let eight: [f32; 8] = std::array::from_fn(|lane| sixteen[lane] + sixteen[lane + 8]);
    let four: [f32; 4] = std::array::from_fn(|lane| eight[lane] + eight[lane + 4]);
    let two = [four[0] + four[2], four[1] + four[3]];
    std::array::from_fn(|term| match N {
        8 => eight[term],
        4 => four[term],
        2 => two[term],
        _ => two[0] + two[1],
    })
}

impl ColumnSums {
    /// Room for so many runs, columns, queries and terms.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize, terms: usize) {
        let [columns, blocks] = lengths(columns);
        self.columns.resize((columns * terms).max(self.columns.len()), 0.0);
        self.blocks.resize((blocks * terms).max(self.blocks.len()), 0.0);
        self.places.resize(runs.max(self.places.len()), 0);
        self.heads.resize(runs.max(self.heads.len()), NONE);
        self.next.resize(queries.max(self.next.len()), NONE);
    }

    /// Writes for each view ray, by its column counted from the light and the run in which it ends, what the lit runs before that one
    /// weigh.
    ///
    /// O(runs + view rays · columns / 256), and a clear of the columns.
    #[inline(always)]
    pub fn sum<const N: usize>(
        &mut self,
        runs: WeighedRuns<'_, N>,
        (ranks, ends): (&[u32], &[u32]),
        out: &mut [Terms<N>],
    ) {
        let WeighedRuns { lit, weights, first, columns } = runs;
        self.reserve(lit.len(), columns, out.len(), N);
        let Self { columns: sums, blocks, places, heads, next } = self;
        let [column_count, block_count] = lengths(columns);
        let sums = &mut sums.as_chunks_mut::<N>().0[..column_count];
        let blocks = &mut blocks.as_chunks_mut::<N>().0[..block_count];
        sums.fill([0.0; N]);
        blocks.fill([0.0; N]);
        let (places, heads) = (&mut places[..lit.len()], &mut heads[..lit.len()]);
        // Lit for no column: behind all that is asked for.
        let all = columns as u32;
        for (place, &lit) in places.iter_mut().zip(lit) {
            *place = all - lit.saturating_sub(first).min(all);
        }
        heads.fill(NONE);
        for (query, (&end, next)) in ends.iter().zip(&mut *next).enumerate() {
            *next = std::mem::replace(&mut heads[end as usize], query as u32);
        }
        for ((&place, weight), &head) in places.iter().zip(weights).zip(&*heads) {
            let mut query = head;
            while query != NONE {
                let index = query as usize;
                let seen_before = columns - (ranks[index] - first) as usize;
                let block = seen_before / SIDE;
                let mut lanes = [[0.0; 16]; 2];
                add_before(&mut lanes, sums, seen_before);
                add_before(&mut lanes, blocks, block);
                for blocks in blocks[..block / SIDE * SIDE].chunks_exact(SIDE) {
                    add_all(&mut lanes, blocks);
                }
                out[index] = total(&lanes);
                query = next[index];
            }
            add(&mut sums[place as usize], weight);
            add(&mut blocks[place as usize / SIDE], weight);
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.columns.capacity()
            + self.blocks.capacity()
            + self.places.capacity()
            + self.heads.capacity()
            + self.next.capacity())
    }
}

/// Sums that are held for so many columns: of columns, one more of them for what none sees, and of blocks.
fn lengths(columns: usize) -> [usize; 2] {
    let blocks = columns / SIDE + 1;
    [blocks * SIDE, blocks.next_multiple_of(SIDE)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sums_of<const N: usize>(
        sums: &mut ColumnSums,
        lit: &[u32],
        [first, columns]: [u32; 2],
        (ranks, ends): (&[u32], &[u32]),
    ) {
        let weight = |run: usize| 1.0 + (run % 7) as f32 / 8.0;
        let terms = |value: f32| std::array::from_fn(|term| (term + 1) as f32 * value);
        let weights: Vec<Terms<N>> = (0..lit.len()).map(|run| terms(weight(run))).collect();
        let mut out = vec![[f32::NAN; N]; ends.len()];
        let runs = WeighedRuns { lit, weights: &weights, first, columns: columns as usize };
        sums.sum(runs, (ranks, ends), &mut out);
        for ((&rank, &end), found) in ranks.iter().zip(ends).zip(out) {
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
            let ranks: Vec<_> = asked.iter().map(|(rank, _)| first + rank.index(columns as usize) as u32).collect();
            let ends: Vec<_> = asked.iter().map(|(_, run)| run.index(lit.len()) as u32).collect();
            let asked = (&ranks[..], &ends[..]);
            let mut sums = ColumnSums::default();
            // What an earlier slice has left behind must not matter.
            sums_of::<8>(&mut sums, &[30, 1, 500, 2].repeat(100), [0, 700], (&[3, 3], &[399, 0]));
            sums_of::<4>(&mut sums, &lit, [first, columns], asked);
            sums_of::<1>(&mut sums, &lit, [first, columns], asked);
            sums_of::<2>(&mut sums, &lit, [first, columns], asked);
            sums_of::<8>(&mut sums, &lit, [first, columns], asked);
        }
    }
}
