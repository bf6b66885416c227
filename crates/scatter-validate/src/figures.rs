//! The error figures of a test image against a reference (MODEL.md, "Error figures").
//!
//! m is the mean of |R| over all pixels and channels. Values that are not finite are counted and left out of the
//! other figures, so that the picture around a NaN is still judged; a verdict fails on the count alone.

use serde::Serialize;

/// An image with the name of what made it: so that nothing is ever compared with itself.
#[derive(Debug, Clone, Copy)]
pub struct Labelled<'a> {
    /// What made it: a technique's id, or a file.
    pub label: &'a str,
    /// `[width, height]`.
    pub size: [u32; 2],
    /// RGB radiance, `[y][x]`, row 0 on top.
    pub pixels: &'a [[f32; 3]],
}

/// How far a test image is from its reference. All figures but the counts are fractions, not percent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// `sqrt(mean((T−R)²)) / m`.
    pub rel_rmse: f64,
    /// 99th percentile of `|T−R| / max(|R|, 0.01·m)` over pixel-channels, interpolated linearly.
    pub p99: f64,
    /// Largest of the same.
    pub max: f64,
    /// p99 over the pixel-channels with `max(|R|, |T|) > 0.01·m`; 0 if there are none.
    pub p99_lit: f64,
    /// `mean(T−R) / m`.
    pub bias: f64,
    /// NaN and infinite values of the test image.
    pub non_finite: u64,
    /// NaN and infinite values of the reference.
    pub reference_non_finite: u64,
    /// m.
    pub reference_mean: f64,
    /// Pixels that were compared (those that the mask leaves in).
    pub pixels: u64,
}

/// Two images that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The same image twice: its error would be zero whatever is wrong with it.
    #[error("{label} would be compared with itself; give two different images")]
    SameImage {
        /// The label of both.
        label: String,
    },
    /// Different sizes.
    #[error("{reference} is {reference_size} and {test} {test_size}; give two images of one size")]
    Size {
        /// Label of the reference.
        reference: String,
        /// Its size, `WxH`.
        reference_size: String,
        /// Label of the test image.
        test: String,
        /// Its size, `WxH`.
        test_size: String,
    },
    /// A mask of another size.
    #[error("the mask has {found} pixels and the images have {expected}; give a mask of their size")]
    MaskSize {
        /// Pixels of the images.
        expected: usize,
        /// Pixels of the mask.
        found: usize,
    },
    /// A mask that leaves nothing.
    #[error("the mask leaves no pixel to compare; black pixels of a mask are kept, white ones left out")]
    NothingLeft,
}

/// Compares `test` with `reference`, leaving out the pixels where `mask` is true.
pub fn compare(
    reference: Labelled<'_>,
    test: Labelled<'_>,
    mask: Option<&[bool]>,
) -> Result<Figures, CompareError> {
    check(reference, test, mask)?;
    let kept = || {
        (0..reference.pixels.len())
            .filter(|&index| mask.is_none_or(|mask| !mask[index]))
            .flat_map(|index| reference.pixels[index].into_iter().zip(test.pixels[index]))
            .map(|(r, t)| (f64::from(r), f64::from(t)))
    };
    let finite = || kept().filter(|(r, t)| r.is_finite() && t.is_finite());
    let pixels = mask.map_or(reference.pixels.len(), |mask| mask.iter().filter(|&&out| !out).count());
    if pixels == 0 {
        return Err(CompareError::NothingLeft);
    }
    let count = (finite().count() as f64).max(1.0);
    let mean = finite().map(|(r, _)| r.abs()).sum::<f64>() / count;
    let mean_sq = finite().map(|(r, t)| (t - r) * (t - r)).sum::<f64>() / count;
    let floor = 0.01 * mean;
    let mut all: Vec<f64> = finite().map(|(r, t)| ratio((t - r).abs(), r.abs().max(floor))).collect();
    let max = all.iter().copied().fold(0.0, f64::max);
    let p99 = percentile(&mut all, 0.99);
    all.clear();
    all.extend(
        finite()
            .filter(|(r, t)| r.abs().max(t.abs()) > floor)
            .map(|(r, t)| ratio((t - r).abs(), r.abs().max(floor))),
    );
    let p99_lit = percentile(&mut all, 0.99);
    // The difference pixel by pixel, not of two means: a small bias keeps its digits.
    let mean_difference = finite().map(|(r, t)| t - r).sum::<f64>() / count;
    Ok(Figures {
        rel_rmse: ratio(mean_sq.sqrt(), mean),
        p99,
        max,
        p99_lit,
        bias: ratio(mean_difference.abs(), mean).copysign(mean_difference),
        non_finite: kept().filter(|(_, t)| !t.is_finite()).count() as u64,
        reference_non_finite: kept().filter(|(r, _)| !r.is_finite()).count() as u64,
        reference_mean: mean,
        pixels: pixels as u64,
    })
}

/// The `share` quantile of `values` (reordered), with linear interpolation between its two neighbours; 0 of nothing.
fn percentile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let position = share * (values.len() - 1) as f64;
    let below = position.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    let high = above.iter().copied().fold(f64::INFINITY, f64::min);
    let fraction = position - below as f64;
    // Without a fraction the upper neighbour does not count (it may be infinite, or not exist).
    if fraction == 0.0 { low } else { low + fraction * (high - low) }
}

/// `error / scale`, where no error is 0 even of nothing: against an all-black reference any light is infinitely wrong.
fn ratio(error: f64, scale: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / scale }
}

fn check(reference: Labelled<'_>, test: Labelled<'_>, mask: Option<&[bool]>) -> Result<(), CompareError> {
    let same_buffer = std::ptr::eq(reference.pixels.as_ptr(), test.pixels.as_ptr());
    if reference.label == test.label || same_buffer {
        return Err(CompareError::SameImage { label: test.label.to_string() });
    }
    if reference.size != test.size || reference.pixels.len() != test.pixels.len() {
        let text = |size: [u32; 2]| format!("{}x{}", size[0], size[1]);
        return Err(CompareError::Size {
            reference: reference.label.to_string(),
            reference_size: text(reference.size),
            test: test.label.to_string(),
            test_size: text(test.size),
        });
    }
    match mask {
        Some(mask) if mask.len() != test.pixels.len() => {
            Err(CompareError::MaskSize { expected: test.pixels.len(), found: mask.len() })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn against(reference: &[[f32; 3]], test: &[[f32; 3]], mask: Option<&[bool]>) -> Figures {
        let size = [reference.len() as u32, 1];
        compare(
            Labelled { label: "reference", size, pixels: reference },
            Labelled { label: "test", size, pixels: test },
            mask,
        )
        .unwrap()
    }

    #[test]
    fn a_constant_offset_is_its_own_rmse_and_bias() {
        let figures = against(&[[2.0; 3]; 7], &[[1.5; 3]; 7], None);
        assert_eq!((figures.rel_rmse, figures.bias), (0.25, -0.25));
        assert_eq!((figures.p99, figures.max, figures.p99_lit), (0.25, 0.25, 0.25));
        assert_eq!((figures.reference_mean, figures.pixels), (2.0, 7));
    }

    #[test]
    fn one_wrong_value_in_a_hundred_pixels() {
        let reference = [[1.0f32; 3]; 100];
        let mut test = reference;
        test[42][1] = 4.0;
        let figures = against(&reference, &test, None);
        // One of 300 values is off by 3: sqrt(9/300), and 3/300.
        assert!((figures.rel_rmse - 0.03f64.sqrt()).abs() < 1e-15);
        assert!((figures.bias - 0.01).abs() < 1e-15);
        // Position 0.99·299 = 296.01: below the one wrong value.
        assert_eq!((figures.p99, figures.max), (0.0, 3.0));
    }

    #[test]
    fn p99_is_interpolated_linearly() {
        // 51 values 0, 1, … 50 on a reference of 1: position 0.99·50 = 49.5, half way between 49 and 50.
        let reference = [[1.0f32; 3]; 17];
        let mut test = reference;
        for (index, value) in test.iter_mut().flatten().enumerate() {
            *value += ((index * 20) % 51) as f32;
        }
        let figures = against(&reference, &test, None);
        assert!((figures.p99 - 49.5).abs() < 1e-12, "{}", figures.p99);
    }

    #[test]
    fn dark_values_are_measured_against_a_hundredth_of_the_mean() {
        // m = 1: the black value of the reference is off by 0.005, half of the floor.
        let reference = [[0.0, 1.5, 1.5]];
        let figures = against(&reference, &[[0.005, 1.5, 1.5]], None);
        assert!((figures.max - 0.5).abs() < 1e-7);
        // It is below the floor in both images, so p99_lit does not see it.
        assert_eq!(figures.p99_lit, 0.0);
    }

    #[test]
    fn values_that_are_not_finite_are_counted_and_left_out() {
        let reference = [[1.0f32; 3]; 4];
        let mut test = [[1.5f32; 3]; 4];
        test[0] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        let figures = against(&reference, &test, None);
        assert_eq!((figures.non_finite, figures.reference_non_finite), (3, 0));
        assert_eq!((figures.rel_rmse, figures.bias), (0.5, 0.5));
        assert_eq!(against(&[[f32::NAN; 3], [1.0; 3]], &[[1.0; 3]; 2], None).reference_non_finite, 3);
    }

    #[test]
    fn against_black_any_light_is_infinitely_wrong_and_none_is_right() {
        let black = [[0.0f32; 3]; 5];
        let copy = black;
        assert_eq!(against(&black, &copy, None).rel_rmse, 0.0);
        let mut test = black;
        test[3][2] = 1e-30;
        let figures = against(&black, &test, None);
        assert!(figures.rel_rmse == f64::INFINITY && figures.max == f64::INFINITY);
        assert_eq!(figures.bias, f64::INFINITY);
    }

    #[test]
    fn masked_pixels_are_left_out_of_everything() {
        let reference = [[1.0f32; 3], [100.0; 3]];
        let figures = against(&reference, &[[1.25; 3], [f32::NAN; 3]], Some(&[false, true]));
        assert_eq!((figures.rel_rmse, figures.non_finite, figures.pixels), (0.25, 0, 1));
        assert_eq!(figures.reference_mean, 1.0);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let (a, b) = ([[1.0f32; 3]; 6], [[1.0f32; 3]; 6]);
        let image = |label, size, pixels| Labelled { label, size, pixels };
        let error = |r, t, mask: Option<&[bool]>| compare(r, t, mask).unwrap_err();
        let same_label = error(image("x", [3, 2], &a), image("x", [3, 2], &b), None);
        assert!(matches!(same_label, CompareError::SameImage { .. }));
        let same_buffer = error(image("x", [3, 2], &a), image("y", [3, 2], &a), None);
        assert!(matches!(same_buffer, CompareError::SameImage { .. }));
        let turned = error(image("x", [3, 2], &a), image("y", [2, 3], &b), None);
        assert_eq!(turned.to_string(), "x is 3x2 and y 2x3; give two images of one size");
        let short = error(image("x", [3, 2], &a), image("y", [3, 2], &b), Some(&[false; 5]));
        assert_eq!(short, CompareError::MaskSize { expected: 6, found: 5 });
        let nothing = error(image("x", [3, 2], &a), image("y", [3, 2], &b), Some(&[true; 6]));
        assert_eq!(nothing, CompareError::NothingLeft);
    }
}
