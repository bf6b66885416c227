//! The factors of a sun's integrand as integers: prefixes that telescope, whatever the order of threads.
//!
//! A prefix is `round(2²⁹·Pₖ/max|Pₖ|)` at the nodes of a table, and between two of them `a + (b − a)·part`, in integers as well: of
//! lit runs each difference of two prefixes is exact, and so is their sum. Sums of a term that first falls and then rises stay
//! below three times 2²⁹, within i32.

use epipolar::baran::{Factorisation, Factors};
use scatter_core::Medium;

/// Where rays end for the sums: e⁻¹⁷ = 4e-8 of the light is left.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// Ratio of a band of 1/sin β. The same in every frame, so that factors last as long as medium and range do.
pub const BAND_RATIO: f64 = 2.0;

/// Terms of a sum: one vector of integers. Four keep 1.3e-3 at any optical depth (`Factors::bound`).
pub const TERMS: usize = 4;

/// Largest prefix.
const LARGEST: f64 = (1u32 << 29) as f64;

/// Most bits of a place between two nodes: products of integers of 32 bits hold them.
const MOST_BITS: u32 = 20;

/// One channel's table.
#[derive(Debug, Clone, Default)]
pub struct FactorTable {
    factors: Factors,
    /// What it was made of: σt, the longest ray, the error.
    key: [f64; 3],
    /// Prefixes at nodes that are uniform in γ.
    pub nodes: Vec<[i32; TERMS]>,
    /// What a unit of each term is worth.
    pub units: [f32; TERMS],
    /// Bits of a place between two nodes.
    pub bits: u32,
    /// Length of a view ray at which the table ends.
    pub length: f64,
}

/// The tables of a frame's channels, one or three.
#[derive(Debug, Clone, Default)]
pub struct FactorTables {
    tables: Vec<FactorTable>,
    count: usize,
}

impl FactorTables {
    /// For a uniform medium under a sun and view rays of at most `longest`; kept while these are.
    pub fn rebuild(&mut self, medium: &Medium, longest: f64, error: f64) {
        self.count = if medium.is_grey() { 1 } else { 3 };
        self.tables.resize_with(self.count.max(self.tables.len()), FactorTable::default);
        for (table, sigma) in self.tables.iter_mut().zip(medium.sigma_t()).take(self.count) {
            table.rebuild(sigma, longest, error);
        }
    }

    /// One a channel.
    pub fn channels(&self) -> &[FactorTable] {
        &self.tables[..self.count]
    }

    /// How far along a view ray light counts.
    pub fn longest(&self) -> f64 {
        self.channels().iter().map(|table| table.length).fold(0.0, f64::max)
    }
}

impl FactorTable {
    fn rebuild(&mut self, sigma: f64, longest: f64, error: f64) {
        let key = [sigma, longest, error];
        if self.key == key && !self.nodes.is_empty() {
            return;
        }
        self.key = key;
        let reach = if sigma > 0.0 { NEGLIGIBLE_OPTICAL_DEPTH / sigma } else { f64::MAX };
        self.length = longest.min(reach).clamp(1e-30, 1e18);
        let depth = sigma * self.length;
        let rank = Factors::rank_for(error, depth, BAND_RATIO).unwrap_or(TERMS).min(TERMS);
        self.factors.rebuild(Factorisation::Chebyshev, rank, depth, BAND_RATIO);
        let lanes = self.factors.lanes();
        let largest: [f64; TERMS] = std::array::from_fn(|term| {
            let values = self.factors.prefix().iter().skip(term).step_by(lanes);
            if term < rank { values.fold(0.0, |most, &value| f64::from(value.abs()).max(most)) } else { 0.0 }
        });
        self.units = largest.map(|most| (most / LARGEST) as f32);
        self.nodes.clear();
        self.nodes.extend(self.factors.prefix().chunks_exact(lanes).map(|node| {
            std::array::from_fn(|term| {
                let value = node.get(term).copied().unwrap_or(0.0);
                if largest[term] > 0.0 {
                    (f64::from(value) / largest[term] * LARGEST).round() as i32
                } else {
                    0
                }
            })
        }));
        // So that neither a place nor a product overflows: [`prefix_at`].
        let intervals = (self.nodes.len() - 1) as u32;
        let steepest = self
            .nodes
            .windows(2)
            .flat_map(|pair| (0..TERMS).map(|term| pair[0][term].abs_diff(pair[1][term])));
        let high = steepest.fold(0, u32::max) / 4096 + 2;
        self.bits = (30 - intervals.next_power_of_two().ilog2())
            .min(30 - high.next_power_of_two().ilog2())
            .min(MOST_BITS);
    }

    /// Intervals of the table.
    pub fn intervals(&self) -> u32 {
        (self.nodes.len() - 1) as u32
    }

    /// The bound of the factorisation's error ([`Factors::bound`]).
    pub fn bound(&self) -> f64 {
        self.factors.bound()
    }
}

/// The prefixes up to a light ray γ ≥ 0, given by its bits: `prefix_at` of `prefixes.wgsl`, to the bit.
pub fn prefix_at(nodes: &[[i32; TERMS]], bits: u32, scale: f32, gamma: u32) -> [i32; TERMS] {
    let intervals = (nodes.len() - 1) as u32;
    let last = intervals << bits;
    // One product of f32, correctly rounded everywhere; the rest are integers.
    let place = (f32::from_bits(gamma) * scale).min(last as f32) as u32;
    let node = (place >> bits).min(intervals - 1);
    let part = place - (node << bits);
    let (a, b) = (nodes[node as usize], nodes[node as usize + 1]);
    std::array::from_fn(|term| {
        let step = b[term] - a[term];
        let high = (step >> 12) * part as i32;
        let low = (step & 4095) as u32 * part;
        a[term] + (high >> (bits - 12)) + (low >> bits) as i32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::Phase;

    /// Against the table of f32 that it was made of, linearly between its nodes: half a unit of each of the two nodes, and
    /// one a floor; a place is rounded to f32.
    #[test]
    fn integer_prefixes_are_the_factors_prefixes() {
        for (sigma, longest) in [(0.0, 10.0), (0.01, 30.0), (1.0, 100.0), (2.0, 3.0)] {
            let medium = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).unwrap();
            let mut tables = FactorTables::default();
            tables.rebuild(&medium, longest, 2e-3);
            let [table] = tables.channels() else { panic!("one channel") };
            assert!(table.bits >= 12 && table.intervals() << table.bits <= 1 << 30);
            let scale = (f64::from(table.intervals() << table.bits) / table.length) as f32;
            let mut worst = 0.0f64;
            for n in 0..=4000u32 {
                let gamma = (table.length * f64::from(n) / 4000.0) as f32;
                let found = prefix_at(&table.nodes, table.bits, scale, gamma.to_bits());
                let mut expected = [0.0; 8];
                table.factors.prefix_at((f64::from(gamma) / table.length) as f32, &mut expected);
                for term in 0..TERMS {
                    let value = f64::from(found[term]) * f64::from(table.units[term]);
                    let unit = f64::from(table.units[term]) * LARGEST;
                    worst = worst.max((value - f64::from(expected[term])).abs() / unit.max(1e-300));
                }
            }
            println!(
                "σ {sigma}, {longest}: {worst:.1e} of the largest prefix, {} bits, bound {:.1e}",
                table.bits,
                table.bound()
            );
            // f32 of the reference, of the place (2⁻²⁴ of it, times the steepest slope) and of γ.
            assert!(worst < 4e-6, "{worst:e}");
        }
    }
}
