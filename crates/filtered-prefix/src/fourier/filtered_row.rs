//! Fourier coefficients of a row, summed from the eye on (Klehm et al. 2014, Section 3.3, Listings 1 to 3: basis and prefix sum
//! in one pass).

use super::harmonics::{LANES, harmonics};
use crate::runs::Runs;
use crate::storage::{Means, Storage};

/// Most coefficients of a series.
pub const MOST: usize = 128;

/// Part of the depth range that is left free at either end, so that the series' period does not wrap.
const MARGIN: f32 = 0.05;

/// The filtered row of one reference ray; a buffer.
#[derive(Debug)]
pub struct FourierRow {
    means: Means,
    totals: Vec<f32>,
    count: usize,
    basis: Box<[[f32; LANES]; MOST]>,
}

impl Default for FourierRow {
    fn default() -> Self {
        Self { means: Means::default(), totals: Vec::new(), count: 0, basis: Box::new([[0.0; LANES]; MOST]) }
    }
}

/// Where in the series' period a number of columns lies.
#[inline(always)]
pub fn place(columns: f32, all: f32) -> f32 {
    MARGIN + (1.0 - 2.0 * MARGIN) * (columns / all)
}

impl FourierRow {
    /// Room for rows of so many runs.
    pub fn make_room(&mut self, storage: Storage, runs: usize, count: usize) {
        self.means.make_room(storage, runs + 1, count);
        self.count = count;
        if self.totals.len() <= runs {
            self.totals.resize(runs + 1, 0.0);
        }
    }

    /// Sums up the first runs, as many as `weights` has intervals: weights up to the start of each. `all` is the slice's number of
    /// columns.
    #[inline(always)]
    pub fn fill(&mut self, runs: &Runs<'_>, channel: usize, weights: &[f32], all: usize) {
        let colour = runs.colour(channel);
        let (used, terms) = (weights.len() - 1, self.count / 2);
        let mut sums = [0.0f32; MOST];
        let mut kept = [0.0f32; MOST];
        let mut total = 0.0f32;
        for first in (0..used).step_by(LANES) {
            let lanes = LANES.min(used - first);
            let mut z = [0.5f32; LANES];
            for lane in 0..lanes {
                z[lane] = place(runs.lit[first + lane] as f32, all as f32);
            }
            let basis = &mut self.basis;
            harmonics(&z, terms, |k, sines, cosines| (basis[2 * k], basis[2 * k + 1]) = (*sines, *cosines));
            for lane in 0..lanes {
                let run = first + lane;
                self.totals[run] = total;
                self.means.put(run, &kept[..2 * terms]);
                let mut weight = weights[run + 1] - weights[run];
                if let Some(colour) = colour {
                    weight *= colour[run];
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
        self.totals[used] = total;
        self.means.put(used, &kept[..2 * terms]);
    }

    /// Weight times colour up to the start of a run.
    #[inline(always)]
    pub fn total(&self, run: usize) -> f32 {
        self.totals[run]
    }

    /// The means up to the start of a run: sine and cosine in turn.
    #[inline(always)]
    pub fn means(&self, run: usize, out: &mut [f32]) {
        self.means.get(run, out);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.means.memory_bytes() + 4 * self.totals.capacity() + size_of::<[[f32; LANES]; MOST]>()
    }
}
