//! How far apart slices may be: measured on a sample of gaps before the frame is rendered.
//!
//! What lies between two slices depends on the scene, not on the image: open terrain is smooth over many pixels, a rose
//! window changes within half a one. So some gaps get a further slice through their middle, and what interpolation would
//! have given there is compared with what is there. If too many pixels are off, or all of them by too much, the spacing
//! shrinks and is measured again. (Baran et al. 2010 choose one pixel for every scene.)

use std::sync::atomic::{AtomicU64, Ordering};

use super::refinement::Refinement;

/// One gap in how many is measured, of `gaps`. Fewer miss rare shafts, more cost as much as the frame.
pub fn stride(gaps: usize) -> usize {
    /// Gaps that are enough.
    const ENOUGH: usize = 100;
    (gaps / ENOUGH).clamp(4, 20)
}

/// One column in how many is measured: neighbours see nearly the same, and what a measured gap costs are its pixels.
pub const COLUMN_STRIDE: u32 = 4;

/// What interpolation between slices would have been off by, on a sample of gaps: how far apart slices may be. (Baran et al. 2010
/// choose one pixel for every scene.)
///
/// Whole numbers, which add up to the same in any order of threads. The sample is one gap in 4 to 20 and one column in 4;
/// it costs 8 to 16 % of a frame.
#[derive(Debug, Default)]
pub struct SpacingEstimate {
    pixels: AtomicU64,
    over: AtomicU64,
    squares: AtomicU64,
    light: AtomicU64,
}

/// The errors that a frame is to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorTarget {
    /// That of 99 % of its pixels, relative to each.
    pub error: f32,
    /// The RMS of all, relative to their mean.
    pub rms: f32,
    /// The finest spacing \[pixels\] that is tried.
    pub finest: f64,
}

/// Units of a sum: 2⁴⁰ of squared shares, 2²⁰ of shares. 10⁷ pixels stay within 2⁶⁴.
const SQUARE_UNITS: f32 = 1_099_511_627_776.0;
const LIGHT_UNITS: f32 = 1_048_576.0;

impl SpacingEstimate {
    /// Counts the pixels of a gap by what its two slices say of them and what a slice through its middle says.
    #[inline(always)]
    pub fn count(
        &self,
        target: ErrorTarget,
        refinement: &Refinement,
        [before, behind]: [&[f32]; 2],
        middle: &[f32],
    ) {
        let Refinement { tolerance, floor, halvings, .. } = *refinement;
        let finest = 1.0 / (1u32 << halvings) as f32;
        let (mut over, mut squares, mut light) = (0u64, 0u64, 0u64);
        for ((&a, &b), &share) in before.iter().zip(behind).zip(middle) {
            let between = 0.5 * (a + b);
            // A difference that the tolerance sees is left to a gap as fine as halvings make it.
            let seen = (b - a).abs() > 2.0 * tolerance * between.max(floor);
            let finer = if seen { finest } else { 1.0 };
            // Pixels lie anywhere in their gap: the mean over it of a parabola is two thirds of its middle.
            let error = finer * (2.0 / 3.0) * (share - between).abs();
            over += u64::from(error > target.error * share.max(floor));
            squares += ((error * error).min(1024.0) * SQUARE_UNITS) as u64;
            light += (share.min(1024.0) * LIGHT_UNITS) as u64;
        }
        let sums = [(&self.pixels, middle.len() as u64), (&self.over, over), (&self.squares, squares)];
        for (sum, own) in sums.into_iter().chain([(&self.light, light)]) {
            sum.fetch_add(own, Ordering::Relaxed);
        }
    }

    /// By how much the target is missed, or kept if it is at most 1.
    pub fn excess(&self, target: ErrorTarget) -> f64 {
        let read = |sum: &AtomicU64| sum.load(Ordering::Relaxed) as f64;
        let pixels = read(&self.pixels).max(1.0);
        let mean = read(&self.light) / f64::from(LIGHT_UNITS) / pixels;
        let rms = (read(&self.squares) / f64::from(SQUARE_UNITS) / pixels).sqrt();
        // p99: one pixel in a hundred may be off. Without any light nothing is.
        let most = (f64::from(target.rms) * mean).max(f64::MIN_POSITIVE);
        (read(&self.over) / (0.01 * pixels)).max(rms / most)
    }
}

/// The search for the widest spacing that keeps an error target.
#[derive(Debug, Clone, Copy)]
pub struct SpacingSearch {
    /// The spacing that is to be measured next, or the one that was found.
    pub spacing: f64,
    finest: f64,
    /// The last spacing that missed the target, and by how much.
    missed: Option<(f64, f64)>,
    goes_on: bool,
}

impl SpacingSearch {
    /// From a spacing on, down to the finest.
    pub fn new(spacing: f64, finest: f64) -> Self {
        Self { spacing, finest: finest.min(spacing), missed: None, goes_on: finest < spacing }
    }

    /// Whether there is something to measure.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Takes what was measured.
    ///
    /// Both the pixels that are off and the RMS fall about in proportion to the spacing. The next spacing is measured
    /// again, so a guess need not be right; it never skips more than two octaves, nor less than half of one. Between the
    /// last spacing that missed the target and the one that keeps it lies the one that just does.
    pub fn learn(&mut self, excess: f64) {
        /// What is aimed at between two measurements, of what is allowed.
        const WITH_ROOM: f64 = 0.75;
        if excess > 1.0 {
            self.goes_on = self.spacing > self.finest;
            self.missed = Some((self.spacing, excess));
            let factor = (1.0 / excess).clamp(0.25, std::f64::consts::FRAC_1_SQRT_2);
            self.spacing = (factor * self.spacing).max(self.finest);
            return;
        }
        self.goes_on = false;
        if let Some((wider, worse)) = self.missed
            && excess < WITH_ROOM
        {
            let excess = excess.max(0.01);
            let part = (WITH_ROOM / excess).ln() / (worse / excess).ln();
            self.spacing *= (wider / self.spacing).powf(part);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spacing that is found where the error is `worst·spacingᵖ` times what is allowed.
    fn found(worst: f64, power: f64) -> (f64, u32) {
        let mut search = SpacingSearch::new(4.0, 0.125);
        let mut measured = 0;
        while search.goes_on() {
            measured += 1;
            search.learn(worst * search.spacing.powf(power));
        }
        (search.spacing, measured)
    }

    #[test]
    fn the_search_finds_the_spacing_that_just_keeps_the_target() {
        for worst in [0.3f64, 0.7, 1.3, 2.0, 3.3, 5.0] {
            for power in [0.7, 1.0, 1.5] {
                let (spacing, measured) = found(worst, power);
                let excess = worst * spacing.powf(power);
                println!(
                    "{worst}·spacing^{power}: {spacing:.3} after {measured}, {excess:.3} of what is allowed"
                );
                let as_wide_as_can_be = excess > 0.749 || spacing == 4.0;
                let kept = excess <= 1.0 || spacing == 0.125;
                assert!(kept && as_wide_as_can_be && measured <= 5, "{worst} {power}");
            }
        }
        assert_eq!(found(0.0, 1.0), (4.0, 1));
        assert_eq!(found(1e6, 1.0).0, 0.125);
        assert!(found(f64::INFINITY, 1.0).0 == 0.125);
    }
}
