//! Factors of a lamp's integrand as tables, in as many bands of b as an error asks for.
//!
//! With b the angle at the eye between view ray and lamp and g the angle at the lamp, the visible part of a ray is, up
//! to a factor of b, `∫ A(g, b)·cone·V dg` (see `lamp_kernel`). A spot's cone differs from slice to slice, so Γ is
//! tabulated by value; a slice multiplies it by its cone and integrates.
//!
//! Isotropic thin media need one product. Else A is about as hard in every octave of tan(b/2): where eight products over
//! all b miss the error, the range is cut into bands from its top, each as wide as the error allows. So many bands of
//! rank 8 keep 0.2 % for b from 3° to 75°, in fog of σL:
//!
//! | rays up to | phase function | 10⁻⁶ | 0.1 | 1 | 4 |
//! | --- | --- | --- | --- | --- | --- |
//! | 3·L | isotropic | 1 (rank 1) | 1 | 1 | 2 |
//! | 3·L | Rayleigh | 1 (rank 4) | 1 | 2 | 2 |
//! | 3·L | g = 0.9 | 1 | 1 | 2 | 1 |
//! | 3·L | g = −0.9 | 2 | 3 | 3 | 3 |
//! | 50·L | isotropic | 1 (rank 1) | 10 | 2 | 2 |
//! | 50·L | g = 0.9 | 1 | 6 | 2 | 1 |
//!
//! Long rays in thin fog are hard because light fades in a layer along the line b + g = π, of width `2·σL·sin b`: what
//! lies along a diagonal has no low rank. In fog of σL = 1 that layer is wide, at 10⁻⁶ it holds no light.

use std::f64::consts::PI;

use super::lamp_fit::{Fit, Workspace, b_at, coordinate};
use super::lamp_kernel::{Kernel, within};
use super::{LampMedium, MAX_RANK, interpolate};

/// Factors of one lamp for view rays with `b ∈ [b_min, b_max]`, tabulated (Baran et al. 2010, Section 9, in the angles at eye and
/// lamp: there 1/d² cancels against the Jacobian, and a thin isotropic medium has rank 1). Fitted, with a measured error.
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
        let kernel = Kernel::new(medium);
        let b_min = within(b_min, 0.0, PI - 1e-3);
        let b_max = within(b_max, b_min, PI - 1e-3);
        let low = coordinate(&kernel, b_min);
        let mut high = coordinate(&kernel, b_max);
        // The order in which they are found, so that each finds its own memory again.
        self.bands[..self.count].reverse();
        self.count = 0;
        let mut width = high - low;
        while self.count == 0 || high > low {
            // The last one that there may be takes all that is left.
            let narrowest = if self.count + 1 == Self::MOST { high - low } else { 0.0 };
            let search = Search { kernel: &kernel, low, high, max_rank: max_rank.clamp(1, MAX_RANK), error };
            let (fit, from) = search.widest(width.max(narrowest), narrowest, &mut self.space);
            if self.bands.len() == self.count {
                self.bands.push(LampFactors::default());
            }
            let ends = (if from <= low { b_min } else { b_at(&kernel, from) }, b_at(&kernel, high));
            self.bands[self.count].tabulate(&kernel, &fit, ends, &mut self.space);
            self.count += 1;
            (width, high) = (high - from, from);
        }
        self.bands[..self.count].reverse();
        self.keep_a_spare();
    }

    /// Memory for one band more: the camera's next step may ask for it.
    fn keep_a_spare(&mut self) {
        if self.bands.len() == self.count && self.count < Self::MOST {
            let widest = |table: fn(&LampFactors) -> &Vec<f32>| {
                self.bands.iter().map(|band| table(band).capacity()).max().unwrap_or(0)
            };
            let (gamma, weights) = (widest(|band| &band.gamma), widest(|band| &band.weights));
            let mut spare = LampFactors::default();
            spare.gamma.reserve(gamma);
            spare.weights.reserve(weights);
            self.bands.reserve(Self::MOST);
            self.bands.push(spare);
        }
    }

    /// The bands, smallest b first; each begins where the one before ends.
    pub fn bands(&self) -> &[LampFactors] {
        &self.bands[..self.count]
    }

    /// The band of a view ray at `b`, and where it begins and ends; the outermost ones take what lies outside.
    pub fn band_of(&self, b: f32) -> (usize, [f32; 2]) {
        let last = self.count.saturating_sub(1);
        let mut start = f32::NEG_INFINITY;
        for (index, band) in self.bands[..last].iter().enumerate() {
            let end = band.b_max as f32;
            if b < end {
                return (index, [start, end]);
            }
            start = end;
        }
        (last, [start, f32::INFINITY])
    }

    /// The largest error of all bands, see [`LampFactors::error`].
    pub fn error(&self) -> f64 {
        self.bands().iter().map(|band| band.error).fold(0.0, f64::max)
    }
}

/// The search for one band, between coordinates of b (see `lamp_fit`).
struct Search<'a> {
    kernel: &'a Kernel<'a>,
    /// Where the last band begins.
    low: f64,
    /// Where this one ends.
    high: f64,
    max_rank: usize,
    error: f64,
}

impl<'a> Search<'a> {
    /// The fit of a band as wide as keeps the error, at first `width`, never below `narrowest`; and where it begins.
    fn widest(&self, mut width: f64, narrowest: f64, space: &mut Workspace) -> (Fit<'a>, f64) {
        /// Tries before an error that cannot be reached is accepted as it is.
        const TRIES: usize = 10;
        let mut tries = 0;
        loop {
            tries += 1;
            let from = if width >= self.high - self.low { self.low } else { self.high - width };
            // Γ's table errs too, the weights' a little; where that is all there may be, the fit gets half.
            let (_, reading) =
                gamma_table(self.kernel, b_at(self.kernel, from), b_at(self.kernel, self.high));
            let target = (0.95 * self.error - reading).max(0.5 * self.error);
            // Where a band ends the range, narrower ones are not needed, but fewer lanes may do.
            let fewer = [1, 2, 4].into_iter().filter(|&rank| from == self.low && rank < self.max_rank);
            let mut seen = f64::INFINITY;
            for rank in fewer.chain([self.max_rank]) {
                let fit = Fit::new(self.kernel, (from, self.high), rank, space);
                seen = fit.error(|b| fit.weights_at(b), space);
                if seen <= target || (rank == self.max_rank && (width <= narrowest || tries == TRIES)) {
                    return (fit, from);
                }
            }
            // Errors fall about as the width to the power of the rank.
            let share = 0.95 * (target / seen).powf(1.0 / self.max_rank as f64);
            width = ((self.high - from) * share.clamp(0.2, 0.9)).max(narrowest);
        }
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

    /// `∫ Γₖ dg` from one angle to another, 0 ≤ from ≤ to ≤ π: exact for the table, however many of its nodes lie between.
    ///
    /// This, not Γ in the middle, is the weight of an interval that is longer than a lobe is wide.
    pub fn integral(&self, from: f64, to: f64) -> [f32; MAX_RANK] {
        let step = PI / (self.gamma.len() / self.lanes - 1) as f64;
        let mut sums = [0.0f64; MAX_RANK];
        let (mut left, mut right) = ([0.0; MAX_RANK], [0.0; MAX_RANK]);
        let mut at = from;
        self.gamma_at(at as f32, &mut left);
        while at < to {
            // The next node; a millionth of a step keeps rounding from finding the same one again.
            let next = (((at / step + 1e-6).floor() + 1.0) * step).min(to);
            self.gamma_at(next as f32, &mut right);
            for ((sum, l), r) in sums.iter_mut().zip(left).zip(right) {
                *sum += 0.5 * (next - at) * (f64::from(l) + f64::from(r));
            }
            (at, left) = (next, right);
        }
        sums.map(|sum| sum as f32)
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
        let (gamma_intervals, reading) = gamma_table(kernel, b_min, b_max);
        fill(&mut self.gamma, fit.rank, gamma_intervals, |share| fit.gamma_at(PI * share));
        // What 25 leave is part of the error that is measured.
        let weight_intervals = intervals(b_max - b_min, b_min + 0.5 * kernel.scale(), 25.0, 256);
        fill(&mut self.weights, fit.rank, weight_intervals, |share| {
            fit.weights_at(b_min + (b_max - b_min) * share)
        });
        self.error = (fit.error(|b| self.weights_at(b as f32).map(f64::from), space) + reading).min(1.0);
    }
}

/// Intervals of Γ's table for a band, and the error of integrals that are taken from it.
fn gamma_table(kernel: &Kernel<'_>, b_min: f64, b_max: f64) -> (usize, f64) {
    /// Keeps that error at 1e-4.
    const PER_FEATURE: f64 = 70.0;
    let feature = kernel.feature(b_min, b_max);
    let count = intervals(PI, feature, PER_FEATURE, 1024);
    // The trapezoidal rule on a lobe 1/(w + g)³ is off by h²/2w² of its integral.
    (count, 0.5 * (PI / count as f64 / feature).powi(2))
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
    let length = (intervals + 1) * lanes;
    table.clear();
    if table.capacity() < length {
        // Twice as much: the camera's next step may ask for a little more.
        table.reserve(2 * length);
    }
    table.resize(length, 0.0);
    for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
        let values = values(i as f64 / intervals as f64);
        node[..rank].iter_mut().zip(values).for_each(|(entry, value)| *entry = value as f32);
    }
}

#[cfg(test)]
mod tests;
