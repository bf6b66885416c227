//! A sun in a uniform medium, for rows of many edges and for coloured light: sums over all lit runs answer every view ray of a slice.
//!
//! The light of a run on the view ray at the angle β is `e^{−x_a·y} − e^{−x_b·y}` with y = 1/sin β, x = σ·γ. As a function of y it is
//! interpolated between four knots (equally spaced, in bands of y so narrow that the remainder does not count), each of which has
//! sums of its own: the exact counterpart of the reference rays of a filtered row.

use std::ops::Range;

use epipolar::driver::SliceQueries;

use super::column_sums::{ColumnSums, Terms, WeighedRuns};
use super::lit_prefix::{KNOTS, LitPrefix};
use super::task::ExactTask;
use crate::weights::absorbed;

/// Remainder of the interpolation, relative to the light of a run, over the fourth power of a band's width in optical depth, times
/// its exponential: `(Δ/3)⁴/4!`, by a product of distances to the knots of at most 1.
const REMAINDER: f64 = 1.0 / (81.0 * 24.0);

/// Remainder below which f32 sums no longer gain.
const LEAST_ERROR: f64 = 2e-6;

/// Widest band, as a ratio of 1/sin β.
const WIDEST: f64 = 4.0;

/// Buffers for the sums of a slice.
#[derive(Debug, Default)]
pub struct SummedSun {
    columns: ColumnSums,
    prefix: LitPrefix,
    /// Light of each run, by each knot.
    weights: Vec<Terms<KNOTS>>,
    /// `1 − e^{−x·y}` up to a run's start by the first knot, and from there to the next knot.
    absorbed: [Vec<f32>; 2],
    /// What each view ray has lit before its last run, by each knot.
    lit: Vec<Terms<KNOTS>>,
    /// Own losses of each view ray: up to the start of its last run, and up to its end.
    own: [Vec<f32>; 2],
}

/// Ratio of 1/sin β over a band such that interpolation is off by at most `error` of a share, for rays of a largest optical depth.
///
/// A ray at the band's near border that is as deep as can be has, at its far border, the ratio times that depth.
pub fn band_ratio(deepest: f64, error: f64) -> f64 {
    let error = error.max(LEAST_ERROR);
    let mut apart = deepest * (WIDEST - 1.0);
    for _ in 0..64 {
        if REMAINDER * apart.exp() * apart.powi(4) <= error {
            break;
        }
        apart *= 0.8;
    }
    if deepest > 0.0 { (1.0 + apart / deepest).clamp(1.001, WIDEST) } else { WIDEST }
}

/// A band of 1/sin β.
#[derive(Debug, Clone, Copy)]
struct Band {
    from: f32,
    to: f32,
}

impl Band {
    /// The band that holds a number ≥ 1.
    fn of(cosecant: f32, ratio: f64) -> Self {
        let power = (f64::from(cosecant).ln() / ratio.ln()).floor();
        let from = ratio.powf(power);
        // Rounding may put a border itself on its other side.
        let from = if from > f64::from(cosecant) { from / ratio } else { from };
        Self { from: from as f32, to: (from * ratio) as f32 }
    }

    /// From knot to knot.
    #[inline(always)]
    fn step(self) -> f32 {
        (self.to - self.from) * (1.0 / (KNOTS as f32 - 1.0))
    }

    /// The parts of the knots at a place (Lagrange).
    #[inline(always)]
    fn parts(self, at: f32) -> Terms<KNOTS> {
        let t = (at - self.from) / self.step();
        let [a, b, c, d] = [t, t - 1.0, t - 2.0, t - 3.0];
        [b * c * d * (-1.0 / 6.0), a * c * d * 0.5, a * b * d * -0.5, a * b * c * (1.0 / 6.0)]
    }
}

impl SummedSun {
    /// Room for slices of so many runs, columns and queries.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize) {
        self.columns.reserve(runs, columns, queries, KNOTS);
        self.prefix.reserve(runs, columns);
        self.weights.resize((runs + 1).max(self.weights.len()), [0.0; KNOTS]);
        self.lit.resize(queries.max(self.lit.len()), [0.0; KNOTS]);
        for list in &mut self.absorbed {
            list.resize((runs + 2).max(list.len()), 0.0);
        }
        for list in &mut self.own {
            list.resize(queries.max(list.len()), 0.0);
        }
    }

    /// Writes the shares of the view rays in doubt, in bands of a ratio a channel.
    ///
    /// A band costs two exponentials and three additions a run, and as many exponentials and a few wide additions a view ray.
    #[inline(always)]
    pub fn sum(&mut self, task: &ExactTask<'_>, ratios: &[f64; 3], queries: &mut SliceQueries) {
        let sines = task.slice.sines();
        let columns = &task.asked.columns;
        let count = columns.len();
        for (channel, &ratio) in ratios.iter().enumerate().take(task.channels) {
            let mut first = 0;
            while first < count {
                let band = Band::of(1.0 / sines[columns[first] as usize], ratio);
                let is_beyond = |&column: &u32| {
                    let cosecant = 1.0 / sines[column as usize];
                    !(cosecant >= band.from && cosecant < band.to)
                };
                let end = columns[first + 1..].iter().position(is_beyond);
                let end = end.map_or(count, |more| first + 1 + more);
                self.sum_band(task, channel, (band, first..end), queries);
                first = end;
            }
        }
    }

    #[inline(always)]
    fn sum_band(
        &mut self,
        task: &ExactTask<'_>,
        channel: usize,
        (band, rays): (Band, Range<usize>),
        queries: &mut SliceQueries,
    ) {
        let ExactTask { slice, runs, asked, .. } = task;
        let (columns, ranks) = (&asked.columns[rays.clone()], &asked.ranks[rays.clone()]);
        let (ends, gammas) = (&asked.ends[rays.clone()], &asked.gammas[rays.clone()]);
        let count = ends.len();
        let used = ends.iter().fold(0, |a, &b| a.max(b)) as usize;
        self.reserve(used + 1, slice.order.count(), count);
        let sigma = slice.frame().medium().sigma_t()[channel] as f32;
        self.fill_weights(task, channel, (band, used), sigma);
        let [a, b] = [ranks[0], ranks[count - 1]];
        let first = a.min(b);
        let (lit, weights) = (&runs.lit[..=used], &self.weights[..=used]);
        let columns_asked = (a.max(b) - first) as usize + 1;
        if count > used {
            // Runs are added behind themselves, so that the many view rays are three look-ups each.
            self.prefix.fill(lit, weights, first, columns_asked);
            for step in 0..count {
                let ray = if slice.order.ascending { count - 1 - step } else { step };
                self.prefix.advance((ranks[ray] - first) as usize, weights);
                self.lit[ray] = self.prefix.before(ends[ray] as usize);
            }
        } else {
            let weighed = WeighedRuns { lit, weights, first, columns: columns_asked };
            self.columns.sum(weighed, (ranks, ends), &mut self.lit[..count]);
        }
        // What each view ray loses itself up to the start of its last run, and up to its end.
        let [at_start, at_end] = &mut self.own;
        let own = at_start.iter_mut().zip(at_end.iter_mut());
        for (((at_start, at_end), &column), (&run, &gamma)) in own.zip(columns).zip(ends.iter().zip(gammas)) {
            let extinction = sigma / slice.sines()[column as usize];
            *at_start = extinction * runs.starts[run as usize];
            *at_end = extinction * gamma;
        }
        for list in &mut self.own {
            list[..count].iter_mut().for_each(|depth| *depth = absorbed(*depth));
        }
        let colour = runs.colour(channel);
        let brightest = if runs.colours.is_none() { 1.0 } else { f32::MAX };
        let shares = queries.open(0..queries.len()).shares;
        let Some(shares) = shares.into_iter().nth(channel) else { return };
        let losses = self.own[0].iter().zip(&self.own[1]);
        let rays = asked.queries[rays].iter().zip(columns).zip(ranks.iter().zip(ends));
        for (((&query, &column), (&rank, &run)), (before, (&at_start, &whole))) in
            rays.zip(self.lit.iter().zip(losses))
        {
            let parts = band.parts(1.0 / slice.sines()[column as usize]);
            let lit =
                (before[0] * parts[0] + before[1] * parts[1]) + (before[2] * parts[2] + before[3] * parts[3]);
            let run = run as usize;
            let is_lit = if runs.lit[run] > rank { 1.0 } else { 0.0 };
            let last = is_lit * colour.map_or(1.0, |colour| colour[run]) * (whole - at_start).max(0.0);
            let share = ((lit + last) / whole).max(0.0).min(brightest);
            shares[query as usize] = if whole > 0.0 { share } else { 1.0 };
        }
    }

    /// The light of every run but the last, times its colour, by each knot.
    #[inline(always)]
    fn fill_weights(
        &mut self,
        task: &ExactTask<'_>,
        channel: usize,
        (band, used): (Band, usize),
        sigma: f32,
    ) {
        let starts = &task.runs.starts[..=used];
        for (list, cosecant) in self.absorbed.iter_mut().zip([band.from, band.step()]) {
            let extinction = sigma * cosecant;
            for (loss, &start) in list.iter_mut().zip(starts) {
                *loss = absorbed(extinction * start);
            }
        }
        // What is absorbed by the next knot is so by this one, or of what is left by the step between them: nothing cancels.
        let [first, step] = &self.absorbed;
        let by_knots = self.weights[..=used].iter_mut().zip(first.iter().zip(step));
        for (losses, (&first, &step)) in by_knots {
            let next = |loss: f32| loss + (1.0 - loss) * step;
            let (second, third) = (next(first), next(next(first)));
            *losses = [first, second, third, next(third)];
        }
        for run in 0..used {
            let [from, to] = [self.weights[run], self.weights[run + 1]];
            self.weights[run] = std::array::from_fn(|knot| (to[knot] - from[knot]).max(0.0));
        }
        if let Some(colour) = task.runs.colour(channel) {
            for (weight, &colour) in self.weights[..used].iter_mut().zip(colour) {
                weight.iter_mut().for_each(|weight| *weight *= colour);
            }
        }
        // Only view rays that end in it ask for the last one.
        self.weights[used] = [0.0; KNOTS];
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = self.absorbed.iter().chain(&self.own).map(Vec::capacity).sum::<usize>();
        let terms = self.weights.capacity() + self.lit.capacity();
        self.columns.memory_bytes()
            + self.prefix.memory_bytes()
            + size_of::<Terms<KNOTS>>() * terms
            + 4 * floats
    }
}

/// How many edges between lit and dark the view rays of a band of ranks have along a row, on average: one for each column between
/// which two neighbouring runs end.
#[inline(always)]
pub fn mean_edges(lit: &[u32], [first, last]: [u32; 2]) -> f32 {
    let end = last + 1;
    let mut sum = 0u64;
    for block in lit.chunks(4096) {
        let pairs = block.windows(2);
        let own: u32 = pairs.map(|pair| pair[0].clamp(first, end).abs_diff(pair[1].clamp(first, end))).sum();
        sum += u64::from(own);
    }
    sum as f32 / (end - first) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_between_knots_keeps_its_error() {
        let mut nearest = 0.0f64;
        for deepest in [0.1, 1.0, 3.0, 17.0] {
            for error in [1e-2, 1e-3, 1e-4] {
                let ratio = band_ratio(deepest, error);
                for start in [1.0f32, 1.7, 30.0] {
                    let band = Band::of(start, ratio);
                    for step in 0..=20 {
                        let at =
                            f64::from(band.from) + f64::from(step) / 20.0 * f64::from(band.to - band.from);
                        let parts = band.parts(at as f32);
                        // Up to where the ray is as deep as can be.
                        for x in [0.1, 0.5, 1.0].map(|part| part * deepest / at) {
                            let knots = [0.0, 1.0, 2.0, 3.0]
                                .map(|knot| f64::from(band.from) + knot * f64::from(band.step()));
                            let knots = knots.map(|knot| (-x * knot).exp());
                            let found: f64 =
                                knots.iter().zip(parts).map(|(knot, part)| knot * f64::from(part)).sum();
                            let exact = (-x * at).exp();
                            // Parts are f32: four of a few units each, on values that are larger by the band's exponential.
                            let off = (found - exact).abs() / exact - 4e-6 * (deepest * (ratio - 1.0)).exp();
                            assert!(off <= error, "{deepest} {error} {at}: {off}");
                            nearest = nearest.max(off / error);
                        }
                    }
                }
            }
        }
        println!("at most {nearest:.3} of the error");
        assert!(nearest > 0.2);
    }
}
