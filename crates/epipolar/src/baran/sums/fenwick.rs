//! The half-stored partial-sum tree (Fenwick 1994; Baran et al. 2010, Section 5): prefix sums of a changing array.

use super::problem::{Terms, add};

/// Node i (from 1) holds the sum of the `i & −i` entries that end at i.
pub struct Fenwick<'a, const N: usize> {
    /// Node 0 stays 0.
    nodes: &'a mut [Terms<N>],
    /// Bits of the largest index.
    steps: u32,
}

impl<'a, const N: usize> Fenwick<'a, N> {
    /// A tree of zeros over `nodes.len() − 1` entries.
    #[inline(always)]
    pub fn zeros(nodes: &'a mut [Terms<N>]) -> Self {
        nodes.fill([0.0; N]);
        let steps = usize::BITS - (nodes.len() - 1).leading_zeros();
        Self { nodes, steps }
    }

    /// A tree over entries that stand in `nodes[1..]`, in linear time.
    #[inline(always)]
    pub fn of_entries(nodes: &'a mut [Terms<N>]) -> Self {
        nodes[0] = [0.0; N];
        let steps = usize::BITS - (nodes.len() - 1).leading_zeros();
        for node in 1..nodes.len() {
            let parent = node + (node & node.wrapping_neg());
            if parent < nodes.len() {
                let value = nodes[node];
                add(&mut nodes[parent], &value);
            }
        }
        Self { nodes, steps }
    }

    /// Adds to entry `index` (from 0): O(log n).
    #[inline(always)]
    pub fn add(&mut self, index: usize, terms: &Terms<N>) {
        let mut node = index + 1;
        while node < self.nodes.len() {
            add(&mut self.nodes[node], terms);
            node += node & node.wrapping_neg();
        }
    }

    /// Sum of the first `count` entries: O(log n).
    ///
    /// Takes as many steps for every count: node 0 is 0, and a step too many costs less than a branch that nobody can
    /// foresee (a quarter of a query's time, measured).
    #[inline(always)]
    pub fn prefix(&self, count: usize) -> Terms<N> {
        let mut sum = [0.0; N];
        let mut node = count;
        for _ in 0..self.steps {
            add(&mut sum, &self.nodes[node]);
            node &= node.wrapping_sub(1);
        }
        sum
    }
}
