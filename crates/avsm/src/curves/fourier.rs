//! Fourier opacity maps: extinction over a depth range as a Fourier series (Jansen and Bavoil 2010).

use std::f64::consts::TAU;

use crate::curve::{DepthRange, OPAQUE, TransmittanceCurve, normalised};
use crate::curves::sampled::visit_samples;
use scatter_core::TranslucentSegment;

/// A series of `K` cosines and as many sines over a depth range that it repeats. 8·K bytes and the range.
///
/// It rings where extinction is not smooth, and may brighten with depth; results are clamped to 0 … 1, nothing else is done
/// about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FourierCurve<const K: usize> {
    range: DepthRange,
    /// a_k = Σ τᵢ·mean cos(2πk·d), a_0 without its half.
    cosines: [f32; K],
    /// b_k = Σ τᵢ·mean sin(2πk·d); b_0 is 0.
    sines: [f32; K],
}

impl<const K: usize> FourierCurve<K> {
    /// An empty curve over a range that holds all segments to come.
    pub fn new(range: DepthRange) -> Self {
        Self { range, cosines: [0.0; K], sines: [0.0; K] }
    }
}

impl<const K: usize> TransmittanceCurve for FourierCurve<K> {
    fn insert(&mut self, segment: &TranslucentSegment) {
        let Some(segment) = normalised(segment) else { return };
        // Beyond what f32 tells from nothing: a series rings as high as what it is given.
        let optical_depth = f64::from(segment.optical_depth.min(MOST));
        let [from, to] =
            [segment.entry, segment.exit].map(|depth| self.range.share(depth.into()).clamp(0.0, 1.0));
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        // cos(2πk·m)·sinc: the mean of a cosine over the segment. Both by recurrence over k.
        let [wave, decay] = [TAU * middle, TAU * half].map(Turn::new);
        let (mut wave_at, mut decay_at) = (Turn::ONE, Turn::ONE);
        for k in 0..K {
            let angle = TAU * half * k as f64;
            let mean = if angle > 1e-4 { decay_at.sine / angle } else { 1.0 - angle * angle / 6.0 };
            self.cosines[k] += (optical_depth * mean * wave_at.cosine) as f32;
            self.sines[k] += (optical_depth * mean * wave_at.sine) as f32;
            (wave_at, decay_at) = (wave_at.times(wave), decay_at.times(decay));
        }
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        let share = self.range.share(depth);
        if !(share > 0.0) {
            return 0.0;
        }
        if share >= 1.0 {
            return f64::from(self.cosines[0]).min(OPAQUE.into());
        }
        // Eq. 8: the integral of the series.
        let mut sum = f64::from(self.cosines[0]) * share;
        let turn = Turn::new(TAU * share);
        let mut at = turn;
        for k in 1..K {
            let [a, b] = [self.cosines[k], self.sines[k]].map(f64::from);
            sum += (a * at.sine + b * (1.0 - at.cosine)) / (0.5 * TAU * k as f64);
            at = at.times(turn);
        }
        sum.clamp(0.0, OPAQUE.into())
    }

    fn first_depth(&self) -> f32 {
        if self.cosines[0] > 0.0 { self.range.near } else { f32::INFINITY }
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        visit_samples(self, self.range, depths, each);
    }
}

/// Largest optical depth of one segment.
const MOST: f32 = 90.0;

/// A turn by an angle.
#[derive(Clone, Copy)]
struct Turn {
    cosine: f64,
    sine: f64,
}

impl Turn {
    const ONE: Self = Self { cosine: 1.0, sine: 0.0 };

    fn new(angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Self { cosine, sine }
    }

    fn times(self, other: Self) -> Self {
        Self {
            cosine: self.cosine * other.cosine - self.sine * other.sine,
            sine: self.sine * other.cosine + self.cosine * other.sine,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_medium_is_its_first_term() {
        let all = TranslucentSegment::volume(1.0, 5.0, 0.3);
        let mut curve = FourierCurve::<16>::new(DepthRange::of(&[all]));
        curve.insert(&all);
        for n in 0..50 {
            let depth = 1.0 + 0.08 * f64::from(n);
            assert!((curve.optical_depth(depth) - 0.3 * (depth - 1.0)).abs() < 1e-6, "{depth}");
        }
    }

    /// Coefficients are those of MODEL's definition, by a sum over 10⁵ points.
    #[test]
    fn coefficients_are_the_integrals_that_they_stand_for() {
        let segment = TranslucentSegment { entry: 2.3, exit: 4.1, optical_depth: 0.8 };
        let range = DepthRange { near: 1.0, far: 6.0 };
        let mut curve = FourierCurve::<16>::new(range);
        curve.insert(&segment);
        let count = 100_000;
        for k in [0, 1, 7, 15] {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for n in 0..count {
                let depth = 2.3 + 1.8 * (f64::from(n) + 0.5) / f64::from(count);
                let angle = TAU * k as f64 * (depth - 1.0) / 5.0;
                cosine += 0.8 / f64::from(count) * angle.cos();
                sine += 0.8 / f64::from(count) * angle.sin();
            }
            assert!((f64::from(curve.cosines[k]) - cosine).abs() < 1e-6, "{k}");
            assert!((f64::from(curve.sines[k]) - sine).abs() < 1e-6, "{k}");
        }
    }
}
