//! Prefix sums over the lit runs of a row, kept up to date while view rays come nearer to the light: a sum up to any run is three
//! look-ups, whatever the row holds.

/// Numbers that are summed side by side: one a knot.
pub const KNOTS: usize = 4;

/// Runs of a block, and blocks of a group.
const SIDE: usize = 16;

/// End of a list.
const NONE: u32 = u32::MAX;

/// Weights of a run, by each knot.
pub type Terms = [f32; KNOTS];

/// Sums of the weights of lit runs before each run, for view rays that come nearer and nearer to the light: a run that is lit for one
/// of them is lit for all that follow.
///
/// Three levels: runs of a block, blocks of a group, groups. A run that becomes lit is added behind itself in each; sums are of
/// numbers ≥ 0, so nothing cancels.
#[derive(Debug, Default)]
pub struct LitPrefix {
    /// Lit weight of the runs before each run in its block.
    in_block: Vec<Terms>,
    /// Of the blocks before each block in its group.
    in_group: Vec<Terms>,
    /// Of the groups before each group.
    groups: Vec<Terms>,
    /// Runs that a number of columns sees, as lists.
    heads: Vec<u32>,
    next: Vec<u32>,
    /// The column that sees the sums as they are.
    column: usize,
}

#[inline(always)]
fn add(sum: &mut Terms, terms: &Terms) {
    for (sum, term) in sum.iter_mut().zip(terms) {
        *sum += term;
    }
}

impl LitPrefix {
    /// Room for `runs` runs and `columns` columns.
    pub fn reserve(&mut self, runs: usize, columns: usize) {
        let blocks = runs / SIDE + 1;
        let all_groups = blocks / SIDE + 1;
        let grow = |list: &mut Vec<Terms>, length: usize| {
            if list.len() < length {
                list.resize(length, [0.0; KNOTS]);
            }
        };
        grow(&mut self.in_block, (blocks + 1) * SIDE);
        grow(&mut self.in_group, (all_groups + 1) * SIDE);
        grow(&mut self.groups, all_groups + 1);
        self.heads.resize((columns + 1).max(self.heads.len()), NONE);
        self.next.resize((runs + 1).max(self.next.len()), NONE);
    }

    /// Sums of a row as the column farthest from the light sees them. `lit` are the columns, counted from the light, that see each run
    /// lit; of them those from `first` on ask, `columns` ≥ 1 of them.
    #[inline(always)]
    pub fn fill(&mut self, lit: &[u32], weights: &[Terms], first: u32, columns: usize) {
        self.reserve(lit.len(), columns);
        self.heads[..=columns].fill(NONE);
        let (mut block, mut group, mut all) = ([0.0; KNOTS], [0.0; KNOTS], [0.0; KNOTS]);
        for (run, (&lit, weight)) in lit.iter().zip(weights).enumerate() {
            if run % SIDE == 0 {
                add(&mut group, &block);
                block = [0.0; KNOTS];
                if run % (SIDE * SIDE) == 0 {
                    add(&mut all, &group);
                    group = [0.0; KNOTS];
                    self.groups[run / (SIDE * SIDE)] = all;
                }
                self.in_group[run / SIDE] = group;
            }
            self.in_block[run] = block;
            let seen = (lit.max(first) - first) as usize;
            if seen >= columns {
                add(&mut block, weight);
            } else if seen > 0 {
                self.next[run] = self.heads[seen];
                self.heads[seen] = run as u32;
            }
        }
        self.column = columns - 1;
    }

    /// Goes on to a column nearer to the light, counted from the first.
    #[inline(always)]
    pub fn advance(&mut self, column: usize, weights: &[Terms]) {
        while self.column > column {
            let mut run = self.heads[self.column];
            while run != NONE {
                self.add(run as usize, weights);
                run = self.next[run as usize];
            }
            self.column -= 1;
        }
    }

    #[inline(always)]
    fn add(&mut self, run: usize, weights: &[Terms]) {
        let weight = weights[run];
        let (block, group) = (run / SIDE, run / (SIDE * SIDE));
        for sum in &mut self.in_block[run + 1..(block + 1) * SIDE] {
            add(sum, &weight);
        }
        for sum in &mut self.in_group[block + 1..(group + 1) * SIDE] {
            add(sum, &weight);
        }
        for sum in &mut self.groups[group + 1..weights.len().div_ceil(SIDE * SIDE)] {
            add(sum, &weight);
        }
    }

    /// Lit weight of all runs before one.
    #[inline(always)]
    pub fn before(&self, run: usize) -> Terms {
        let mut sum = self.in_block[run];
        add(&mut sum, &self.in_group[run / SIDE]);
        add(&mut sum, &self.groups[run / (SIDE * SIDE)]);
        sum
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let terms = self.in_block.capacity() + self.in_group.capacity() + self.groups.capacity();
        size_of::<Terms>() * terms + 4 * (self.heads.capacity() + self.next.capacity())
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
            let weight = |run: usize| 1.0 + (run % 7) as f32 / 8.0;
            let weights: Vec<Terms> = (0..lit.len()).map(|run| [1.0, 2.0, 3.0, 4.0].map(|k| k * weight(run))).collect();
            let mut sums = LitPrefix::default();
            // What an earlier slice has left behind must not matter.
            let earlier = vec![[1.0; KNOTS]; 400];
            sums.fill(&[3, 1, 50, 2].repeat(100), &earlier, 0, 30);
            sums.advance(3, &earlier);
            sums.fill(&lit, &weights, first, columns);
            for (step, at) in asked.iter().enumerate() {
                let column = (columns - 1).saturating_sub(step);
                sums.advance(column, &weights);
                let run = at.index(lit.len());
                let rank = first + column as u32;
                let exact: f32 = (0..run).filter(|&n| lit[n] > rank).map(weight).sum();
                // Eighths up to 2¹²: exact.
                prop_assert_eq!(sums.before(run), [1.0, 2.0, 3.0, 4.0].map(|k| k * exact));
            }
        }
    }
}
