//! Factors read from their tables: Γ summed up to a light ray, B of a view ray, and the share that both make.

use super::sums::problem::Terms;

/// The factors of the view rays of one band.
pub struct Views<'a, const N: usize> {
    /// B of each column from the first on.
    pub terms: &'a [Terms<N>],
    /// The first column.
    pub first: u32,
}

impl<const N: usize> Views<'_, N> {
    /// `Σ Γ·B`: sums weighed by the factors of a column each. Spends the sums on it.
    #[inline(always)]
    pub fn weigh(&self, columns: &[u32], sums: &mut [Terms<N>], weighed: &mut [f32]) {
        for (&column, sum) in columns.iter().zip(&mut *sums) {
            let view = &self.terms[(column - self.first) as usize];
            *sum = std::array::from_fn(|term| sum[term] * view[term]);
        }
        for (weighed, sum) in weighed.iter_mut().zip(sums) {
            *weighed = sum.iter().fold(0.0, |sum, term| sum + term);
        }
    }
}

/// Turns lit sums into the shares that they have of whole ones.
#[inline(always)]
pub fn share_of(wholes: &[f32], brightest: f32, sums: &mut [f32]) {
    for (share, &whole) in sums.iter_mut().zip(wholes) {
        let own = *share / whole;
        let own = if own > 0.0 { own } else { 0.0 };
        let own = if own < brightest { own } else { brightest };
        // A ray without length has no shadow, and its radiance is 0 anyway.
        *share = if whole > 0.0 { own } else { 1.0 };
    }
}

/// Arguments that are placed side by side.
const BATCH: usize = 64;

/// A table of factors over a uniform grid, interpolated linearly.
pub struct Table<'a, const N: usize> {
    nodes: &'a [Terms<N>],
    first: f32,
    per_unit: f32,
    last: f32,
}

impl<'a, const N: usize> Table<'a, N> {
    /// A table that begins at an argument; `scale` maps the difference to it to [0, 1].
    #[inline(always)]
    pub fn new(flat: &'a [f32], first: f32, scale: f64) -> Self {
        let nodes = flat.as_chunks::<N>().0;
        let last = (nodes.len() - 1) as f32;
        Self { nodes, first, per_unit: (scale * f64::from(last)) as f32, last }
    }

    /// The terms at arguments; before the first node those of it, and behind the last node those of that.
    #[inline(always)]
    pub fn read(&self, arguments: &[f32], out: &mut [Terms<N>]) {
        let (mut nodes, mut parts) = ([0u32; BATCH], [0.0f32; BATCH]);
        for (arguments, out) in arguments.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            let places = nodes.iter_mut().zip(&mut parts);
            for ((node, part), &argument) in places.zip(arguments) {
                (*node, *part) = self.place(argument);
            }
            for (out, (&node, &part)) in out.iter_mut().zip(nodes.iter().zip(&parts)) {
                let [a, b] = &self.nodes[node as usize..][..2] else { unreachable!("two nodes") };
                *out = std::array::from_fn(|term| a[term] + part * (b[term] - a[term]));
            }
        }
    }

    /// The node before an argument, and how far it is from there to the next one.
    #[inline(always)]
    fn place(&self, argument: f32) -> (u32, f32) {
        /// 2²³: an f32 that it is added to shows its nearest integer in its lowest bits.
        const INTEGERS: f32 = 8_388_608.0;
        let place = (argument - self.first) * self.per_unit;
        let place = if place > 0.0 { place } else { 0.0 };
        let place = if place < self.last { place } else { self.last };
        // The node below, or where two are equally near the one below that: then `part` is 1.
        let below = if place > 0.5 { place - 0.5 } else { 0.0 };
        let below = if below < self.last - 1.0 { below } else { self.last - 1.0 } + INTEGERS;
        (below.to_bits() - INTEGERS.to_bits(), place - (below - INTEGERS))
    }
}
