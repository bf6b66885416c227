//! Factors of `e^{−x·y}` for y in a band: the Chebyshev series in y, whose coefficients are scaled Bessel functions.
//!
//! With `y = yc + h·z`, `z ∈ [−1, 1]` (notes, section 0.3),
//!
//! ```text
//! e^{−x·y} = e^{−x·yc}·[ I₀(xh) + 2·Σ (−1)ᵏ Iₖ(xh)·Tₖ(z) ] = Σ Γₖ(x)·Tₖ(z)
//! ```
//!
//! is a sum of products already. The coefficients are taken from the series' own orthogonality, at M Chebyshev points:
//! `Γₖ(x) = (cₖ/M)·Σ e^{−x·yⱼ}·Tₖ(zⱼ)`, c₀ = 1, cₖ = 2, which is Bessel's integral by the trapezoidal rule and differs
//! from it by `I_{2M−k}` only. Of a sum of exponentials the integrals are closed forms, so no quadrature is left:
//! `Pₖ = (cₖ/M)·Σ Tₖ(zⱼ)·(1 − e^{−x·yⱼ})/yⱼ`, and the exponentials along a uniform table are a recurrence.
//!
//! # The bound
//!
//! Let `e = e^{−x·y}`, `f` its factorised form, `δ = f − e`, E, F and Δ the integrals over the ray. For any visibility
//! V in [0, 1] with `v = ∫eV/E`
//!
//! ```text
//! ∫fV/F − v = ∫ δ·(V − v) / (E + Δ),   so |error| ≤ ρ/(1 − ρ),   ρ = ∫|δ| / E.
//! ```
//!
//! (`|V − v|` is at most `1 − v` on lit and `v` on unlit parts, hence never above 1.) Truncated before k = N,
//! `|δ| ≤ t(x) = 2·Σ_{k≥N} e^{−x·yc}·Iₖ(xh)`. E is smallest for the largest y, and `t/e^{−x·y_max}` = `2·Σ e^{xh}·Iₖ(xh)`
//! grows with x, so does the quotient of their integrals: the longest ray is the worst. Its `∫t` needs no series either:
//! at z = −1 every term has its sign reversed twice, so `∫t = ∫e^{−x·y_min} − Σ_{k<N} |Pₖ|`. For an endless ray this is
//! `2·qᴺ/((1 − q)·√(yc² − h²))`, `q = (yc − √(yc² − h²))/h`, the form of the notes, which is therefore never smaller.
//!
//! Interpolation along the ray replaces e within an interval by its mean, an error without integral; see
//! [`prefix_intervals`] for its share, which adds to ρ.

use super::{MAX_RANK, WEIGHT_INTERVALS, prefix_intervals};

/// Chebyshev points M of the coefficients. What is wrong with `Γₖ` is `I_{2M−k}`: below `q⁴⁰` of the whole, 1e-30 for an
/// octave (q = 0.17), 1e-13 for three (q = 0.48).
const POINTS: usize = 24;

/// The series on one band.
pub(super) struct Band {
    optical_depth: f64,
    ratio: f64,
    /// `yⱼ`.
    points: [f64; POINTS],
    /// `cₖ/M·Tₖ(zⱼ)`, `[j][k]`.
    projection: [[f64; MAX_RANK]; POINTS],
}

impl Band {
    /// The band `y ∈ [1, ratio]`, ratio in [1, 8], `x ∈ [0, optical_depth]`.
    pub(super) fn new(optical_depth: f64, ratio: f64) -> Self {
        // The limit of an empty medium is reached long before this, and nothing is divided by 0.
        let optical_depth = optical_depth.max(1e-30);
        let mut band =
            Self { optical_depth, ratio, points: [0.0; POINTS], projection: [[0.0; MAX_RANK]; POINTS] };
        for (j, (y, row)) in band.points.iter_mut().zip(&mut band.projection).enumerate() {
            let angle = std::f64::consts::PI * (j as f64 + 0.5) / POINTS as f64;
            *y = 0.5 * (1.0 + ratio) + 0.5 * (ratio - 1.0) * angle.cos();
            for (k, c) in row.iter_mut().enumerate() {
                *c = (k as f64 * angle).cos() * if k == 0 { 1.0 } else { 2.0 } / POINTS as f64;
            }
        }
        band
    }

    /// `Pₖ` at uniform nodes of `u = x/optical_depth`, `[node][lane]`; lanes from `rank` on are zero.
    pub(super) fn prefix(&self, rank: usize, lanes: usize, intervals: usize, table: &mut Vec<f32>) {
        table.clear();
        table.resize((intervals + 1) * lanes, 0.0);
        // 1 − e^{−x·yⱼ} grows by (1 − itself)·(1 − e^{−Δx·yⱼ}) a node: positive terms only, so that 8192 steps keep
        // 12 digits, and exact as the optical depth goes to 0, where a product of exponentials would lose everything.
        let step = self.points.map(|y| self.absorbed(y / intervals as f64));
        let per_node = self.points.map(|y| 1.0 / (self.optical_depth * y));
        let mut absorbed = [0.0; POINTS];
        for node in table.chunks_exact_mut(lanes) {
            let mut sums = [0.0; MAX_RANK];
            for (j, row) in self.projection.iter().enumerate() {
                let integral = absorbed[j] * per_node[j];
                for (sum, c) in sums.iter_mut().zip(row) {
                    *sum += c * integral;
                }
                absorbed[j] += (1.0 - absorbed[j]) * step[j];
            }
            for (value, sum) in node[..rank].iter_mut().zip(sums) {
                *value = sum as f32;
            }
        }
    }

    /// The largest error of vis at this rank, by the module's derivation, with tables of the usual lengths.
    pub(super) fn bound(&self, rank: usize) -> f64 {
        /// Lit intervals for whose rounding there is room: two ends, each off by two roundings of a table value.
        const INTERVALS: f64 = 16.0;
        let mut terms = [0.0; MAX_RANK];
        for (y, row) in self.points.iter().zip(&self.projection) {
            for (term, c) in terms.iter_mut().zip(row) {
                *term += c * self.whole(*y);
            }
        }
        let terms = &terms[..rank];
        let kept: f64 = terms.iter().map(|term| term.abs()).sum();
        // Both sides of the difference are at most 1 and known to their rounding.
        let truncated = (self.whole(1.0) - kept).max(0.0) + 16.0 * f64::EPSILON;
        // |Tₖ″| ≤ k²(k² − 1)/3, and a chord misses an arc by the square of its length over 8 times that.
        let chord = 2.0 / WEIGHT_INTERVALS as f64;
        let interpolated: f64 = terms
            .iter()
            .enumerate()
            .map(|(k, term)| {
                (k * k) as f64 * ((k * k) as f64 - 1.0).max(0.0) / 3.0 * chord * chord / 8.0 * term.abs()
            })
            .sum();
        let share = (truncated + interpolated) / self.whole(self.ratio);
        if share >= 0.5 {
            return 1.0;
        }
        let depth = self.optical_depth * self.ratio;
        let along = depth / (4.0 * prefix_intervals(depth) as f64);
        let rounded = INTERVALS * 4.0 * 0.5 * f64::from(f32::EPSILON) * kept / self.whole(self.ratio);
        (share + along) / (1.0 - share) + rounded
    }

    /// `1 − e^{−optical_depth·y}`.
    fn absorbed(&self, y: f64) -> f64 {
        -(-self.optical_depth * y).exp_m1()
    }

    /// `∫₀¹ e^{−optical_depth·y·u} du`.
    fn whole(&self, y: f64) -> f64 {
        self.absorbed(y) / (self.optical_depth * y)
    }
}

/// `Tₖ` at uniform nodes of z, `[node][lane]`; lanes from `rank` on are zero.
pub(super) fn weights(rank: usize, lanes: usize, intervals: usize, table: &mut Vec<f32>) {
    table.clear();
    table.resize((intervals + 1) * lanes, 0.0);
    for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
        let z = 2.0 * i as f64 / intervals as f64 - 1.0;
        let (mut before, mut value) = (z, 1.0);
        for weight in &mut node[..rank] {
            *weight = value as f32;
            (before, value) = (value, 2.0 * z * value - before);
        }
    }
}
