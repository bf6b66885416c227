//! Factors of `e^{−x·y}` for y in a band: the Chebyshev series in y, whose coefficients are scaled Bessel functions.
//!
//! With `y = yc + h·z`, `z ∈ [−1, 1]`, by the generating function of the Bessel functions (Abramowitz and Stegun 9.6.34), and because a factor of y alone is free, about any x₀,
//!
//! ```text
//! e^{x₀·h·z}·e^{−x·y} = e^{−x·yc}·[ I₀((x−x₀)h) + 2·Σ (−1)ᵏ Iₖ((x−x₀)h)·Tₖ(z) ] = Σ Γₖ(x)·Tₖ(z)
//! ```
//!
//! is a sum of products already. The usual form has x₀ = 0, which spends its accuracy on short rays; the best x₀ lies where
//! both ends of the ray err alike, and leaves a third (rank 2) to a seventh (rank 4) of the error at no cost.
//!
//! The coefficients are taken from the series' own orthogonality, at M Chebyshev points:
//! `Γₖ(x) = (cₖ/M)·Σ e^{x₀·h·zⱼ}·e^{−x·yⱼ}·Tₖ(zⱼ)`, c₀ = 1, cₖ = 2, which is Bessel's integral by the trapezoidal rule
//! and differs from it by `I_{2M−k}` only. Of a sum of exponentials the integrals are closed forms, so no quadrature is
//! left, and along a uniform table the exponentials are a recurrence.
//!
//! # The bound
//!
//! Let `e` be the left side, `f` the sum cut off before k = N, `δ = f − e`, and E and Δ the integrals of e and δ over
//! the ray. For any visibility V in [0, 1] with `v = ∫eV/E`
//!
//! ```text
//! ∫fV/∫f − v = ∫ δ·(V − v) / (E + Δ),   so |error| ≤ ρ/(1 − ρ),   ρ = ∫|δ| / E.
//! ```
//!
//! (`|V − v|` is at most `1 − v` on lit and `v` on unlit parts, hence never above 1.) Here `|δ| ≤ t(x)`, the absolute
//! values of the terms left out; with `s = x − x₀`, `z = |s|h`
//!
//! ```text
//! t/e = e^{|s|·(y − y_min or y_max − y)} · 2·Σ_{k≥N} e^{−z}·Iₖ(z).
//! ```
//!
//! The sum grows with z (its derivative is `e^{−z}·(I_{N−1} − I_N)` > 0), so t/e falls towards x₀ and rises behind it
//! for every y, and its mean over a ray is largest for the shortest ray, where it is t/e at x = 0, or for the longest.
//! `∫t` needs no series: all terms at z = ±1 have one sign, so it is the integral of `e^{−x·yc + |s|h}` less the terms
//! that are kept. For x₀ = 0 and an endless ray that is `2·qᴺ/((1 − q)·√(yc² − h²))`, `q = (yc − √(yc² − h²))/h`: the
//! bound of the usual form, which is therefore never smaller.
//!
//! Interpolation along the ray replaces e within an interval by its mean, an error without integral; see
//! [`reading_error`] for its share, which adds to ρ.

use super::{MAX_RANK, WEIGHT_INTERVALS, reading_error};

/// Chebyshev points M of the coefficients. What is wrong with `Γₖ` is `I_{2M−k}`: below `q⁴⁰` of the whole, 1e-30 for
/// an octave (q = 0.17), 1e-13 for three (q = 0.48).
const POINTS: usize = 24;

/// The series on one band, cut off.
pub(super) struct Band {
    optical_depth: f64,
    ratio: f64,
    rank: usize,
    /// x₀, in [0, optical_depth].
    centre: f64,
    /// `yⱼ`.
    points: [f64; POINTS],
    /// `cₖ/M·Tₖ(zⱼ)`, `[j][k]`.
    projection: [[f64; MAX_RANK]; POINTS],
}

/// Relative errors of a cut series before the tables: bounds on ρ.
struct Shares {
    /// Of the shortest ray.
    shortest: f64,
    /// Of the longest.
    longest: f64,
    /// `Σ ∫|Γₖ|·max|Tₖ″| / E`, for the interpolation of the weights.
    bend: f64,
    /// `Σ ∫|Γₖ| / E`, for roundings.
    amplified: f64,
}

impl Band {
    /// The band `y ∈ [1, ratio]`, ratio in [1, 8], `x ∈ [0, optical_depth]`, optical_depth > 0, with the best x₀.
    pub(super) fn new(rank: usize, optical_depth: f64, ratio: f64) -> Self {
        /// Halvings of the range of x₀; the error is flat at its least, so 1 in 4096 is plenty.
        const HALVINGS: usize = 12;
        let mut band = Self {
            optical_depth,
            ratio,
            rank,
            centre: 0.0,
            points: [0.0; POINTS],
            projection: [[0.0; MAX_RANK]; POINTS],
        };
        for (j, (y, row)) in band.points.iter_mut().zip(&mut band.projection).enumerate() {
            let angle = std::f64::consts::PI * (j as f64 + 0.5) / POINTS as f64;
            *y = 0.5 * (1.0 + ratio) + 0.5 * (ratio - 1.0) * angle.cos();
            for (k, c) in row.iter_mut().enumerate() {
                *c = (k as f64 * angle).cos() * if k == 0 { 1.0 } else { 2.0 } / POINTS as f64;
            }
        }
        // The error of the shortest ray grows with x₀ from 0.
        let (mut low, mut high) = (0.0, optical_depth);
        for _ in 0..HALVINGS {
            band.centre = 0.5 * (low + high);
            let shares = band.shares();
            if shares.shortest > shares.longest { high = band.centre } else { low = band.centre }
        }
        band
    }

    /// `Pₖ` at uniform nodes of `u = x/optical_depth`, `[node][lane]`; lanes from the rank on are zero.
    pub(super) fn prefix(&self, lanes: usize, intervals: usize, table: &mut Vec<f32>) {
        table.clear();
        table.resize((intervals + 1) * lanes, 0.0);
        match lanes {
            1 => self.fill_prefix::<1>(intervals, table),
            2 => self.fill_prefix::<2>(intervals, table),
            4 => self.fill_prefix::<4>(intervals, table),
            _ => self.fill_prefix::<MAX_RANK>(intervals, table),
        }
    }

    fn fill_prefix<const LANES: usize>(&self, intervals: usize, table: &mut [f32]) {
        let projection: [[f64; LANES]; POINTS] = std::array::from_fn(|j| {
            let y = self.points[j];
            let scale = self.tilt(y) / (self.optical_depth * y);
            std::array::from_fn(|k| if k < self.rank { scale * self.projection[j][k] } else { 0.0 })
        });
        // 1 − e^{−x·yⱼ} grows by (1 − itself)·(1 − e^{−Δx·yⱼ}) a node: positive terms only, so that 16384 steps keep
        // 12 digits, and exact as the optical depth goes to 0, where a product of exponentials would lose everything.
        let step = self.points.map(|y| absorbed(self.optical_depth * y / intervals as f64));
        let mut sofar = [0.0; POINTS];
        for node in table.as_chunks_mut::<LANES>().0 {
            let mut sums = [0.0; LANES];
            for (j, row) in projection.iter().enumerate() {
                for (sum, c) in sums.iter_mut().zip(row) {
                    *sum += c * sofar[j];
                }
                sofar[j] += (1.0 - sofar[j]) * step[j];
            }
            *node = sums.map(|sum| sum as f32);
        }
    }

    /// `Tₖ` at uniform nodes of z, `[node][lane]`; lanes from the rank on are zero.
    pub(super) fn weights(&self, lanes: usize, table: &mut Vec<f32>) {
        table.clear();
        table.resize((WEIGHT_INTERVALS + 1) * lanes, 0.0);
        for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
            let z = 2.0 * i as f64 / WEIGHT_INTERVALS as f64 - 1.0;
            let (mut before, mut value) = (z, 1.0);
            for weight in &mut node[..self.rank] {
                *weight = value as f32;
                (before, value) = (value, 2.0 * z * value - before);
            }
        }
    }

    /// The largest error of vis, by the module's derivation, with tables of the usual lengths.
    pub(super) fn bound(&self) -> f64 {
        let shares = self.shares();
        // A chord misses an arc by the square of its length over 8 times the second derivative.
        let chord = 2.0 / WEIGHT_INTERVALS as f64;
        let share = shares.shortest.max(shares.longest) + chord * chord / 8.0 * shares.bend;
        if share >= 0.5 {
            return 1.0;
        }
        (share + reading_error(self.optical_depth * self.ratio, shares.amplified)) / (1.0 - share)
    }

    /// What the cut at the present x₀ costs.
    fn shares(&self) -> Shares {
        let (x_end, centre) = (self.optical_depth, self.centre);
        let half = 0.5 * (self.ratio - 1.0);
        // Values at x = 0, integrals to x₀ and to the end, each divided by optical_depth where it is an integral.
        let mut first = [0.0; MAX_RANK];
        let mut before = [0.0; MAX_RANK];
        let mut whole = [0.0; MAX_RANK];
        for (row, &y) in self.projection.iter().zip(&self.points) {
            let tilt = self.tilt(y);
            let (to_centre, to_end) = (tilt * integral(y, centre) / x_end, tilt * integral(y, x_end) / x_end);
            for k in 0..self.rank {
                first[k] += row[k] * tilt;
                before[k] += row[k] * to_centre;
                whole[k] += row[k] * to_end;
            }
        }
        let size = |k: usize| before[k].abs() + (whole[k] - before[k]).abs();
        let kept: f64 = (0..self.rank).map(size).sum();
        let all = (half * centre).exp() * integral(self.ratio, centre)
            + (-(half + 1.0) * centre).exp() * integral(1.0, x_end - centre);
        // Both sides of a difference are of the order of 1 and known to their rounding.
        let rounding = 16.0 * f64::EPSILON;
        let least = self.least_integral();
        let at_first = (half * centre).exp() - first.iter().map(|g| g.abs()).sum::<f64>();
        Shares {
            shortest: (at_first.max(0.0) + rounding) * (half * centre).exp(),
            longest: ((all / x_end - kept).max(0.0) + rounding) / least,
            // |Tₖ″| ≤ k²(k² − 1)/3.
            bend: (1..self.rank).map(|k| ((k * k * (k * k - 1)) as f64 / 3.0) * size(k)).sum::<f64>() / least,
            amplified: kept / least,
        }
    }

    /// `e^{x₀·(y − yc)}`, what e has more than `e^{−x·y}`.
    fn tilt(&self, y: f64) -> f64 {
        (self.centre * (y - 0.5 * (1.0 + self.ratio))).exp()
    }

    /// The least of E over the band, divided by the optical depth: E is convex in y, so thirds find it.
    fn least_integral(&self) -> f64 {
        /// (2/3)²⁰ of the band is left, and E differs there from its least by the square of that.
        const STEPS: usize = 20;
        let value = |y: f64| self.tilt(y) * integral(y, self.optical_depth) / self.optical_depth;
        let (mut low, mut high) = (1.0, self.ratio);
        for _ in 0..STEPS {
            let third = (high - low) / 3.0;
            if value(low + third) < value(high - third) { high -= third } else { low += third }
        }
        value(low).min(value(high))
    }
}

/// `1 − e^{−depth}`.
fn absorbed(depth: f64) -> f64 {
    -(-depth).exp_m1()
}

/// `∫ e^{−x·y} dx` from 0 to `x_end`.
fn integral(y: f64, x_end: f64) -> f64 {
    absorbed(x_end * y) / y
}

#[cfg(test)]
mod tests {
    use super::super::bessel;
    use super::*;

    #[test]
    fn the_prefixes_are_the_integrals_of_the_bessel_series() {
        for (depth, ratio) in [(0.1, 1.19), (1.0, 2.0), (4.0, 1.41), (20.0, 2.0), (20.0, 4.0)] {
            let band = Band::new(8, depth, ratio);
            let (yc, half) = (0.5 * (1.0 + ratio), 0.5 * (ratio - 1.0));
            let gamma = |u: f64| -> [f64; 8] {
                let (x, s) = (depth * u, depth * u - band.centre);
                let bessel = bessel::scaled::<8>(s.abs() * half);
                let fall = (s.abs() * half - x * yc).exp();
                std::array::from_fn(|k| {
                    let sign = (-s.signum()).powi(k as i32);
                    sign * if k == 0 { 1.0 } else { 2.0 } * fall * bessel[k]
                })
            };
            // Simpson's rule on every interval, whose length times depth·ratio is at most 1/100.
            let intervals = 8192;
            let mut table = Vec::new();
            band.prefix(8, intervals, &mut table);
            let step = 1.0 / intervals as f64;
            let mut sums = [0.0f64; 8];
            for (i, node) in table.chunks_exact(8).enumerate() {
                for k in 0..8 {
                    // Half an f32 rounding of the value, and of f64 sums of exponentials near 1.
                    let slack = 6e-8 * sums[k].abs() + 1e-13;
                    let error = (f64::from(node[k]) - sums[k]).abs();
                    assert!(error <= slack, "{depth} {ratio} P{k}[{i}]: {} {}", node[k], sums[k]);
                }
                let u = i as f64 * step;
                let (a, m, b) = (gamma(u), gamma(u + 0.5 * step), gamma(u + step));
                for k in 0..8 {
                    sums[k] += step / 6.0 * (a[k] + 4.0 * m[k] + b[k]);
                }
            }
        }
    }

    #[test]
    fn the_share_of_the_longest_ray_is_the_integral_of_the_tail() {
        for (rank, depth, ratio) in [(1, 1.0, 2.0), (3, 4.0, 1.41), (4, 20.0, 2.0), (6, 4.0, 4.0)] {
            let mut band = Band::new(rank, depth, ratio);
            // What is said of ρ holds for every x₀: at 0 it is below the form of the notes.
            for centre in [band.centre, 0.0] {
                band.centre = centre;
                let (yc, half) = (0.5 * (1.0 + ratio), 0.5 * (ratio - 1.0));
                let tail = |x: f64| -> f64 {
                    let s = (x - centre).abs() * half;
                    (s - x * yc).exp() * 2.0 * bessel::scaled::<60>(s)[rank..].iter().sum::<f64>()
                };
                // The midpoint rule; t has a corner at x₀, so it is of second order there too.
                let count = 4000;
                let step = depth / f64::from(count);
                let sum: f64 = (0..count).map(|i| tail((f64::from(i) + 0.5) * step) * step).sum();
                let least = (0..=1000)
                    .map(|i| 1.0 + (ratio - 1.0) * f64::from(i) / 1000.0)
                    .map(|y| (centre * (y - yc)).exp() * (1.0 - (-depth * y).exp()) / y)
                    .fold(f64::INFINITY, f64::min);
                let shares = band.shares();
                assert!((shares.longest / (sum / least) - 1.0).abs() < 1e-4, "{rank} {depth} {ratio}");
                assert!((shares.shortest - tail(0.0) * (half * centre).exp()).abs() < 1e-12);
                if centre == 0.0 {
                    let root = (yc * yc - half * half).sqrt();
                    let q = (yc - root) / half;
                    let notes = 2.0 * q.powi(rank as i32) / ((1.0 - q) * root) * ratio
                        / (1.0 - (-depth * ratio).exp());
                    assert!(shares.longest <= notes * (1.0 + 1e-12));
                }
            }
        }
    }
}
