//! The half-stored partial-sum tree (Fenwick 1994; Baran et al. 2010, Section 5): prefix sums of a changing array.

use super::{Terms, add};

/// Node i (from 1) holds the sum of the `i & −i` entries that end at i.
pub struct Fenwick<'a, const N: usize> {
    nodes: &'a mut [Terms<N>],
}

impl<'a, const N: usize> Fenwick<'a, N> {
    /// A tree of zeros over `nodes.len() − 1` entries.
    #[inline(always)]
    pub fn zeros(nodes: &'a mut [Terms<N>]) -> Self {
        nodes.fill([0.0; N]);
        Self { nodes }
    }

    /// A tree over entries that stand in `nodes[1..]`, in linear time.
    #[inline(always)]
    pub fn of_entries(nodes: &'a mut [Terms<N>]) -> Self {
        for node in 1..nodes.len() {
            let parent = node + (node & node.wrapping_neg());
            if parent < nodes.len() {
                let value = nodes[node];
                add(&mut nodes[parent], &value);
            }
        }
        Self { nodes }
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
    #[inline(always)]
    pub fn prefix(&self, count: usize) -> Terms<N> {
        let mut sum = [0.0; N];
        let mut node = count;
        while node > 0 {
            add(&mut sum, &self.nodes[node]);
            node &= node - 1;
        }
        sum
    }
}
