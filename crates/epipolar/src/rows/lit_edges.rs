//! Where along a slice's light rays lit and dark runs meet, as one view ray after the other sees it.

/// Bits of a word.
const BITS: usize = u64::BITS as usize;

/// End of a list.
const NONE: u32 = u32::MAX;

/// The edges between lit and dark runs of a row, as a set of bits in two levels, for view rays that come nearer and nearer to the
/// light: a run that is lit for one of them is lit for all that follow.
///
/// Edge i is the start of run i, and is in the set if just one of the runs i − 1 and i is lit. A run that becomes lit changes
/// two bits; to list the edges of a view ray takes a step for each of them and one for each 4096 runs.
#[derive(Debug, Default)]
pub struct LitEdges {
    /// A bit an edge.
    words: Vec<u64>,
    /// A bit a word that is not 0.
    summary: Vec<u64>,
    /// Runs that a number of columns sees, as lists.
    heads: Vec<u32>,
    next: Vec<u32>,
    /// The column that sees the edges as they are.
    column: usize,
}

impl LitEdges {
    /// Room for `runs` runs and `columns` columns.
    pub fn reserve(&mut self, runs: usize, columns: usize) {
        let words = runs / BITS + 2;
        self.words.resize(words.max(self.words.len()), 0);
        self.summary.resize((words / BITS + 1).max(self.summary.len()), 0);
        self.heads.resize((columns + 1).max(self.heads.len()), NONE);
        self.next.resize((runs + 1).max(self.next.len()), NONE);
    }

    /// Edges of the first runs of a row as the column farthest from the light sees them. `lit` are the columns, counted from the
    /// light, that see each run lit; of them those from `first` on ask, `columns` ≥ 1 of them.
    #[inline(always)]
    pub fn fill(&mut self, lit: &[u32], first: u32, columns: usize) {
        self.reserve(lit.len(), columns);
        self.heads[..=columns].fill(NONE);
        self.summary.fill(0);
        let words = lit.len() / BITS + 1;
        let mut before = 0u64;
        for (index, word) in self.words[..words].iter_mut().enumerate() {
            let from = index * BITS;
            let mut bits = 0u64;
            for (bit, &lit) in lit[from..lit.len().min(from + BITS)].iter().enumerate() {
                let seen = (lit.max(first) - first) as usize;
                if seen >= columns {
                    bits |= 1 << bit;
                } else if seen > 0 {
                    self.next[from + bit] = self.heads[seen];
                    self.heads[seen] = (from + bit) as u32;
                }
            }
            *word = bits ^ (bits << 1 | before);
            before = bits >> (BITS - 1);
            self.summary[index / BITS] |= u64::from(*word != 0) << (index % BITS);
        }
        self.column = columns - 1;
    }

    /// Goes on to a column nearer to the light, counted from the first.
    #[inline(always)]
    pub fn advance(&mut self, column: usize) {
        while self.column > column {
            let mut run = self.heads[self.column];
            while run != NONE {
                self.toggle(run as usize);
                self.toggle(run as usize + 1);
                run = self.next[run as usize];
            }
            self.column -= 1;
        }
    }

    #[inline(always)]
    fn toggle(&mut self, edge: usize) {
        let index = edge / BITS;
        let word = self.words[index] ^ 1 << (edge % BITS);
        self.words[index] = word;
        let bit = 1 << (index % BITS);
        let summary = &mut self.summary[index / BITS];
        *summary = if word == 0 { *summary & !bit } else { *summary | bit };
    }

    /// Calls `visit` with the edges up to the start of run `last`, in order: lit stretches begin at the first, third, … and end
    /// at the second, fourth, …; the last one has no end if their number is odd.
    #[inline(always)]
    pub fn up_to(&self, last: usize, mut visit: impl FnMut(usize)) {
        let last_word = last / BITS;
        for index in 0..=last_word / BITS {
            let mut words = self.summary[index];
            while words != 0 {
                let word = index * BITS + words.trailing_zeros() as usize;
                words &= words - 1;
                if word > last_word {
                    return;
                }
                let mut bits = self.words[word];
                if word == last_word {
                    bits &= u64::MAX >> (BITS - 1 - last % BITS);
                }
                while bits != 0 {
                    visit(word * BITS + bits.trailing_zeros() as usize);
                    bits &= bits - 1;
                }
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * (self.words.capacity() + self.summary.capacity())
            + 4 * (self.heads.capacity() + self.next.capacity())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn edges_are_where_lit_and_dark_runs_meet(
            lit in prop::collection::vec(0u32..60, 1..400),
            first in 0u32..20,
            columns in 1usize..40,
            lasts in prop::collection::vec(any::<prop::sample::Index>(), 1..60),
        ) {
            let mut edges = LitEdges::default();
            // What an earlier slice has left behind must not matter.
            edges.fill(&[3, 1, 50, 2].repeat(200), 0, 30);
            edges.fill(&lit, first, columns);
            for (step, last) in lasts.iter().enumerate() {
                let column = (columns - 1).saturating_sub(step);
                edges.advance(column);
                let last = last.index(lit.len());
                let is_lit = |run: usize| lit[run] > first + column as u32;
                let expected: Vec<usize> =
                    (0..=last).filter(|&run| is_lit(run) != (run > 0 && is_lit(run - 1))).collect();
                let mut found = Vec::new();
                edges.up_to(last, |edge| found.push(edge));
                prop_assert_eq!(found, expected);
            }
        }
    }
}
