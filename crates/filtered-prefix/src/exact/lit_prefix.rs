//! Prefix sums over the lit runs of a row, kept up to date while view rays come nearer to the light: a sum up to any run is three
//! look-ups, whatever the row holds.

/// Runs of a block, and blocks of a group.
const SIDE: usize = 16;

/// End of a list.
const NONE: u32 = u32::MAX;

/// Weights of two references side by side.
pub type Pair = [f32; 2];

/// Sums of the weights of lit runs before each run, for view rays that come nearer and nearer to the light: a run that is lit for one
/// of them is lit for all that follow.
///
/// Three levels: runs of a block, blocks of a group, groups. A run that becomes lit is added behind itself in each (sixteen lanes
/// at once in the first two); sums are of numbers ≥ 0, so nothing cancels.
#[derive(Debug, Default)]
pub struct LitPrefix {
    /// `[reference][run]`: lit weight of the runs before it in its block.
    in_block: [Vec<f32>; 2],
    /// `[reference][block]`: of the blocks before it in its group.
    in_group: [Vec<f32>; 2],
    /// `[reference][group]`: of the groups before it.
    groups: [Vec<f32>; 2],
    /// Runs that a number of columns sees, as lists.
    heads: Vec<u32>,
    next: Vec<u32>,
    /// The column that sees the sums as they are.
    column: usize,
}

impl LitPrefix {
    /// Room for `runs` runs and `columns` columns.
    pub fn reserve(&mut self, runs: usize, columns: usize) {
        let blocks = runs / SIDE + 1;
        let all_groups = blocks / SIDE + 1;
        let lists = [
            (&mut self.in_block, (blocks + 1) * SIDE),
            (&mut self.in_group, (all_groups + 1) * SIDE),
            (&mut self.groups, all_groups + 1),
        ];
        for (list, length) in lists {
            for list in list {
                if list.len() < length {
                    list.resize(length, 0.0);
                }
            }
        }
        self.heads.resize((columns + 1).max(self.heads.len()), NONE);
        self.next.resize((runs + 1).max(self.next.len()), NONE);
    }

    /// Sums of a row as the column farthest from the light sees them. `lit` are the columns, counted from the light, that see each run
    /// lit; of them those from `first` on ask, `columns` ≥ 1 of them. `weights` are up to the start of each run, one more than
    /// there are runs, for one reference or two.
    #[inline(always)]
    pub fn fill(&mut self, lit: &[u32], weights: [&[f32]; 2], first: u32, columns: usize) {
        let runs = lit.len();
        self.reserve(runs, columns);
        self.heads[..=columns].fill(NONE);
        for side in 0..2 {
            let [in_block, in_group, groups] =
                [&mut self.in_block[side], &mut self.in_group[side], &mut self.groups[side]];
            let weights = weights[side];
            let (mut block, mut group, mut all) = (0.0f32, 0.0f32, 0.0f32);
            for run in 0..=runs {
                if run % SIDE == 0 {
                    if run % (SIDE * SIDE) == 0 {
                        all += group + block;
                        groups[run / (SIDE * SIDE)] = all;
                        group = 0.0;
                    } else {
                        group += block;
                    }
                    in_group[run / SIDE] = group;
                    block = 0.0;
                }
                in_block[run] = block;
                if run < runs && (lit[run].max(first) - first) as usize >= columns {
                    block += weights[run + 1] - weights[run];
                }
            }
        }
        for (run, &lit) in lit.iter().enumerate() {
            let seen = (lit.max(first) - first) as usize;
            if seen > 0 && seen < columns {
                self.next[run] = self.heads[seen];
                self.heads[seen] = run as u32;
            }
        }
        self.column = columns - 1;
    }

    /// Goes on to a column nearer to the light, counted from the first; `last` is the last run that will be asked for.
    #[inline(always)]
    pub fn advance(&mut self, column: usize, weights: [&[f32]; 2], last: usize) {
        while self.column > column {
            let mut run = self.heads[self.column];
            while run != NONE {
                self.add(run as usize, weights, last);
                run = self.next[run as usize];
            }
            self.column -= 1;
        }
    }

    #[inline(always)]
    fn add(&mut self, run: usize, weights: [&[f32]; 2], last: usize) {
        let (block, group) = (run / SIDE, run / (SIDE * SIDE));
        for side in 0..2 {
            let weight = weights[side][run + 1] - weights[side][run];
            let behind = |from: usize, list: &mut [f32]| {
                let lanes = list.iter_mut().enumerate();
                lanes.for_each(|(lane, sum)| *sum += if lane > from { weight } else { 0.0 });
            };
            behind(run % SIDE, &mut self.in_block[side][block * SIDE..(block + 1) * SIDE]);
            behind(block % SIDE, &mut self.in_group[side][group * SIDE..(group + 1) * SIDE]);
            for sum in &mut self.groups[side][group + 1..=last / (SIDE * SIDE) + 1] {
                *sum += weight;
            }
        }
    }

    /// Lit weight of all runs before one.
    #[inline(always)]
    pub fn before(&self, run: usize) -> Pair {
        [0, 1].map(|side| {
            self.groups[side][run / (SIDE * SIDE)]
                + self.in_group[side][run / SIDE]
                + self.in_block[side][run]
        })
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = self.in_block.iter().chain(&self.in_group).chain(&self.groups);
        4 * (floats.map(Vec::capacity).sum::<usize>() + self.heads.capacity() + self.next.capacity())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sums_are_those_of_the_lit_runs(
            lit in prop::collection::vec(0u32..60, 1..700),
            first in 0u32..20,
            columns in 1usize..40,
            asked in prop::collection::vec(any::<prop::sample::Index>(), 1..60),
        ) {
            let weights: Vec<f32> = (0..=lit.len()).map(|n| n as f32 + (n % 7) as f32 / 8.0).collect();
            let twice: Vec<f32> = weights.iter().map(|w| 2.0 * w).collect();
            let mut sums = LitPrefix::default();
            // What an earlier slice has left behind must not matter.
            sums.fill(&[3, 1, 50, 2].repeat(100), [&vec![1.0; 401], &vec![2.0; 401]], 0, 30);
            sums.advance(3, [&vec![1.0; 401], &vec![2.0; 401]], 400);
            sums.fill(&lit, [&weights, &twice], first, columns);
            for (step, at) in asked.iter().enumerate() {
                let column = (columns - 1).saturating_sub(step);
                sums.advance(column, [&weights, &twice], lit.len() - 1);
                let run = at.index(lit.len());
                let rank = first + column as u32;
                let exact: f32 = (0..run).filter(|&n| lit[n] > rank).map(|n| weights[n + 1] - weights[n]).sum();
                let [one, two] = sums.before(run);
                // Eighths up to 2¹⁰: exact.
                prop_assert_eq!(one, exact);
                prop_assert_eq!(two, 2.0 * exact);
            }
        }
    }
}
