//! Factors of `e^{−x·y}` as the paper finds them: the SVD of a 64×64 matrix of samples, its vectors linearly upsampled,
//! the singular values multiplied into B (Baran et al. 2010, Section 6).
//!
//! The paper decomposes `I(γ, β)` over all β but a ring. Here the factor 1/sin β has been taken out and the domain is
//! the band of the other factorisation, samples uniform in x and y, both ends included: what the two differ in is the
//! decomposition alone. `Γₖ` stays piecewise linear, so its integrals are exact.
//!
//! # The bound
//!
//! As in `chebyshev`, the error of vis is `∫δ·(V − v)/(E + Δ)`. δ has two parts. Linear interpolation of the unabridged
//! matrix is above `e^{−x·y}` by a share r in [0, R], and `∫ e·r·(V − v) ≤ v·(1 − v)·R·E ≤ R·E/4`: a chord over a fall
//! by `e^{−a}` rises above it by at most `(b/a)·e^{a/b − 1} − 1`, `b = 1 − e^{−a}`. The rest, the triples cut off, is
//! known at every sample, lies between samples below the interpolation of its absolute values, and is integrated.

use nalgebra::SMatrix;

use crate::baran::{MAX_RANK, WEIGHT_INTERVALS, reading_error};

/// Samples each way, the paper's. The error of upsampling falls with its square.
const SAMPLES: usize = 64;

type Samples = SMatrix<f64, SAMPLES, SAMPLES>;

/// The decomposed samples of one band.
pub(crate) struct Decomposition {
    optical_depth: f64,
    ratio: f64,
    samples: Samples,
    /// `Γₖ` at the samples of x, `[k][i]`.
    along: [[f64; SAMPLES]; MAX_RANK],
    /// `Bₖ` at the samples of y, singular value included, `[k][j]`.
    across: [[f64; SAMPLES]; MAX_RANK],
}

impl Decomposition {
    /// The band `y ∈ [1, ratio]`, `x ∈ [0, optical_depth]`. Costs about a millisecond.
    pub(crate) fn new(optical_depth: f64, ratio: f64) -> Self {
        let samples =
            Samples::from_fn(|i, j| (-optical_depth * share(i) * (1.0 + (ratio - 1.0) * share(j))).exp());
        let svd = samples.svd(true, true);
        let mut this = Self {
            optical_depth,
            ratio,
            samples,
            along: [[0.0; SAMPLES]; MAX_RANK],
            across: [[0.0; SAMPLES]; MAX_RANK],
        };
        let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return this };
        for k in 0..MAX_RANK {
            for i in 0..SAMPLES {
                // Lengths of 1 become values of about 1.
                this.along[k][i] = u[(i, k)] * (SAMPLES as f64).sqrt();
                this.across[k][i] = v[(k, i)] * svd.singular_values[k] / (SAMPLES as f64).sqrt();
            }
        }
        this
    }

    /// `Pₖ` at uniform nodes of `u = x/optical_depth`, `[node][lane]`; lanes from `rank` on are zero.
    pub(crate) fn prefix(&self, rank: usize, lanes: usize, intervals: usize, table: &mut Vec<f32>) {
        table.clear();
        table.resize((intervals + 1) * lanes, 0.0);
        for (k, gamma) in self.along[..rank].iter().enumerate() {
            let step = share(1);
            let (mut cell, mut before) = (0, 0.0);
            for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
                let u = i as f64 / intervals as f64;
                while cell + 2 < SAMPLES && u >= share(cell + 1) {
                    before += 0.5 * step * (gamma[cell] + gamma[cell + 1]);
                    cell += 1;
                }
                let inside = u - share(cell);
                let slope = (gamma[cell + 1] - gamma[cell]) / step;
                node[k] = (before + inside * (gamma[cell] + 0.5 * slope * inside)) as f32;
            }
        }
    }

    /// `Bₖ` at uniform nodes of y, `[node][lane]`; lanes from `rank` on are zero.
    pub(crate) fn weights(&self, rank: usize, lanes: usize, table: &mut Vec<f32>) {
        table.clear();
        table.resize((WEIGHT_INTERVALS + 1) * lanes, 0.0);
        for (i, node) in table.chunks_exact_mut(lanes).enumerate() {
            let at = i as f64 / WEIGHT_INTERVALS as f64 * (SAMPLES - 1) as f64;
            let cell = (at as usize).min(SAMPLES - 2);
            for (weight, values) in node.iter_mut().zip(&self.across[..rank]) {
                *weight = (values[cell] + (at - cell as f64) * (values[cell + 1] - values[cell])) as f32;
            }
        }
    }

    /// The largest error of vis at this rank, by the module's derivation.
    pub(crate) fn bound(&self, rank: usize) -> f64 {
        let chord = |fall: f64| {
            let risen = -(-fall).exp_m1();
            if fall > 0.0 { (risen / fall) * (fall / risen - 1.0).exp() - 1.0 } else { 0.0 }
        };
        let along = chord(self.optical_depth * self.ratio * share(1));
        let across = chord(self.optical_depth * (self.ratio - 1.0) * share(1));
        let interpolated = (1.0 + along) * (1.0 + across) - 1.0;
        let left_out = |i: usize, j: usize| {
            let kept: f64 = (0..rank).map(|k| self.along[k][i] * self.across[k][j]).sum();
            (self.samples[(i, j)] - kept).abs()
        };
        let mut cut = 0.0f64;
        for j in 0..SAMPLES - 1 {
            // A direction between two samples: the larger error of both against the smaller integral.
            let at = |i: usize| left_out(i, j).max(left_out(i, j + 1));
            let whole = |i: usize| {
                let rate = self.optical_depth * (1.0 + (self.ratio - 1.0) * share(j + 1));
                -(-rate * share(i)).exp_m1() / rate
            };
            let mut integral = 0.0;
            for i in 0..SAMPLES - 1 {
                integral += share(1) * 0.5 * (at(i) + at(i + 1));
                // A ray that ends within the interval; within the first, its two ends bound the quotient.
                let smallest = whole(i.max(1));
                cut = cut.max(integral / smallest);
            }
            cut = cut.max(at(0).max(at(1)) / self.samples[(1, j + 1)]);
        }
        let whole = -(-self.optical_depth * self.ratio).exp_m1() / (self.optical_depth * self.ratio);
        let size = |values: &[f64]| values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let kept: f64 = (0..rank)
            .map(|k| {
                let integral: f64 = self.along[k].iter().map(|v| v.abs()).sum::<f64>() / SAMPLES as f64;
                size(&self.across[k]) * integral
            })
            .sum();
        if cut >= 0.5 {
            return 1.0;
        }
        (0.25 * interpolated + cut + reading_error(self.optical_depth * self.ratio, kept / whole))
            / (1.0 - cut)
    }
}

/// The place of sample `i` in [0, 1].
fn share(i: usize) -> f64 {
    i as f64 / (SAMPLES - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `s₄/s₁` of `e^{−τ·γ·y}·yⁿ` over γ in [0, 1] and β in [b_min, b_min + 70°], y = 1/sin β.
    fn fourth_to_first(b_min_degrees: f64, tau: f64, power: i32) -> f64 {
        let matrix = Samples::from_fn(|i, j| {
            let y = 1.0 / (b_min_degrees + 70.0 * share(j)).to_radians().sin();
            (-tau * share(i) * y).exp() * y.powi(power)
        });
        let values = matrix.singular_values();
        values[3] / values[0]
    }

    #[test]
    fn the_fourth_singular_value_is_below_a_fortieth_of_the_first_unless_the_ring_is_narrow() {
        // The paper: never more than 1/40. That is so from b_min = 10° on; 2° from the epipole it is not.
        println!("1 : s₁/s₄ of y·e^(-xy), and with 1/sin β taken out");
        for b_min in [2.0, 5.0, 10.0, 20.0, 30.0] {
            for tau in [0.1, 1.0, 4.0] {
                let (paper, ours) = (fourth_to_first(b_min, tau, 1), fourth_to_first(b_min, tau, 0));
                println!("b_min {b_min:2}°, tau {tau:3}: 1/{:.0}, 1/{:.0}", 1.0 / paper, 1.0 / ours);
                assert!(b_min < 10.0 || paper < 1.0 / 40.0);
            }
        }
        // The readings of an independent prototype in double precision.
        assert!((fourth_to_first(2.0, 1.0, 1) * 21.0 - 1.0).abs() < 0.05);
        assert!((fourth_to_first(2.0, 4.0, 1) * 20.0 - 1.0).abs() < 0.05);
        assert!(fourth_to_first(30.0, 4.0, 1) < 1.0 / 1000.0);
    }
}
