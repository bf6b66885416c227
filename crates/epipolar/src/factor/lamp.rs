//! Factors of a lamp's integrand as tables, in as many bands of b as an error asks for.
//!
//! With b the angle at the eye between view ray and lamp and g the angle at the lamp, the visible part of a ray is, up to a
//! factor of b, `∫ A(g, b)·cone·V dg` (see `lamp_kernel`). A spot's cone differs from slice to slice, so Γ is tabulated
//! by value; a slice multiplies it by its cone and integrates.
//!
//! Isotropic thin media need one product. Else A is about as hard in every octave of tan(b/2): where eight products over
//! all b miss the error, the range is cut into bands from its top, each as wide as the error allows.

use std::f64::consts::PI;

use super::lamp_fit::{Fit, Workspace, b_at, coordinate};
use super::lamp_kernel::Kernel;
use super::{LampMedium, MAX_RANK, interpolate};

/// Factors of one lamp for view rays with `b ∈ [b_min, b_max]`, tabulated.
#[derive(Debug, Clone, Default)]
pub struct LampFactors {
    rank: usize,
    lanes: usize,
    b_min: f64,
    b_max: f64,
    gamma: Vec<f32>,
    weights: Vec<f32>,
    error: f64,
}

/// Bands of [`LampFactors`] that cover a range of b, smallest b first.
#[derive(Debug, Clone, Default)]
pub struct LampBands {
    /// From the largest b down, as they are found; those behind `count` are kept for their memory.
    bands: Vec<LampFactors>,
    count: usize,
    space: Workspace,
}

impl LampBands {
    /// Most bands there are. What is left then becomes the last one, whatever its error.
    pub const MOST: usize = 24;

    /// The fewest bands of rank `max_rank` at most that keep `error` for `b ∈ [b_min, b_max]`, in radians.
    ///
    /// 0 ≤ b_min ≤ b_max < π. Ranks are 1, 2, 4 or 8, as lanes are. Look at [`Self::error`] whether it was reached: a
    /// backward lobe of g = −0.9 that rays see into, or 10⁻⁵, is not. Costs 0.1 to 0.3 ms a band.
    pub fn new(medium: &LampMedium<'_>, b_min: f64, b_max: f64, max_rank: usize, error: f64) -> Self {
        let mut bands = Self::default();
        bands.rebuild(medium, b_min, b_max, max_rank, error);
        bands
    }

    /// [`Self::new`] in place: allocates nothing when there are no more bands, and no longer tables, than before.
    pub fn rebuild(&mut self, medium: &LampMedium<'_>, b_min: f64, b_max: f64, max_rank: usize, error: f64) {
        /// Tries to find the width of a band before the error is given up.
        const TRIES: usize = 10;
        let kernel = Kernel::new(medium);
        let b_min = b_min.max(0.0).min(PI - 1e-3);
        let low = coordinate(&kernel, b_min);
        let mut high = coordinate(&kernel, b_max.max(b_min).min(PI - 1e-3));
        // Reading the tables errs too, and a fit's error is measured with coarser steps than a caller's.
        let target = 0.7 * error;
        let mut width = high - low;
        self.count = 0;
        loop {
            width = width.min(high - low);
            let mut fit = None;
            for attempt in 0..TRIES {
                let whole = width >= high - low;
                let range = (if whole { low } else { high - width }, high);
                let lower_ranks = [1, 2, 4].into_iter().filter(|&r| whole && r < max_rank);
                // Low ranks are tried where the band ends the range: nothing else makes its lanes fewer.
                for rank in lower_ranks.chain([max_rank.clamp(1, MAX_RANK)]) {
                    let candidate = Fit::new(&kernel, range, rank, &mut self.space);
                    let seen = candidate.error(|b| candidate.weights_at(b), &mut self.space);
                    let last = self.count + 1 == Self::MOST || attempt + 1 == TRIES;
                    let good = seen <= target;
                    if good || rank >= max_rank {
                        // Errors fall about as the width to the power of the rank.
                        let shrink = (target / seen).powf(1.0 / rank as f64);
                        if !good && !last {
                            width *= (0.95 * shrink).clamp(0.2, 0.9);
                        }
                        fit = (good || last).then_some((candidate, range));
                        break;
                    }
                }
                if fit.is_some() {
                    break;
                }
            }
            let Some((fit, mut range)) = fit else { break };
            if self.count + 1 == Self::MOST {
                range.0 = low;
            }
            if self.bands.len() == self.count {
                self.bands.push(LampFactors::default());
            }
            let ends = (if range.0 <= low { b_min } else { b_at(&kernel, range.0) }, b_at(&kernel, high));
            self.bands[self.count].tabulate(&kernel, &fit, ends, &mut self.space);
            self.count += 1;
            high = range.0;
            if high <= low {
                break;
            }
        }
        self.bands[..self.count].reverse();
    }

    /// The bands, smallest b first; each begins where the one before ends.
    pub fn bands(&self) -> &[LampFactors] {
        &self.bands[..self.count]
    }

    /// The band of a view ray at `b`.
    pub fn band_of(&self, b: f64) -> usize {
        self.bands().iter().position(|band| b <= band.b_max).unwrap_or(self.count.saturating_sub(1))
    }

    /// The largest error of all bands, see [`LampFactors::error`].
    pub fn error(&self) -> f64 {
        self.bands().iter().map(|band| band.error).fold(0.0, f64::max)
    }
}

impl LampFactors {
    /// How many products are summed, 1..=[`MAX_RANK`].
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Floats a node: the rank, padded with zeros to 1, 2, 4 or 8.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// The smallest b of the band, radians.
    pub fn b_min(&self) -> f64 {
        self.b_min
    }

    /// The largest b of the band, radians.
    pub fn b_max(&self) -> f64 {
        self.b_max
    }

    /// `Γₖ(g)` per radian, `[node][lane]`; nodes are uniform in g from 0 to π.
    pub fn gamma(&self) -> &[f32] {
        &self.gamma
    }

    /// `Bₖ(b)`, `[node][lane]`; nodes are uniform in b from b_min to b_max.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The error of vis for the worst visibility, measured between the points of the fit, plus that of reading Γ.
    ///
    /// It is a share of the unshadowed radiance of the whole ray, that is without cone: an estimate, no bound.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// `Γₖ` at `g` in [0, π].
    pub fn gamma_at(&self, g: f32, values: &mut [f32; MAX_RANK]) {
        interpolate(&self.gamma, self.lanes, g / std::f32::consts::PI, values);
    }

    /// `Bₖ` at `b` in [b_min, b_max].
    pub fn weights_at(&self, b: f32) -> [f32; MAX_RANK] {
        let mut values = [0.0; MAX_RANK];
        let span = (self.b_max - self.b_min) as f32;
        let position = if span > 0.0 { (b - self.b_min as f32) / span } else { 0.0 };
        interpolate(&self.weights, self.lanes, position, &mut values);
        values
    }

    /// Fills the tables from a fit.
    fn tabulate(
        &mut self,
        kernel: &Kernel<'_>,
        fit: &Fit<'_>,
        (b_min, b_max): (f64, f64),
        space: &mut Workspace,
    ) {
        (self.rank, self.lanes) = (fit.rank, fit.rank.next_power_of_two());
        (self.b_min, self.b_max) = (b_min, b_max);
        let feature = kernel.feature(b_min, b_max);
        // 70 a feature keep the error of a lobe's integral at 1e-4.
        let gamma_intervals = intervals(PI, feature, 70.0, 1024);
        let step = PI / gamma_intervals as f64;
        fill(&mut self.gamma, fit.rank, gamma_intervals, |share| fit.gamma_at(PI * share));
        // What 25 leave is part of the error that is measured.
        let weight_intervals = intervals(b_max - b_min, b_min + 0.5 * kernel.scale(), 25.0, 256);
        fill(&mut self.weights, fit.rank, weight_intervals, |share| {
            fit.weights_at(b_min + (b_max - b_min) * share)
        });
        // The trapezoidal rule on a lobe 1/(w + g)³ is off by h²/2w² of its integral.
        let reading = 0.5 * (step / feature).powi(2);
        self.error = fit.error(|b| self.weights_at(b as f32).map(f64::from), space) + reading;
    }
}

/// Intervals of a table of `length` in which nothing is shorter than `feature`, `per_feature` of them for each.
///
/// `LONGEST` leaves an error of 1e-3 for lobes of 0.01 (|g| = 0.99, close to the lamp) rather than tables of megabytes.
fn intervals(length: f64, feature: f64, per_feature: f64, shortest: usize) -> usize {
    const LONGEST: usize = 8192;
    ((length / feature.max(1e-9) * per_feature).min(LONGEST as f64) as usize).clamp(shortest, LONGEST)
}

/// A table of values at uniform places in [0, 1], `[node][lane]`; lanes from `rank` on are zero.
fn fill(table: &mut Vec<f32>, rank: usize, intervals: usize, values: impl Fn(f64) -> [f64; MAX_RANK]) {
    let lanes = rank.next_power_of_two();
    table.clear();
    table.resize((intervals + 1) * lanes, 0.0);
    for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
        let values = values(i as f64 / intervals as f64);
        node[..rank].iter_mut().zip(values).for_each(|(entry, value)| *entry = value as f32);
    }
}

#[cfg(test)]
mod tests;
