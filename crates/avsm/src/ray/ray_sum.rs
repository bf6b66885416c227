//! The radiance of one pixel, added up from what walks through its maps find.

use glam::DVec3;

use crate::curves::avsm::AvsmCurve;
use crate::ray::crossing::Crossing;
use crate::ray::dimmed_light::{DimmedLight, DimmedPart};

/// What takes the parts of a ray that a walk through a curve map finds.
pub trait RayParts {
    /// A part that nothing dims. They come in the order of the ray.
    fn clear(&mut self, a: f64, b: f64);

    /// A part that something dims.
    fn dimmed(&mut self, part: &DimmedPart);

    /// The whole way through a texel of adaptive curves; `false` if it is to be cut into parts instead.
    fn crossing<const N: usize>(&mut self, crossing: &Crossing, curve: &AvsmCurve<N>) -> bool;
}

/// Adds up the parts of one ray.
pub struct RaySum<'a> {
    light: DimmedLight<'a>,
    /// A part that nothing dims, joined with those that touch it.
    open: Option<[f64; 2]>,
    sum: DVec3,
}

impl<'a> RaySum<'a> {
    /// Of no part.
    pub fn new(light: DimmedLight<'a>) -> Self {
        Self { light, open: None, sum: DVec3::ZERO }
    }

    /// RGB radiance of all parts.
    pub fn finish(mut self) -> DVec3 {
        self.flush();
        self.sum
    }

    fn flush(&mut self) {
        if let Some([a, b]) = self.open.take() {
            self.sum += self.light.lit(a, b);
        }
    }
}

impl RayParts for RaySum<'_> {
    fn clear(&mut self, a: f64, b: f64) {
        if !(a < b) {
            return;
        }
        match &mut self.open {
            Some([_, end]) if *end == a => *end = b,
            _ => {
                self.flush();
                self.open = Some([a, b]);
            }
        }
    }

    fn dimmed(&mut self, part: &DimmedPart) {
        self.sum += self.light.dimmed(part);
    }

    fn crossing<const N: usize>(&mut self, crossing: &Crossing, curve: &AvsmCurve<N>) -> bool {
        match self.light.crossing(crossing, curve) {
            Some(radiance) => {
                self.sum += radiance;
                true
            }
            None => false,
        }
    }
}
