//! Bands of view rays, by 1/sin β, and the factors that serve all of them.
//!
//! The integrand `e^{−σγ/sin β}` needs few terms where 1/sin β varies by a factor of two at most (5-term bound 1e-4 at
//! any optical depth). Towards the epipole 1/sin β grows without limit: the paper marches the pixels within two
//! degrees of it, which cost it three quarters of its time. Instead view rays are sorted into bands of equal ratio.
//! With γ scaled by the band's smallest 1/sin β all bands have the same integrand, so one factorisation a frame serves
//! every band and every slice, around the epipole and the anti-epipole.

use glam::DVec2;
use scatter_core::Camera;

use crate::geometry::{Epipole, SliceSet};

/// Bands `[lowest·ratioʲ, lowest·ratioʲ⁺¹]` of 1/sin β, in place of the ring that Baran et al. 2010 (Section 6) march around
/// the epipole: with γ scaled by a band's smallest 1/sin β all bands of a sun have one factorisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bands {
    /// Smallest 1/sin β of the image, ≥ 1.
    pub lowest: f64,
    /// Ratio of a band, in (1, widest].
    pub ratio: f64,
    /// How many there are, ≥ 1.
    pub count: u32,
    /// Smallest and largest β of the image, radians.
    pub angles: [f64; 2],
}

impl Bands {
    /// Bands that cover all view rays of an image, none wider than the ratio `widest` > 1, none beyond
    /// 1/sin β = `steepest`.
    pub fn cover(camera: &Camera, epipole: &Epipole, slices: &SliceSet, widest: f64, steepest: f64) -> Self {
        let [width, height] = camera.size().map(f64::from);
        let (mut lowest, mut highest) = (f64::INFINITY, 1.0f64);
        let mut angles = [std::f64::consts::PI, 0.0f64];
        let mut visit = |p: DVec2| {
            let direction = camera.ray(p.x, p.y).direction;
            let (sine, cosine) =
                (direction.cross(epipole.to_light).length(), direction.dot(epipole.to_light));
            let cosecant = 1.0 / sine.max(1.0 / steepest);
            let angle = sine.atan2(cosine);
            angles = [angles[0].min(angle), angles[1].max(angle)];
            lowest = lowest.min(cosecant);
            highest = highest.max(cosecant);
        };
        // β has no extremum within the image but at the epipole, so its border has the largest sine, or the sine is 1
        // somewhere and the border crosses that line, too.
        for corner in
            [DVec2::ZERO, DVec2::new(width, 0.0), DVec2::new(0.0, height), DVec2::new(width, height)]
        {
            visit(corner);
        }
        for slice in &slices.slices {
            visit(slice.exit);
        }
        // Entries of slices that come from outside: the opposite borders.
        let steps = 64;
        for step in 0..=steps {
            let part = f64::from(step) / f64::from(steps);
            for p in [
                DVec2::new(part * width, 0.0),
                DVec2::new(part * width, height),
                DVec2::new(0.0, part * height),
                DVec2::new(width, part * height),
            ] {
                visit(p);
            }
        }
        // The image point nearest to the epipole has the largest 1/sin β.
        if epipole.image.z > 0.0 {
            let p = epipole.image.truncate() / epipole.image.z;
            visit(DVec2::new(p.x.clamp(0.0, width), p.y.clamp(0.0, height)));
        }
        // The border is sampled, not searched: a thousandth of room on both sides.
        let lowest = (lowest * 0.999).max(1.0);
        let range = (highest * 1.001 / lowest).max(1.001);
        let count = (range.ln() / widest.ln()).ceil().max(1.0);
        Self { lowest, ratio: range.powf(1.0 / count), count: count as u32, angles }
    }

    /// The smallest 1/sin β of a band.
    pub fn start(&self, band: u32) -> f64 {
        self.lowest * self.ratio.powi(band as i32)
    }

    /// The band of a view ray, and where it begins and ends; the outermost ones take what rounding leaves outside.
    pub fn of(&self, cosecant: f32) -> (u32, [f32; 2]) {
        let (mut band, mut start) = (0, f32::NEG_INFINITY);
        let mut end = (self.lowest * self.ratio) as f32;
        while cosecant >= end && band + 1 < self.count {
            band += 1;
            start = end;
            end *= self.ratio as f32;
        }
        (band, [start, if band + 1 < self.count { end } else { f32::INFINITY }])
    }
}
