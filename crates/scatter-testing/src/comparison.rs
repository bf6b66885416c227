//! Images against what they should be: how many values differ, the first of them, and the worst.

use std::fmt;

use scatter_core::ScatterImage;

/// What a comparison of the pixels' channels found. Printed, it says what a failure's report needs: how many values are
/// out of tolerance, and the place and the figures of the first and of the worst.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Values that were compared: pixels times three.
    pub values: usize,
    /// Values that are out of tolerance; a NaN always is.
    pub differing: usize,
    /// The first that is, in the order of rows.
    pub first: Option<Value>,
    /// The one that is farthest off, as a share of what it is measured by, in tolerance or not.
    pub worst: Option<Value>,
    /// What was allowed, as a share of what each value is measured by.
    pub allowed: f64,
}

/// One channel of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Column, row and channel.
    pub place: [usize; 3],
    /// What the image holds.
    pub found: f64,
    /// What it should hold.
    pub expected: f64,
    /// How far it is off, as a share of what it is measured by.
    pub off: f64,
}

/// Nothing that a pixel holds is smaller: what is measured by less is measured by this.
const LEAST_SCALE: f64 = 1e-30;

/// The in-scattered radiance of an image's pixels, as what others are compared with.
pub fn values(image: &ScatterImage) -> Vec<[f64; 3]> {
    image.inscattered().iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Values of `found` that are farther from `expected` than `allowed` times `scale`; both `[y][x]`, of the image's size.
///
/// What a value is measured by is the caller's: a pixel's unoccluded radiance for a sum of parts that cancel, the value
/// itself for a product.
#[track_caller]
pub fn differing(
    found: &ScatterImage,
    expected: &[[f64; 3]],
    scale: &[[f64; 3]],
    allowed: f64,
) -> Comparison {
    compare(found, expected, scale, allowed, |found, expected| (found - expected).abs())
}

/// Values of `found` that exceed `bound` by more than `allowed` times `scale`.
#[track_caller]
pub fn exceeding(found: &ScatterImage, bound: &[[f64; 3]], scale: &[[f64; 3]], allowed: f64) -> Comparison {
    compare(found, bound, scale, allowed, |found, bound| found - bound)
}

#[track_caller]
fn compare(
    image: &ScatterImage,
    expected: &[[f64; 3]],
    scale: &[[f64; 3]],
    allowed: f64,
    distance: impl Fn(f64, f64) -> f64,
) -> Comparison {
    let pixels = image.inscattered();
    assert!(!pixels.is_empty(), "an image without pixels agrees with everything");
    assert_eq!([expected.len(), scale.len()], [pixels.len(); 2], "pixels of what it is compared with");
    let width = image.size()[0] as usize;
    let mut comparison =
        Comparison { values: 3 * pixels.len(), differing: 0, first: None, worst: None, allowed };
    for (n, channel) in (0..pixels.len()).flat_map(|n| (0..3).map(move |channel| (n, channel))) {
        let (found, expected) = (f64::from(pixels[n][channel]), expected[n][channel]);
        let off = distance(found, expected) / scale[n][channel].max(LEAST_SCALE);
        let value = Value { place: [n % width, n / width, channel], found, expected, off };
        // Not `off > allowed`: a NaN differs from everything.
        if !(off <= allowed) {
            comparison.differing += 1;
            comparison.first.get_or_insert(value);
        }
        // By absolute value: NaN comes last in the total order only with its sign off.
        if comparison.worst.is_none_or(|worst| rank(off).total_cmp(&rank(worst.off)).is_gt()) {
            comparison.worst = Some(value);
        }
    }
    comparison
}

/// The place of a deviation among others, NaN the worst whatever its sign.
fn rank(off: f64) -> f64 {
    if off.is_nan() { f64::NAN.abs() } else { off }
}

impl Comparison {
    /// Whether every value is within tolerance.
    pub fn is_close(&self) -> bool {
        self.differing == 0
    }

    /// The largest deviation, as a share of what it is measured by; NaN if a value is.
    pub fn largest(&self) -> f64 {
        self.worst.map_or(0.0, |value| value.off)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { values, differing, allowed, .. } = self;
        write!(f, "{differing} of {values} values are off by more than {allowed:.1e}")?;
        for (which, value) in [("first", self.first), ("worst", self.worst)] {
            if let Some(Value { place: [x, y, channel], found, expected, off }) = value {
                write!(
                    f,
                    "; {which}: pixel ({x}, {y}) channel {channel} is {found:e} instead of {expected:e}, {off:.2e} off"
                )?;
            }
        }
        Ok(())
    }
}

/// Relative RMSE as MODEL.md has it: `sqrt(mean((T − R)²)) / mean(R)` over pixels and channels; 0 for two black images.
#[track_caller]
pub fn rel_rmse(image: &ScatterImage, truth: &ScatterImage) -> f64 {
    let (mut square, mut sum) = (0.0, 0.0);
    for (a, b) in pairs(image, truth) {
        square += (a - b).powi(2);
        sum += b;
    }
    let count = 3.0 * truth.inscattered().len() as f64;
    if square == 0.0 { 0.0 } else { (square / count).sqrt() / (sum / count) }
}

/// The largest difference over all values, relative to the largest value of `a`; 0 for equal images.
#[track_caller]
pub fn largest_difference(a: &ScatterImage, b: &ScatterImage) -> f64 {
    let (mut largest, mut brightest) = (0.0f64, 0.0f64);
    for (a, b) in pairs(a, b) {
        assert!(a.is_finite() && b.is_finite(), "{a} and {b} are no radiance");
        (largest, brightest) = (largest.max((a - b).abs()), brightest.max(a));
    }
    if largest == 0.0 { 0.0 } else { largest / brightest }
}

#[track_caller]
fn pairs<'a>(a: &'a ScatterImage, b: &'a ScatterImage) -> impl Iterator<Item = (f64, f64)> + 'a {
    assert!(
        a.size() == b.size() && !a.inscattered().is_empty(),
        "two images of {:?} and {:?}",
        a.size(),
        b.size()
    );
    let values =
        |image: &'a ScatterImage| image.inscattered().iter().flatten().map(|&value| f64::from(value));
    values(a).zip(values(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of 2 × 3 pixels that holds its values' numbers.
    fn image() -> ScatterImage {
        let mut image = ScatterImage::new();
        image.resize([2, 3]);
        for (n, pixel) in image.pixels_mut().0.iter_mut().enumerate() {
            *pixel = std::array::from_fn(|channel| (3 * n + channel) as f32);
        }
        image
    }

    #[test]
    fn what_differs_is_counted_and_named() {
        let mut expected = values(&image());
        let scale = vec![[2.0; 3]; 6];
        assert!(differing(&image(), &expected, &scale, 0.0).is_close());
        // Value 10 is channel 1 of pixel 3: column 1 of row 1; value 17 is channel 2 of the last pixel.
        expected[3][1] += 1.0;
        expected[5][2] -= 3.0;
        let found = differing(&image(), &expected, &scale, 0.25);
        assert_eq!((found.differing, found.values, found.largest()), (2, 18, 1.5));
        assert_eq!(
            found.to_string(),
            "2 of 18 values are off by more than 2.5e-1; first: pixel (1, 1) channel 1 is 1e1 instead of 1.1e1, \
             5.00e-1 off; worst: pixel (1, 2) channel 2 is 1.7e1 instead of 1.4e1, 1.50e0 off"
        );
        assert_eq!(differing(&image(), &expected, &scale, 0.5).differing, 1);
        // Only the last one is above what is allowed.
        let found = exceeding(&image(), &expected, &scale, 0.25);
        assert_eq!((found.differing, found.first.unwrap().place), (1, [1, 2, 2]));
    }

    #[test]
    fn a_nan_is_out_of_every_tolerance_and_the_worst() {
        let mut spoilt = image();
        spoilt.pixels_mut().0[2][1] = -f32::NAN;
        let expected = values(&image());
        let found = differing(&spoilt, &expected, &expected, f64::INFINITY);
        assert_eq!((found.differing, found.worst.unwrap().place), (1, [0, 1, 1]));
        assert!(!exceeding(&spoilt, &expected, &expected, 1.0).is_close() && found.largest().is_nan());
    }

    #[test]
    fn relative_errors_have_their_known_answers() {
        let truth = image();
        let mut off = truth.clone();
        off.pixels_mut().0.iter_mut().flatten().for_each(|value| *value += 2.0);
        // A constant offset of 2 over a mean of (0 + … + 17)/18 = 8.5; the largest value of the second is 19.
        assert!((rel_rmse(&off, &truth) - 2.0 / 8.5).abs() < 1e-15);
        assert_eq!(largest_difference(&off, &truth), 2.0 / 19.0);
        assert_eq!((rel_rmse(&truth, &truth), largest_difference(&truth, &truth)), (0.0, 0.0));
    }
}
