//! Factors read from their tables: Γ summed up to a light ray, B of a view ray, and the share that both make.

use crate::integrate::Terms;

/// The factors of the view rays.
pub struct Views<'a, const N: usize> {
    /// B.
    pub weights: Table<'a, N>,
    /// Coordinate of each column.
    pub views: &'a [f32],
    /// Coordinate at which the table begins.
    pub first: f32,
    /// Largest share.
    pub brightest: f32,
}

impl<const N: usize> Views<'_, N> {
    /// The factors of a column.
    #[inline(always)]
    pub fn at(&self, column: usize) -> Terms<N> {
        self.weights.at((self.views[column] - self.first).max(0.0))
    }

    /// The share that a lit sum has of the whole one.
    #[inline(always)]
    pub fn share(&self, view: &Terms<N>, sum: &Terms<N>, end: &Terms<N>) -> f32 {
        let (mut lit, mut whole) = (0.0f32, 0.0f32);
        for term in 0..N {
            lit += view[term] * sum[term];
            whole += view[term] * end[term];
        }
        // A ray without length has no shadow, and its radiance is 0 anyway.
        let share = lit / whole;
        let share = if share > 0.0 { share } else { 0.0 };
        let share = if share < self.brightest { share } else { self.brightest };
        if whole > 0.0 { share } else { 1.0 }
    }
}

/// A table of factors over a uniform grid, interpolated linearly.
pub struct Table<'a, const N: usize> {
    nodes: &'a [Terms<N>],
    per_unit: f32,
    last: f32,
}

impl<'a, const N: usize> Table<'a, N> {
    /// `scale` maps the argument to [0, 1].
    #[inline(always)]
    pub fn new(flat: &'a [f32], scale: f64) -> Self {
        let nodes = flat.as_chunks::<N>().0;
        let last = (nodes.len() - 1) as f32;
        Self { nodes, per_unit: (scale * f64::from(last)) as f32, last }
    }

    /// The terms at an argument ≥ 0; behind the last node those of it.
    #[inline(always)]
    pub fn at(&self, argument: f32) -> Terms<N> {
        /// 2²³: an f32 that it is added to shows its nearest integer in its lowest bits.
        const INTEGERS: f32 = 8_388_608.0;
        let place = argument * self.per_unit;
        let place = if place < self.last { place } else { self.last };
        // The node below, or where two are equally near the one below that: then `part` is 1.
        let below = if place > 0.5 { place - 0.5 } else { 0.0 };
        let below = if below < self.last - 1.0 { below } else { self.last - 1.0 } + INTEGERS;
        let part = place - (below - INTEGERS);
        let index = (below.to_bits() - INTEGERS.to_bits()) as usize;
        let [a, b] = &self.nodes[index..index + 2] else { unreachable!("a table has two nodes") };
        std::array::from_fn(|term| a[term] + part * (b[term] - a[term]))
    }
}
