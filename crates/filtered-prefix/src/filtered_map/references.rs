//! Reference rays of a filtered map: as many as the light along view rays differs, between two of which pixels are blended; at most
//! three, since a fourth changed nothing that was measured.
//!
//! Klehm et al. (2014, Section 3.2) take one a row. Where view rays of a row cross the light at angles from 5 to 80 degrees, one way
//! across the light is ten times as long on some as on others, and no ray stands for all. Under a sun references are ways a unit across
//! the light, `1/sin β`, in geometric steps; around a lamp directions in the slice, in even steps.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use scatter_core::{Frame, SceneFacts};

use super::row_depths::measure;
use crate::projective::Rectification;

/// Most reference rays.
pub const MOST: usize = 3;

/// Optical depth of the deepest ray from one reference to the next, about which blending errs by a hundredth.
const STEP: f64 = 1.0;

/// Deepest optical depth that is asked for: what lies deeper has no light.
const DEEPEST: f64 = 6.0;

/// Half the optical depth between references' ends that one in the middle may stand for.
const ONE: f64 = 0.05;

/// Step of a lamp's directions in the measure of slopes.
const LAMP_STEP: f64 = 0.3;

/// The reference rays of a frame.
#[derive(Debug, Clone, Copy)]
pub struct References {
    knots: [f32; MOST],
    /// One over the steps between them; 0 where there is none.
    per_step: [f32; MOST - 1],
    count: usize,
    /// A sixth of the extinction under a sun, 0 around a lamp.
    sixth: f32,
}

impl References {
    /// For a frame; `sigma` is the weights' extinction, 0 for average visibility.
    pub fn new(frame: &Frame<'_>, rectification: &Rectification, facts: &SceneFacts, sigma: f64) -> Self {
        let Rectification { depths, lamp, .. } = *rectification;
        let is_lamp = lamp.is_some();
        let (range, count) = if is_lamp {
            let range = depths.map(|z| f64::from(measure(z as f32)));
            let step = if sigma > 0.0 || facts.anisotropic { LAMP_STEP } else { f64::MAX };
            (range, ((range[1] - range[0]) / step).ceil() as usize + 1)
        } else {
            let range = Self::lengths(frame, rectification);
            let ratio = range[1] / range[0];
            let depth = (sigma * facts.longest_ray).min(DEEPEST);
            let count = if depth * (ratio.sqrt() - 1.0) <= ONE {
                1
            } else {
                (ratio.ln() / (STEP / depth).ln_1p()).ceil() as usize + 1
            };
            (range, count)
        };
        let count = count.min(MOST);
        let mut knots = [0.0; MOST];
        for (index, knot) in knots.iter_mut().enumerate().take(count) {
            let part = if count == 1 { 0.5 } else { index as f64 / (count - 1) as f64 };
            *knot = if is_lamp {
                range[0] + part * (range[1] - range[0])
            } else {
                range[0] * (range[1] / range[0]).powf(part)
            } as f32;
        }
        // Beyond the last there is nothing to blend with.
        let last = knots[count - 1];
        knots[count..].fill(last);
        let per_step = [0, 1].map(|index| {
            let step = knots[index + 1] - knots[index];
            if index + 1 < count && step > 0.0 { 1.0 / step } else { 0.0 }
        });
        Self { knots, per_step, count, sixth: if is_lamp { 0.0 } else { sigma as f32 / 6.0 } }
    }

    /// Shortest and longest way of the image's view rays a unit along the bisectrix.
    fn lengths(frame: &Frame<'_>, rectification: &Rectification) -> [f64; 2] {
        let [width, height] = frame.size();
        let mut range = [f64::MAX, 1.0f64];
        // The shortest is on a border or anywhere inside, the longest at a corner.
        for y in 0..=16 {
            for x in 0..=16 {
                let at = [(width - 1) * x / 16, (height - 1) * y / 16];
                let way = 1.0 / rectification.along.dot(frame.camera().pixel_ray(at[0], at[1]).direction);
                range = [range[0].min(way), range[1].max(way)];
            }
        }
        [range[0].min(range[1]), range[1]]
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// 1/sin β of a reference under a sun, the measure of its slope around a lamp.
    pub fn knot(&self, index: usize) -> f32 {
        self.knots[index]
    }

    /// Whether view rays lie between the second and the third reference, not the first two, and the part of the latter of both. `at` is
    /// where they lie among the references, `ways` are their lengths.
    ///
    /// The normalised weights of rays of an optical depth τ lie between those of two others about as `1/(1 + τ/6)` does: linear in τ
    /// where it is small, in the mean way `1/τ` where it is large.
    #[inline(always)]
    pub fn blend<S: Simd>(&self, simd: S, at: f32x16<S>, ways: f32x16<S>) -> (mask32x16<S>, f32x16<S>) {
        let of = |value: f32| f32x16::splat(simd, value);
        let (a, b, c) = (of(self.knots[0]), of(self.knots[1]), of(self.knots[2]));
        // With two there is nothing beyond the second, with one nothing beyond the first.
        let middle = if self.count < MOST { of(f32::INFINITY) } else { b };
        let is_far = at.simd_ge(middle);
        let (low, high) = (is_far.select(b, a), is_far.select(c, b));
        let (first, second) = (of(self.per_step[0]), of(self.per_step[1]));
        let at = at.max(low).min(high);
        let straight = (at - low) * is_far.select(second, first);
        // A lamp's directions may be 0, and have no depth.
        let part = if self.sixth > 0.0 {
            let depth = ways * self.sixth;
            straight * (depth.mul_add(high, at) / depth.mul_add(at, at))
        } else {
            straight
        };
        (is_far, part.min(of(1.0)))
    }
}
