//! Moment-based transmittance: power moments of the optical depth over depth (Münstermann, Krumpen, Klein and Peters 2018).
//!
//! `b_j = Σ τᵢ·mean zʲ` over depths z in −1 … 1. Of all distributions with these moments, those that have the least and the
//! most before a depth are known in closed form (the canonical representation): points of support are that depth and the
//! roots of a polynomial. The optical depth is taken between the two bounds.

use crate::curve::{DepthRange, OPAQUE, TransmittanceCurve, normalised};
use crate::curves::sampled::visit_samples;
use scatter_core::TranslucentSegment;

/// Most powers: eight moments and the total.
const MOST: usize = 9;
/// Most rows of the Hankel matrix.
const ROWS: usize = 5;

/// `M − 1` = 4, 6 or 8 power moments and the total (`M` = 5, 7, 9). 4·M bytes and the range.
///
/// Exact for few layers, blurred for many; results lie within the bounds of the moments, so nothing rings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentCurve<const M: usize> {
    range: DepthRange,
    moments: [f32; M],
}

impl<const M: usize> MomentCurve<M> {
    /// An empty curve over a range that holds all segments to come.
    pub fn new(range: DepthRange) -> Self {
        const { assert!(M % 2 == 1 && M >= 5 && M <= MOST, "4, 6 or 8 moments") };
        Self { range, moments: [0.0; M] }
    }

    fn place(&self, depth: f64) -> f64 {
        2.0 * self.range.share(depth).clamp(0.0, 1.0) - 1.0
    }

    /// Least and largest share of the total before `z`.
    fn bounds(&self, z: f64) -> [f64; 2] {
        let rows = M / 2 + 1;
        let (bias, weights) = bias_of(M);
        let total = f64::from(self.moments[0]);
        let moment = |j: usize| {
            let own = if j == 0 { 1.0 } else { f64::from(self.moments[j]) / total };
            own + bias * (weights[j] - own)
        };
        let hankel = Hankel::new(rows, moment);
        // K(z, x) = Σ q_j·xʲ vanishes at the other points of support.
        let mut kernel = [0.0; ROWS];
        hankel.solve(rows, &powers(z), &mut kernel);
        let mut roots = [0.0; ROWS];
        let count = real_roots(&kernel[..rows], &mut roots);
        let before: f64 =
            roots[..count].iter().filter(|root| **root < z).map(|&root| hankel.weight(rows, root)).sum();
        let own = hankel.weight(rows, z);
        let [low, high] = [before, before + own].map(|bound| bound.clamp(0.0, 1.0));
        if low.is_finite() && high.is_finite() { [low, high] } else { [0.0, 1.0] }
    }
}

impl<const M: usize> TransmittanceCurve for MomentCurve<M> {
    fn insert(&mut self, segment: &TranslucentSegment) {
        let Some(segment) = normalised(segment) else { return };
        // Beyond what f32 tells from nothing: more would drown all else in its rounding.
        let optical_depth = f64::from(segment.optical_depth.min(90.0));
        let [from, to] = [segment.entry, segment.exit].map(|depth| self.place(depth.into()));
        for (j, moment) in self.moments.iter_mut().enumerate() {
            // The mean of zʲ over the segment, (x^{j+1} − e^{j+1})/((j + 1)(x − e)), as a sum without differences.
            let mean: f64 = (0..=j).map(|i| to.powi(i as i32) * from.powi((j - i) as i32)).sum::<f64>();
            *moment += (optical_depth * mean / (j + 1) as f64) as f32;
        }
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        let total = f64::from(self.moments[0]).min(OPAQUE.into());
        let share = self.range.share(depth);
        if !(total > 0.0) || !(share > 0.0) {
            return 0.0;
        }
        if share >= 1.0 {
            return total;
        }
        let [low, high] = self.bounds(2.0 * share - 1.0);
        total * (low + OVERESTIMATION * (high - low))
    }

    fn first_depth(&self) -> f32 {
        if self.moments[0] > 0.0 { self.range.near } else { f32::INFINITY }
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        visit_samples(self, self.range, depths, each);
    }
}

/// Where between the bounds the optical depth is taken (Münstermann et al. 2018, Section 3.3): 0 is never darker than the
/// truth, 1 never lighter.
const OVERESTIMATION: f64 = 0.25;

/// How strongly moments are drawn towards those of a distribution without noise, and what these are, as published for moments
/// in f32 (Münstermann et al. 2018, supplement).
fn bias_of(count: usize) -> (f64, [f64; MOST]) {
    match count {
        5 => (5e-7, [1.0, 0.0, 0.375, 0.0, 0.375, 0.0, 0.0, 0.0, 0.0]),
        7 => (5e-6, [1.0, 0.0, 0.48, 0.0, 0.451, 0.0, 0.45, 0.0, 0.0]),
        _ => (5e-5, [1.0, 0.0, 0.75, 0.0, 0.676_666_666_666_666_6, 0.0, 0.63, 0.0, 0.600_303_030_303_030_3]),
    }
}

fn powers(x: f64) -> [f64; ROWS] {
    let mut powers = [1.0; ROWS];
    for at in 1..ROWS {
        powers[at] = powers[at - 1] * x;
    }
    powers
}

/// The Hankel matrix of the moments, as L·D·Lᵀ.
struct Hankel {
    lower: [[f64; ROWS]; ROWS],
    diagonal: [f64; ROWS],
}

impl Hankel {
    fn new(rows: usize, moment: impl Fn(usize) -> f64) -> Self {
        let (mut lower, mut diagonal) = ([[0.0; ROWS]; ROWS], [1.0; ROWS]);
        for i in 0..rows {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k] * diagonal[k]).sum();
                let value = moment(i + j) - known;
                if i == j {
                    // The bias keeps it positive but for rounding.
                    diagonal[i] = value.max(1e-30);
                    lower[i][i] = 1.0;
                } else {
                    lower[i][j] = value / diagonal[j];
                }
            }
        }
        Self { lower, diagonal }
    }

    /// Solves H·x = right.
    fn solve(&self, rows: usize, right: &[f64; ROWS], x: &mut [f64; ROWS]) {
        for i in 0..rows {
            let known: f64 = (0..i).map(|k| self.lower[i][k] * x[k]).sum();
            x[i] = right[i] - known;
        }
        for i in (0..rows).rev() {
            let known: f64 = (i + 1..rows).map(|k| self.lower[k][i] * x[k]).sum();
            x[i] = x[i] / self.diagonal[i] - known;
        }
    }

    /// Largest share that a distribution with these moments can have at x: 1/K(x, x).
    fn weight(&self, rows: usize, x: f64) -> f64 {
        let right = powers(x);
        let mut half = [0.0; ROWS];
        let mut sum = 0.0;
        for i in 0..rows {
            let known: f64 = (0..i).map(|k| self.lower[i][k] * half[k]).sum();
            half[i] = right[i] - known;
            sum += half[i] * half[i] / self.diagonal[i];
        }
        1.0 / sum
    }
}

/// Roots of `Σ c_j·xʲ` whose roots are all real, in no order; returns how many. Newton's method from beyond the largest root
/// never passes it; then that root is divided out.
fn real_roots(coefficients: &[f64], roots: &mut [f64; ROWS]) -> usize {
    let mut rest = [0.0; ROWS];
    rest[..coefficients.len()].copy_from_slice(coefficients);
    let mut degree = coefficients.len() - 1;
    let scale = coefficients.iter().fold(0.0f64, |most, c| most.max(c.abs()));
    let mut count = 0;
    while degree > 0 {
        // Next to nothing: the root has gone to infinity, where nothing is before z.
        if rest[degree].abs() <= 1e-13 * scale {
            degree -= 1;
            continue;
        }
        // Cauchy's bound.
        let most = rest[..degree].iter().fold(0.0f64, |most, c| most.max((c / rest[degree]).abs()));
        let mut x = 1.0 + most;
        for _ in 0..200 {
            let (mut value, mut slope) = (0.0, 0.0);
            for c in rest[..=degree].iter().rev() {
                slope = slope * x + value;
                value = value * x + c;
            }
            let step = value / slope;
            if !step.is_finite() || step.abs() <= 1e-15 * x.abs().max(1.0) {
                break;
            }
            x -= step;
        }
        roots[count] = x;
        count += 1;
        let mut carried = 0.0;
        for c in rest[..=degree].iter_mut().rev() {
            let own = *c;
            *c = carried;
            carried = own + carried * x;
        }
        degree -= 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many hairs as half the moments, less one, are told exactly: the bound and the bias are all that is left.
    #[test]
    fn few_hairs_are_steps() {
        let hairs = [0.2f32, 0.5, 0.8].map(|depth| TranslucentSegment {
            entry: depth,
            exit: depth,
            optical_depth: 0.3,
        });
        let range = DepthRange { near: 0.0, far: 1.0 };
        let mut curve = MomentCurve::<9>::new(range);
        hairs.iter().for_each(|hair| curve.insert(hair));
        for (depth, expected) in [(0.1, 0.0), (0.35, 0.3), (0.65, 0.6), (0.95, 0.9)] {
            let found = curve.optical_depth(depth);
            // Between steps the bounds are as wide as the bias lets a layer be there: a few percent.
            assert!((found - expected).abs() < 0.05, "{depth}: {found}");
        }
    }

    #[test]
    fn bounds_hold_the_truth() {
        let range = DepthRange { near: 1.0, far: 9.0 };
        let segments: Vec<_> = (0..40)
            .map(|n| {
                let entry = 1.0 + 6.0 * (n as f32 * 0.7).sin().abs();
                TranslucentSegment { entry, exit: entry + 0.05 * (n % 5) as f32, optical_depth: 0.02 }
            })
            .collect();
        fn check<const M: usize>(range: DepthRange, segments: &[TranslucentSegment]) -> f64 {
            let mut curve = MomentCurve::<M>::new(range);
            segments.iter().for_each(|segment| curve.insert(segment));
            let total: f64 = segments.iter().map(|segment| f64::from(segment.optical_depth)).sum();
            let mut width = 0.0f64;
            for n in 1..200 {
                let depth = 1.0 + 8.0 * f64::from(n) / 200.0;
                let truth: f64 = segments.iter().map(|s| s.optical_depth_before(depth)).sum::<f64>() / total;
                let [low, high] = curve.bounds(curve.place(depth));
                // The bias moves the bounds by as much as its root, a hundredth for eight moments.
                assert!(low - 0.02 <= truth && truth <= high + 0.02, "{M} at {depth}: {low} {truth} {high}");
                width += (high - low) / 200.0;
            }
            width
        }
        let widths =
            [check::<5>(range, &segments), check::<7>(range, &segments), check::<9>(range, &segments)];
        assert!(widths[0] > widths[1] && widths[1] > widths[2], "more moments are narrower: {widths:?}");
    }
}
