//! Fourier coefficients of a row, summed from the eye on (Klehm et al. 2014, Section 3.3, Listings 1 to 3: basis and prefix sum
//! in one pass).

use super::harmonics::{LANES, harmonics};
use crate::runs::{Certain, DepthScale, Runs};
use crate::storage::{Means, Storage};

/// Most coefficients of a series.
pub const MOST: usize = 128;

/// Part of the depth range that is left free at either end, so that the series' period does not wrap.
const MARGIN: f32 = 0.05;

/// The filtered row of one reference ray; a buffer.
#[derive(Debug)]
pub struct FourierRow {
    means: Means,
    /// Weight, times colour, up to the start of each run: of those that are in doubt, and of those that are lit for all.
    totals: Vec<[f32; 2]>,
    count: usize,
    basis: Box<[[f32; LANES]; MOST]>,
}

impl Default for FourierRow {
    fn default() -> Self {
        Self { means: Means::default(), totals: Vec::new(), count: 0, basis: Box::new([[0.0; LANES]; MOST]) }
    }
}

/// Where in the series' period a depth in [−1, 1] lies.
#[inline(always)]
pub fn place(depth: f64) -> f32 {
    0.5 + (0.5 - MARGIN) * depth as f32
}

impl FourierRow {
    /// Room for rows of so many runs.
    pub fn make_room(&mut self, storage: Storage, runs: usize, count: usize) {
        self.means.make_room(storage, runs + 1, count);
        self.count = count;
        if self.totals.len() <= runs {
            self.totals.resize(runs + 1, [0.0; 2]);
        }
    }

    /// Sums up the first runs, as many as `weights` has intervals: weights up to the start of each.
    #[inline(always)]
    pub fn fill(&mut self, runs: &Runs<'_>, channel: usize, weights: &[f32], scale: DepthScale) {
        let colour = runs.colour(channel);
        let (used, terms) = (weights.len() - 1, self.count / 2);
        let mut sums = [0.0f32; MOST];
        let mut kept = [0.0f32; MOST];
        let (mut total, mut lit) = (0.0f32, 0.0f32);
        for first in (0..used).step_by(LANES) {
            let lanes = LANES.min(used - first);
            let mut z = [0.5f32; LANES];
            for (z, &lit) in z.iter_mut().zip(&runs.lit[first..first + lanes]) {
                *z = place(scale.surface(lit).clamp(-1.0, 1.0));
            }
            let basis = &mut self.basis;
            harmonics(&z, terms, |k, sines, cosines| (basis[2 * k], basis[2 * k + 1]) = (*sines, *cosines));
            for lane in 0..lanes {
                let run = first + lane;
                self.totals[run] = [total, lit];
                self.means.put(run, &kept[..2 * terms]);
                // Rounding may let the light up to a light ray fall.
                let mut weight = (weights[run + 1] - weights[run]).max(0.0);
                if let Some(colour) = colour {
                    weight *= colour[run];
                }
                match scale.certain(runs.lit[run]) {
                    Certain::Dark => continue,
                    Certain::Lit => {
                        lit += weight;
                        continue;
                    }
                    Certain::No => {}
                }
                total += weight;
                let inverse = if total > 0.0 { 1.0 / total } else { 0.0 };
                let own = sums[..2 * terms].iter_mut().zip(&self.basis[..2 * terms]);
                for ((sum, basis), kept) in own.zip(&mut kept) {
                    *sum += weight * basis[lane];
                    *kept = *sum * inverse;
                }
            }
        }
        self.totals[used] = [total, lit];
        self.means.put(used, &kept[..2 * terms]);
    }

    /// Weight times colour up to the start of a run: of what is in doubt, and of what is lit for all.
    #[inline(always)]
    pub fn totals(&self, run: usize) -> [f32; 2] {
        self.totals[run]
    }

    /// The means up to the start of a run: sine and cosine in turn.
    #[inline(always)]
    pub fn means(&self, run: usize, out: &mut [f32]) {
        self.means.get(run, out);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.means.memory_bytes() + 8 * self.totals.capacity() + size_of::<[[f32; LANES]; MOST]>()
    }
}
