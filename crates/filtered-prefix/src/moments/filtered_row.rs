//! Power moments of a row, summed from the eye on: Klehm's prefix sums (2014, Section 3.3) with the basis of Peters et al. (2016).
//!
//! ```text
//! b_j[i] = Σ_{l<i} w_l·z_l^j / Σ_{l<i} w_l,    j = 1 … m
//! ```
//!
//! over the runs that some view rays of a band see lit and some do not. z is the number of columns that see a run lit, scaled to
//! [−1, 1]. Sums are f64; what is kept are means.

use crate::runs::{Certain, DepthScale, Runs};
use crate::storage::{Means, Storage};

/// Numbers of a run, however many moments are asked for.
const STRIDE: usize = 8;

/// The filtered row of one reference ray; a buffer.
#[derive(Debug, Default)]
pub struct MomentRow {
    means: Means,
    /// Weight, times colour, up to the start of each run: of those that are in doubt, and of those that are lit for all.
    totals: Vec<[f32; 2]>,
}

impl MomentRow {
    /// Room for rows of so many runs.
    pub fn make_room(&mut self, storage: Storage, runs: usize) {
        self.means.make_room(storage, runs + 1, STRIDE);
        if self.totals.len() <= runs {
            self.totals.resize(runs + 1, [0.0; 2]);
        }
    }

    /// Sums up the first runs, as many as `weights` has intervals: weights up to the start of each.
    #[inline(always)]
    pub fn fill(&mut self, runs: &Runs<'_>, channel: usize, weights: &[f32], scale: DepthScale) {
        let colour = runs.colour(channel);
        let mut sums = [0.0f64; STRIDE];
        let (mut total, mut lit) = (0.0f64, 0.0f64);
        let mut kept = [0.0f32; STRIDE];
        for (run, pair) in weights.windows(2).enumerate() {
            self.totals[run] = [total as f32, lit as f32];
            self.means.put(run, &kept);
            // Rounding may let the light up to a light ray fall.
            let mut weight = f64::from(pair[1] - pair[0]).max(0.0);
            if let Some(colour) = colour {
                weight *= f64::from(colour[run]);
            }
            match scale.certain(runs.lit[run]) {
                Certain::Dark => continue,
                Certain::Lit => {
                    lit += weight;
                    continue;
                }
                Certain::No => {}
            }
            let z = scale.surface(runs.lit[run]);
            let (two, four) = (z * z, (z * z) * (z * z));
            let powers = [z, two, two * z, four, four * z, four * two, four * (two * z), four * four];
            total += weight;
            let inverse = if total > 0.0 { 1.0 / total } else { 0.0 };
            for ((sum, power), kept) in sums.iter_mut().zip(powers).zip(&mut kept) {
                *sum += weight * power;
                *kept = (*sum * inverse) as f32;
            }
        }
        let last = weights.len().saturating_sub(1);
        self.totals[last] = [total as f32, lit as f32];
        self.means.put(last, &kept);
    }

    /// Weight times colour up to the start of a run: of what is in doubt, and of what is lit for all.
    #[inline(always)]
    pub fn totals(&self, run: usize) -> [f32; 2] {
        self.totals[run]
    }

    /// The means b₁ to b₈ up to the start of a run.
    #[inline(always)]
    pub fn means(&self, run: usize) -> [f32; STRIDE] {
        let mut means = [0.0; STRIDE];
        self.means.get(run, &mut means);
        means
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.means.memory_bytes() + 8 * self.totals.capacity()
    }
}
