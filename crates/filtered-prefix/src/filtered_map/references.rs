//! Reference rays of a filtered map: as many as the light along view rays differs, between two of which pixels are blended; at most
//! three, since a fourth changed nothing that was measured.
//!
//! Klehm et al. (2014, Section 3.2) take one a row. Where view rays of a row cross the light at angles from 5 to 80 degrees, one way
//! across the light is ten times as long on some as on others, and no ray stands for all. Under a sun references are ways a unit across
//! the light, `1/sin β`, in geometric steps; around a lamp directions in the slice, in even steps.

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
        Self { knots, count, sixth: if is_lamp { 0.0 } else { sigma as f32 / 6.0 } }
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

    /// The nearer of the two references of view rays, and the part of the other one. `ways` are the rays' lengths, or 0.
    ///
    /// The normalised weights of rays of an optical depth τ lie between those of two others about as `1/(1 + τ/6)` does: linear in τ
    /// where it is small, in the mean way `1/τ` where it is large.
    #[inline(always)]
    pub fn blend<const L: usize>(
        &self,
        at: &[f32; L],
        ways: &[f32; L],
        firsts: &mut [u32; L],
        parts: &mut [f32; L],
    ) {
        if self.count == 1 {
            (*firsts, *parts) = ([0; L], [0.0; L]);
            return;
        }
        let [a, b, c] = self.knots;
        // With two there is nothing beyond the second.
        let middle = if self.count == 2 { f32::INFINITY } else { b };
        // A lamp's directions may be 0, and have no depth.
        let is_bent = self.sixth > 0.0;
        for lane in 0..L {
            let is_far = at[lane] >= middle;
            let (low, high) = (if is_far { b } else { a }, if is_far { c } else { b });
            let at = at[lane].max(low).min(high);
            let depth = self.sixth * ways[lane];
            let (bent, straight) = ((at + depth * high) / (at + depth * at), (at - low) / (high - low));
            let part = if is_bent { straight * bent } else { straight };
            firsts[lane] = u32::from(is_far);
            parts[lane] = part.min(1.0);
        }
    }
}
