//! Where on the screen the device may take another texel of a mask than a ray: the borders between texels that are
//! there and texels that are gone.
//!
//! The device interpolates texture coordinates over the triangle that it draws, whose corners are off by at most the
//! reach. At a place of the drawn triangle it finds what the true one has at the same barycentric coordinates: at a
//! place within the reach, so between the coordinates at the corners of a square of twice the reach (a projective map
//! of a square on one side of the horizon has its extremes at corners). What its f32 arithmetic adds to that is bounded
//! by its terms. If all texels that these bounds hold look alike, a ray finds the same.

use glam::{DMat3, DVec2, DVec3, DVec4};

use crate::cutout::AlphaMask;

/// Half ulps of the largest term by which a device's interpolation may be off: four roundings for a plane's
/// coefficients, three for its value, two for the division; twice that, for the devices that split it otherwise.
const ROUNDINGS: f64 = 18.0;
/// Half of an ulp of 1 in f32.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// A cut-out as a map sees it.
#[derive(Debug)]
pub(super) struct MaskOnScreen<'a> {
    mask: &'a AlphaMask,
    /// Over places `(x, y, 1)` of the screen: texture coordinates \[texels\] over w, and 1/w.
    rows: [DVec3; 3],
    /// Rounding of each, on this screen.
    slack: [f64; 3],
    /// Rounding of the corners' own coordinates.
    corner_slack: f64,
}

impl<'a> MaskOnScreen<'a> {
    /// Of corners `(x, y, _, w)` of a [`Screen`](super::doubt::Screen) at places `texels` of the mask. `None` if the
    /// triangle is seen edge on.
    pub fn new(mask: &'a AlphaMask, texels: [DVec2; 3], corners: [DVec4; 3], size: [u32; 2]) -> Option<Self> {
        // row·(x, y, w) is the coordinate at each corner, so row·(x/w, y/w, 1) is the coordinate over w.
        let [a, b, c] = corners.map(|p| DVec3::new(p.x, p.y, p.w));
        let inverse = DMat3::from_cols(a, b, c).transpose().inverse();
        let row = |values: [f64; 3]| inverse * DVec3::from(values);
        let rows = [row(texels.map(|t| t.x)), row(texels.map(|t| t.y)), row([1.0; 3])];
        let far = DVec3::new(size[0].into(), size[1].into(), 1.0);
        let slack = rows.map(|row| ROUNDINGS * HALF_ULP * row.abs().dot(far));
        let largest = texels.iter().map(|t| t.abs().max_element()).fold(0.0, f64::max);
        let corner_slack = ROUNDINGS * HALF_ULP * largest;
        rows.iter().all(|row| row.is_finite()).then_some(Self { mask, rows, slack, corner_slack })
    }

    /// Whether the device may see a texel that is there and a ray one that is gone, or the other way round, at a place
    /// of the screen.
    pub fn is_in_doubt(&self, place: DVec2, reach: f64) -> bool {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let at = (place + DVec2::new(i, j) * reach).extend(1.0);
            let per_w = self.rows[2].dot(at);
            // At or behind the horizon.
            if !(per_w > self.slack[2]) {
                return true;
            }
            let texel = DVec2::new(self.rows[0].dot(at), self.rows[1].dot(at)) / per_w;
            let rounding = (DVec2::new(self.slack[0], self.slack[1]) + texel.abs() * self.slack[2]) / per_w
                + DVec2::splat(self.corner_slack);
            low = low.min(texel - rounding);
            high = high.max(texel + rounding);
        }
        let (first, last) = (low.floor(), high.floor());
        if first == last {
            return false;
        }
        // More than four texels at once: that finely nobody resolves a mask, and rays are right anyway.
        if !((last - first).max_element() <= 1.0) {
            return true;
        }
        let there = |x: f64, y: f64| self.mask.is_there_at(DVec2::new(x, y));
        let one = there(first.x, first.y);
        [(last.x, first.y), (first.x, last.y), (last.x, last.y)].iter().any(|&(x, y)| there(x, y) != one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cutout::Wrap;

    /// Texels of the mask are ten texels of the map; columns 0, 2, 4, … are there.
    fn stripes(w: [f64; 3]) -> MaskOnScreen<'static> {
        static MASK: std::sync::OnceLock<AlphaMask> = std::sync::OnceLock::new();
        let mask = MASK.get_or_init(|| AlphaMask::new([2, 1], [Wrap::Repeat; 2], |column, _| column == 0));
        let at = |x: f64, y: f64, w: f64| DVec4::new(x * w, y * w, 0.0, w);
        let corners = [at(0.0, 0.0, w[0]), at(100.0, 0.0, w[1]), at(0.0, 100.0, w[2])];
        let texels = [DVec2::ZERO, DVec2::new(10.0, 0.0), DVec2::ZERO];
        MaskOnScreen::new(mask, texels, corners, [128, 128]).unwrap()
    }

    #[test]
    fn borders_are_in_doubt_within_the_reach_alone() {
        let (seen, reach) = (stripes([1.0; 3]), 0.01);
        for border in 1..10 {
            for offset in [-0.5, -0.02, -0.009, 0.0, 0.009, 0.02, 3.0] {
                let place = DVec2::new(f64::from(border) * 10.0 + offset, 31.5);
                assert_eq!(seen.is_in_doubt(place, reach), f64::abs(offset) < reach, "{place}");
            }
        }
    }

    #[test]
    fn a_corner_that_moves_by_the_reach_takes_no_texel_out_of_doubt() {
        let reach = 0.002;
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mask = AlphaMask::new([5, 7], [Wrap::MirroredRepeat, Wrap::Repeat], |x, y| (x * y) % 3 == 1);
        let (mut certain, mut doubted, mut changed) = (0, 0, 0);
        for _ in 0..2000 {
            let mut corner = || (DVec2::new(random(), random()) * 60.0, 10f64.powf(2.0 * random() - 1.0));
            let corners = [corner(), corner(), corner()];
            let texels = [0; 3].map(|_| DVec2::new(random(), random()) * 20.0 - 5.0);
            let homogeneous = corners.map(|(p, w)| DVec4::new(p.x * w, p.y * w, 0.0, w));
            let seen = MaskOnScreen::new(&mask, texels, homogeneous, [60, 60]).unwrap();
            let moved = corners.map(|(p, _)| p + (DVec2::new(random(), random()) * 2.0 - 1.0) * reach);
            for _ in 0..20 {
                // A place of the moved triangle, and the mask there by perspective interpolation.
                let shares = [random(), random(), random()];
                let sum: f64 = shares.iter().sum();
                let place: DVec2 = (0..3).map(|i| moved[i] * (shares[i] / sum)).sum();
                let per_w = |i: usize| shares[i] / corners[i].1;
                let texel: DVec2 =
                    (0..3).map(|i| texels[i] * per_w(i)).sum::<DVec2>() / (0..3).map(per_w).sum::<f64>();
                let true_texel = seen_at(&seen, place);
                let differs = mask.is_there_at(texel) != mask.is_there_at(true_texel);
                let in_doubt = seen.is_in_doubt(place, reach);
                assert!(in_doubt || !differs, "{place}: {texel} {true_texel}");
                changed += u32::from(differs);
                doubted += u32::from(in_doubt);
                certain += u32::from(!in_doubt);
            }
        }
        assert!(certain > 30_000 && doubted > 50 && changed > 5, "{certain} {doubted} {changed}");
    }

    fn seen_at(seen: &MaskOnScreen<'_>, place: DVec2) -> DVec2 {
        let [u, v, per_w] = seen.rows.map(|row| row.dot(place.extend(1.0)));
        DVec2::new(u, v) / per_w
    }

    #[test]
    fn the_horizon_is_in_doubt() {
        // A corner behind the eye: 1/w is 0 somewhere on the screen.
        let seen = stripes([1.0, -1.0, 1.0]);
        let doubted = (0..128).filter(|x| seen.is_in_doubt(DVec2::new(f64::from(*x), 3.5), 0.01)).count();
        assert!(doubted > 20, "{doubted}");
    }
}
