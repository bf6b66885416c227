//! How far apart slices may be: measured on a sample of gaps before the frame is rendered.
//!
//! What lies between two slices depends on the scene, not on the image: open terrain is smooth over many pixels, a rose
//! window changes within half a one. So in some gaps a line somewhere between the two slices gets what its pixels would get,
//! interpolated and halved as theirs are, and is compared with the slice through it: the error itself, along a line instead of
//! at a few pixels. If too many pixels are off, or all of them by too much, the spacing shrinks and is measured again. (Baran
//! et al. 2010 choose one pixel for every scene.)

use std::sync::atomic::{AtomicU64, Ordering};

/// One gap in how many is measured, of `gaps`. Fewer miss rare shafts, more cost as much as the frame: a measured gap costs
/// its two slices, the line, and whatever slices halve it for the line.
pub fn stride(gaps: usize) -> usize {
    /// Gaps that are enough.
    const ENOUGH: usize = 64;
    (gaps / ENOUGH).clamp(4, 40)
}

/// One column in how many is measured: neighbours see nearly the same, and what a measured gap costs are its pixels.
pub const COLUMN_STRIDE: u32 = 4;

/// What interpolation between slices would have been off by, on a sample of gaps: how far apart slices may be. (Baran et al. 2010
/// choose one pixel for every scene.)
///
/// Whole numbers, which add up to the same in any order of threads. The sample is one gap in 4 to 40, 64 of them or more
/// where there are as many, and one column in 4. What another sample would say is bounded by how far the gaps of this one differ.
#[derive(Debug, Default)]
pub struct SpacingEstimate {
    pixels: AtomicU64,
    /// By the share below which errors are relative to it: quarters of the refinement's floor.
    over: [AtomicU64; FLOORS],
    /// The sums of each gap's own, squared: how far another sample would be off.
    over_spread: [AtomicU64; FLOORS],
    squares_spread: AtomicU64,
    squares: AtomicU64,
    light: AtomicU64,
}

/// Standard deviations that are added to what a sample says. Fewer, and more frames miss their level; more, and frames whose
/// light is in a few gaps get slices that they do not need.
const SIGMAS: f64 = 0.75;

/// Squares of sums of squares are taken in units of 2²⁰, and of 2⁸ at the most: 256 gaps stay within 2⁶⁴.
const SPREAD_SHIFT: u32 = 20;

/// Floors that are counted: down to a 256th, for pictures that are dark but for a few shafts.
const FLOORS: usize = 5;

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
    /// Counts pixels by what they get and what they should get.
    #[inline(always)]
    pub fn count(&self, target: ErrorTarget, floor: f32, found: &[f32], exact: &[f32]) {
        let mut over = [0u64; FLOORS];
        let (mut squares, mut light) = (0u64, 0u64);
        let floors: [f32; FLOORS] = std::array::from_fn(|step| floor * 0.25f32.powi(step as i32));
        for (&found, &share) in found.iter().zip(exact) {
            // What is left to be walked is exact.
            let error = if found < 0.0 { 0.0 } else { (share - found).abs() };
            for (over, &floor) in over.iter_mut().zip(&floors) {
                *over += u64::from(error > target.error * share.max(floor));
            }
            squares += ((error * error).min(1024.0) * SQUARE_UNITS) as u64;
            light += (share.min(1024.0) * LIGHT_UNITS) as u64;
        }
        let coarse = (squares >> SPREAD_SHIFT).min(1 << 28);
        let sums = [
            (&self.pixels, exact.len() as u64),
            (&self.squares, squares),
            (&self.squares_spread, coarse * coarse),
            (&self.light, light),
        ];
        let spread = self.over_spread.iter().zip(over.map(|count| count * count));
        for (sum, own) in sums.into_iter().chain(self.over.iter().zip(over)).chain(spread) {
            sum.fetch_add(own, Ordering::Relaxed);
        }
    }

    /// By how much the target is missed, or kept if it is at most 1.
    pub fn excess(&self, target: ErrorTarget, floor: f32) -> f64 {
        let read = |sum: &AtomicU64| sum.load(Ordering::Relaxed) as f64;
        let pixels = read(&self.pixels).max(1.0);
        let mean = read(&self.light) / f64::from(LIGHT_UNITS) / pixels;
        // What another sample of as many gaps may have more of: gaps are drawn one by one, so the variance of a sum is the sum
        // of its squares.
        let unit = f64::from(SQUARE_UNITS) / f64::from(1u32 << SPREAD_SHIFT);
        let squares =
            read(&self.squares) / f64::from(SQUARE_UNITS) + SIGMAS * read(&self.squares_spread).sqrt() / unit;
        let rms = (squares / pixels).sqrt();
        // p99: one pixel in a hundred may be off. Without any light nothing is.
        let most = (f64::from(target.rms) * mean).max(f64::MIN_POSITIVE);
        // Errors of what is darker than a hundredth of the mean are relative to that (MODEL.md, "Error figures").
        let step = (f64::from(floor) / (0.01 * mean)).max(1.0).log(4.0).round().min((FLOORS - 1) as f64);
        let step = step as usize;
        let over = read(&self.over[step]) + SIGMAS * read(&self.over_spread[step]).sqrt();
        (over / (0.01 * pixels)).max(rms / most)
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

    /// An estimate of gaps of 100 pixels, of which `over` are off by a tenth; shares are a half.
    fn estimate(gaps: &[usize]) -> f64 {
        let target = ErrorTarget { error: 0.05, rms: 1.0, finest: 0.1 };
        let estimate = SpacingEstimate::default();
        for &over in gaps {
            let found: Vec<f32> = (0..100).map(|pixel| if pixel < over { 0.55 } else { 0.5 }).collect();
            estimate.count(target, 0.01, &found, &[0.5; 100]);
        }
        estimate.excess(target, 0.01)
    }

    #[test]
    fn one_pixel_in_a_hundred_may_be_off_and_what_one_gap_says_alone_counts_for_more() {
        assert_eq!(estimate(&[0; 64]), 0.0);
        // Ten of 1,000 pixels, in ten gaps: 1 and a spread of √10 of ten; in one gap: 1 and all ten.
        let (even, alone) = (estimate(&[1; 10]), estimate(&[10, 0, 0, 0, 0, 0, 0, 0, 0, 0]));
        assert!((even - (1.0 + SIGMAS * 0.1f64.sqrt())).abs() < 1e-9, "{even}");
        assert!((alone - (1.0 + SIGMAS)).abs() < 1e-9, "{alone}");
    }

    #[test]
    fn the_rms_is_that_of_all_pixels_over_their_mean() {
        let target = ErrorTarget { error: 1.0, rms: 0.01, finest: 0.1 };
        let estimate = SpacingEstimate::default();
        for _ in 0..10_000 / 100 {
            estimate.count(target, 0.01, &[0.505; 100], &[0.5; 100]);
        }
        // RMS 0.005 over 0.5 is just what is allowed; a hundred gaps that agree add SIGMAS·√(1/100) of its square.
        let expected = (1.0 + 0.1 * SIGMAS).sqrt();
        let excess = estimate.excess(target, 0.01);
        assert!((excess / expected - 1.0).abs() < 1e-3, "{excess} {expected}");
    }

    #[test]
    fn errors_in_the_dark_are_relative_to_a_hundredth_of_the_mean() {
        let target = ErrorTarget { error: 0.05, rms: f32::MAX, finest: 0.1 };
        // Nine tenths are dark but for a share of 1e-3, off by a fifth of it; the mean is 0.0109 or 0.5.
        let excess = |lit: f32| {
            let exact: Vec<f32> = (0..100).map(|pixel| if pixel < 90 { 1e-3 } else { lit }).collect();
            let found: Vec<f32> =
                exact.iter().map(|&share| if share < 2e-3 { 1.2e-3 } else { share }).collect();
            let estimate = SpacingEstimate::default();
            estimate.count(target, 0.01, &found, &exact);
            estimate.excess(target, 0.01)
        };
        // Of a mean of 0.5 a hundredth is 0.005, which 2e-4 are four percent of.
        assert!(excess(5.0) < 1e-6);
        assert!(excess(0.1) > 50.0);
    }

    #[test]
    fn what_is_left_to_be_walked_is_exact() {
        let target = ErrorTarget { error: 0.05, rms: 0.01, finest: 0.1 };
        let estimate = SpacingEstimate::default();
        estimate.count(target, 0.01, &[-1.0; 50], &[0.5; 50]);
        assert_eq!(estimate.excess(target, 0.01), 0.0);
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
