//! A sun in a uniform medium, for rows of many edges and for coloured light: every view ray is a few look-ups in sums over the lit
//! runs before its end.
//!
//! The light of a run on the view ray at the angle β is `e^{−x_a·y} − e^{−x_b·y}` with y = 1/sin β, x = σ·γ. As a function of y it is
//! interpolated between four knots (Chebyshev's, in bands of y so narrow that the remainder does not count), each of which has
//! sums of its own: the exact counterpart of the reference rays of a filtered row.

use epipolar::driver::SliceQueries;

use super::lit_prefix::{KNOTS, LitPrefix, Terms};
use super::task::ExactTask;
use crate::weights::absorbed;

/// Remainder of the interpolation, relative to the light of a run, over the fourth power of a band's width in optical depth, times
/// its exponential: `2·(Δ/4)⁴/4!`.
const REMAINDER: f64 = 2.0 / (256.0 * 24.0);

/// Remainder below which f32 sums no longer gain.
const LEAST_ERROR: f64 = 2e-6;

/// Widest band, as a ratio of 1/sin β.
const WIDEST: f64 = 4.0;

/// Buffers for the sums of a slice.
#[derive(Debug, Default)]
pub struct SummedSun {
    sums: LitPrefix,
    weights: Vec<Terms>,
    /// `1 − e^{−x·y}` up to a run's start, by each knot.
    absorbed: [Vec<f32>; KNOTS],
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
    knots: Terms,
}

impl Band {
    /// The band that holds a number ≥ 1.
    fn of(cosecant: f32, ratio: f64) -> Self {
        let power = (f64::from(cosecant).ln() / ratio.ln()).floor();
        let from = ratio.powf(power);
        // Rounding may put a border itself on its other side.
        let from = if from > f64::from(cosecant) { from / ratio } else { from };
        let to = from * ratio;
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let knots = std::array::from_fn(|knot| {
            let angle = (2.0 * knot as f64 + 1.0) * std::f64::consts::PI / (2.0 * KNOTS as f64);
            (middle + half * angle.cos()) as f32
        });
        Self { from: from as f32, to: to as f32, knots }
    }

    /// The parts of the knots at a place (Lagrange).
    #[inline(always)]
    fn parts(&self, at: f32) -> Terms {
        std::array::from_fn(|knot| {
            let mut part = 1.0;
            for other in (0..KNOTS).filter(|&other| other != knot) {
                part *= (at - self.knots[other]) / (self.knots[knot] - self.knots[other]);
            }
            part
        })
    }
}

impl SummedSun {
    /// Room for slices of so many runs, columns and queries.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize) {
        self.sums.reserve(runs, columns);
        self.weights.resize((runs + 1).max(self.weights.len()), [0.0; KNOTS]);
        for list in &mut self.absorbed {
            list.resize((runs + 2).max(list.len()), 0.0);
        }
        for list in &mut self.own {
            list.resize(queries.max(list.len()), 0.0);
        }
    }

    /// Writes the shares of the view rays in doubt, in bands of a ratio a channel.
    ///
    /// A band costs two passes over its runs and a few additions for each that becomes lit; a view ray three look-ups and two
    /// exponentials, a channel.
    #[inline(always)]
    pub fn sum(&mut self, task: &ExactTask<'_>, ratios: &[f64; 3], queries: &mut SliceQueries) {
        let sines = task.slice.sines();
        let cosecant = |place: usize| {
            let ray = task.doubted[place] as usize;
            1.0 / sines[task.asked.columns[ray] as usize]
        };
        for (channel, &ratio) in ratios.iter().enumerate().take(task.channels) {
            let mut first = 0;
            while first < task.doubted.len() {
                let band = Band::of(cosecant(first), ratio);
                let mut end = first + 1;
                while end < task.doubted.len() && (band.from..band.to).contains(&cosecant(end)) {
                    end += 1;
                }
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
        (band, range): (Band, std::ops::Range<usize>),
        queries: &mut SliceQueries,
    ) {
        let ExactTask { slice, runs, asked, .. } = task;
        let rays = &task.doubted[range];
        let used = rays.iter().map(|&ray| asked.ends[ray as usize]).max().unwrap_or(0) as usize;
        self.reserve(used + 1, slice.order.count(), rays.len());
        let sigma = slice.frame().medium().sigma_t()[channel] as f32;
        self.fill_weights(task, channel, (band, used), sigma);
        self.fill_own(task, rays, sigma);
        let rank = |place: usize| asked.ranks[rays[place] as usize];
        let count = rays.len();
        let [a, b] = [rank(0), rank(count - 1)];
        let lowest = a.min(b);
        let (mut of_column, mut parts) = (u32::MAX, [0.0; KNOTS]);
        self.sums.fill(
            &runs.lit[..used + 1],
            &self.weights[..used + 1],
            lowest,
            (a.max(b) - lowest) as usize + 1,
        );
        let colour = runs.colour(channel);
        let is_white = runs.colours.is_none();
        let shares = queries.open(0..queries.len()).shares;
        let Some(shares) = shares.into_iter().nth(channel) else { return };
        for step in 0..count {
            let place = if slice.order.ascending { count - 1 - step } else { step };
            let ray = rays[place] as usize;
            let rank = asked.ranks[ray];
            self.sums.advance((rank - lowest) as usize, &self.weights[..used + 1]);
            if of_column != asked.columns[ray] {
                of_column = asked.columns[ray];
                parts = band.parts(1.0 / slice.sines()[of_column as usize]);
            }
            let run = asked.ends[ray] as usize;
            let before = self.sums.before(run);
            let mut lit: f32 = before.iter().zip(&parts).map(|(sum, part)| sum * part).sum();
            let [at_start, whole] = [self.own[0][place], self.own[1][place]];
            if runs.lit[run] > rank {
                lit += colour.map_or(1.0, |colour| colour[run]) * (whole - at_start).max(0.0);
            }
            let share = if whole > 0.0 { (lit / whole).max(0.0) } else { 1.0 };
            shares[asked.queries[ray] as usize] = if is_white { share.min(1.0) } else { share };
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
        for (absorbed_up_to, knot) in self.absorbed.iter_mut().zip(band.knots) {
            let extinction = sigma * knot;
            for (loss, &start) in absorbed_up_to.iter_mut().zip(starts) {
                *loss = absorbed(extinction * start);
            }
        }
        for knot in 0..KNOTS {
            let losses = &self.absorbed[knot][..=used];
            for (weight, pair) in self.weights.iter_mut().zip(losses.windows(2)) {
                weight[knot] = (pair[1] - pair[0]).max(0.0);
            }
        }
        if let Some(colour) = task.runs.colour(channel) {
            for (weight, &colour) in self.weights[..used].iter_mut().zip(colour) {
                weight.iter_mut().for_each(|weight| *weight *= colour);
            }
        }
        self.weights[used] = [0.0; KNOTS];
    }

    /// What each view ray loses itself up to the start of its last run, and up to its end.
    #[inline(always)]
    fn fill_own(&mut self, task: &ExactTask<'_>, rays: &[u32], sigma: f32) {
        let asked = task.asked;
        let [at_start, at_end] = &mut self.own;
        for ((at_start, at_end), &ray) in at_start.iter_mut().zip(at_end.iter_mut()).zip(rays) {
            let ray = ray as usize;
            let extinction = sigma / task.slice.sines()[asked.columns[ray] as usize];
            *at_start = extinction * task.runs.starts[asked.ends[ray] as usize];
            *at_end = extinction * asked.gammas[ray];
        }
        for list in &mut self.own {
            list[..rays.len()].iter_mut().for_each(|depth| *depth = absorbed(*depth));
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let floats = self.absorbed.iter().chain(&self.own).map(Vec::capacity).sum::<usize>();
        self.sums.memory_bytes() + size_of::<Terms>() * self.weights.capacity() + 4 * floats
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
                            let knots = band.knots.map(|knot| (-x * f64::from(knot)).exp());
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
