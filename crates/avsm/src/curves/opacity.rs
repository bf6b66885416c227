//! Opacity shadow maps: the optical depth at slices of equal distance (Kim and Neumann 2001).

use crate::curve::{DepthRange, OPAQUE, TransmittanceCurve, normalised};
use scatter_core::TranslucentSegment;

/// `K` slices of a depth range, with constant extinction between them: what falls between two slices is smeared over the way
/// from one to the other. 4·K bytes and the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpacityCurve<const K: usize> {
    range: DepthRange,
    /// τ at the ends of the range's K equal parts.
    slices: [f32; K],
}

impl<const K: usize> OpacityCurve<K> {
    /// An empty curve over a range that holds all segments to come.
    pub fn new(range: DepthRange) -> Self {
        Self { range, slices: [0.0; K] }
    }

    fn slice_depth(&self, slice: usize) -> f64 {
        f64::from(self.range.near) + self.range.length() * ((slice + 1) as f64 / K as f64)
    }
}

impl<const K: usize> TransmittanceCurve for OpacityCurve<K> {
    fn insert(&mut self, segment: &TranslucentSegment) {
        let Some(segment) = normalised(segment) else { return };
        for slice in 0..K {
            // A slice is in the light before what lies in its own depth; but the last has to hold everything.
            let depth = if slice + 1 == K { f64::INFINITY } else { self.slice_depth(slice) };
            self.slices[slice] =
                (self.slices[slice] + segment.optical_depth_before(depth) as f32).min(OPAQUE);
        }
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        let place = self.range.share(depth).clamp(0.0, 1.0) * K as f64;
        // Of an empty range the place is not a number.
        let Some(slice) = (place > 0.0).then(|| (place.ceil() as usize - 1).min(K - 1)) else { return 0.0 };
        let from = if slice == 0 { 0.0 } else { f64::from(self.slices[slice - 1]) };
        from + (f64::from(self.slices[slice]) - from) * (place - slice as f64)
    }

    fn first_depth(&self) -> f32 {
        if self.slices[K - 1] > 0.0 { self.range.near } else { f32::INFINITY }
    }

    fn visit(&self, [from, to]: [f64; 2], mut each: impl FnMut(f64, f64)) {
        each(from, self.optical_depth(from));
        if self.range.length() > 0.0 {
            let near = f64::from(self.range.near);
            if from < near && near < to {
                each(near, 0.0);
            }
            for slice in 0..K {
                let depth = self.slice_depth(slice);
                if from < depth && depth < to {
                    each(depth, self.slices[slice].into());
                }
            }
        } else if from <= f64::from(self.range.near) && f64::from(self.range.near) < to {
            // All in one place: a step.
            each(self.range.near.into(), 0.0);
            each(self.range.near.into(), self.slices[K - 1].into());
        }
        each(to, self.optical_depth(to));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_hold_what_has_been_crossed_and_lines_run_between() {
        let segments =
            [TranslucentSegment::volume(2.0, 6.0, 0.5), TranslucentSegment::volume(4.0, 10.0, 0.1)];
        let mut curve = OpacityCurve::<4>::new(DepthRange::of(&segments));
        segments.iter().for_each(|segment| curve.insert(segment));
        // Slices at 4, 6, 8, 10: all breaks of this curve are among them, so it is exact.
        for (depth, expected) in
            [(1.0, 0.0), (3.0, 0.5), (4.0, 1.0), (5.0, 1.6), (6.0, 2.2), (9.0, 2.5), (20.0, 2.6)]
        {
            assert!((curve.optical_depth(depth) - expected).abs() < 1e-6, "{depth}");
        }
    }

    #[test]
    fn hairs_in_one_place_are_a_step_and_nothing_is_nothing() {
        let hair = TranslucentSegment::hair(2.0, 0.5);
        let mut curve = OpacityCurve::<8>::new(DepthRange::of(&[hair]));
        curve.insert(&hair);
        assert_eq!([1.0, 2.0].map(|z| curve.transmittance(z)), [1.0; 2]);
        assert!((curve.transmittance(2.1) - 0.5).abs() < 1e-7);
        assert_eq!(OpacityCurve::<8>::new(DepthRange::EMPTY).transmittance(1.0), 1.0);
    }
}
