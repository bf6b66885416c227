//! From two images to a cell: the errors as shares of the unoccluded values, the worst pixel, and a verdict.

use scatter_core::ScatterImage;

use super::cell::{Cell, Miss};
use super::row::CLOSED_FORM;
use crate::checks::finite::first_insane;
use crate::contender::FILM;
use crate::texel_cells::Expected;

/// How an image is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// No pixel is off by more than this share of its unoccluded value.
    Largest(f64),
    /// p99 and RMS over all pixels and channels are both within this share.
    Film(f64),
}

impl Limit {
    /// That of a technique: exact where nothing casts a shadow, the film level elsewhere; `images` that were rendered
    /// (an error of each may be in what is compared); `input` is what the row's own input is good to.
    pub fn of_technique(casts_shadow: bool, images: u32, input: f64) -> Self {
        let images = f64::from(images);
        if casts_shadow {
            Self::Film(images * FILM + input)
        } else {
            Self::Largest(images * CLOSED_FORM + input)
        }
    }

    /// What is allowed.
    pub fn share(self) -> f64 {
        match self {
            Self::Largest(share) | Self::Film(share) => share,
        }
    }
}

/// Transmittance is a closed form for everybody: an f32 exponent of up to 87 is good to 5e-6 of the value.
const TRANSMITTANCE: f64 = 1e-5;

/// The cell of an image that should be `expected`, from input whose ray ends are good to a share of `input`.
pub fn judged(image: &ScatterImage, size: [u32; 2], expected: &Expected, limit: Limit, input: f64) -> Cell {
    if let Some(fault) = meaningless(image, size) {
        return Cell::fault(fault);
    }
    let errors = errors(image.inscattered(), &expected.radiance, &expected.scale, |error| error.abs());
    let cell = from_errors(&errors, size, limit);
    if cell.has_failed() { cell } else { wrong_transmittance(image, size, expected, input).unwrap_or(cell) }
}

/// Why an image is held to no error, and whether it may be brighter than with all of the light.
pub struct NoPromise {
    /// What the mode says.
    pub why: String,
    /// Whether no share of light is in it that would have to be at most 1.
    pub may_be_brighter: bool,
}

/// The cell of an image of a mode that promises no error: it means something, nothing is brighter than with all of the light,
/// transmittance is right, and the error that `limit` would have judged is told.
pub fn unpromised(
    image: &ScatterImage,
    size: [u32; 2],
    expected: &Expected,
    (limit, input): (Limit, f64),
    NoPromise { why, may_be_brighter }: NoPromise,
) -> Cell {
    if let Some(fault) = meaningless(image, size) {
        return Cell::fault(fault);
    }
    let above = errors(image.inscattered(), &expected.scale, &expected.scale, |error| error.max(0.0));
    if let Cell::Fail(miss) = from_errors(&above, size, Limit::Largest(CLOSED_FORM + input))
        && !may_be_brighter
    {
        return Cell::Fail(Miss { figure: "above the unoccluded value by", ..miss });
    }
    if let Some(cell) = wrong_transmittance(image, size, expected, input) {
        return cell;
    }
    let errors = errors(image.inscattered(), &expected.radiance, &expected.scale, |error| error.abs());
    let error = match from_errors(&errors, size, limit) {
        Cell::Fail(Miss { error, .. }) | Cell::Ok { error } => error,
        other => return other,
    };
    Cell::Unpromised { error, level: limit.share(), why }
}

/// What no image of this size can mean.
fn meaningless(image: &ScatterImage, size: [u32; 2]) -> Option<String> {
    if image.size() != size {
        let ([w, h], [we, he]) = (image.size(), size);
        return Some(format!("the image is {w}x{h} instead of {we}x{he}"));
    }
    first_insane(image)
}

/// The failure of a transmittance that is off.
fn wrong_transmittance(
    image: &ScatterImage,
    size: [u32; 2],
    expected: &Expected,
    input: f64,
) -> Option<Cell> {
    let off = image
        .transmittance()
        .iter()
        .flatten()
        .zip(expected.transmittance.iter().flatten())
        .map(|(&t, &e)| (f64::from(t) - e).abs());
    // σ·dD·e^{−σD} is at most dD/(e·D).
    let most = TRANSMITTANCE + input;
    let (index, error) = worst(&off.collect::<Vec<_>>());
    (error > most).then(|| {
        Cell::Fail(Miss {
            figure: "transmittance",
            error,
            limit: most,
            pixel: Some(pixel(index, size)),
            what: String::new(),
        })
    })
}

/// `size_of(T − R) / scale` of every pixel and channel, channel fastest. Where both are equal it is 0, whatever the
/// scale; what is smaller than every normal f32 is no difference.
pub fn errors(
    image: &[[f32; 3]],
    expected: &[[f64; 3]],
    scale: &[[f64; 3]],
    size_of: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let values = image.iter().flatten().zip(expected.iter().flatten()).zip(scale.iter().flatten());
    values
        .map(|((&value, &expected), &scale)| {
            let error = size_of(f64::from(value) - expected);
            if error <= f64::from(f32::MIN_POSITIVE) { 0.0 } else { error / scale }
        })
        .collect()
}

/// The cell of errors that were measured already.
pub fn from_errors(errors: &[f64], size: [u32; 2], limit: Limit) -> Cell {
    let (worst_index, largest) = worst(errors);
    let (figure, error) = match limit {
        Limit::Largest(_) => ("largest error", largest),
        Limit::Film(_) => {
            let count = errors.len().max(1) as f64;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
            let p99 = percentile_99(errors);
            if p99 >= rms { ("p99", p99) } else { ("RMS", rms) }
        }
    };
    // Not `error > limit`: a NaN is a miss too.
    if error <= limit.share() {
        return Cell::Ok { error };
    }
    let what = format!("off by {largest:.2e} there");
    Cell::Fail(Miss { figure, error, limit: limit.share(), pixel: Some(pixel(worst_index, size)), what })
}

/// Index and size of the largest error; a NaN counts as the largest.
fn worst(errors: &[f64]) -> (usize, f64) {
    errors.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

fn percentile_99(errors: &[f64]) -> f64 {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let position = 0.99 * last as f64;
    let (low, high) = (sorted[position as usize], sorted[(position as usize + 1).min(last)]);
    let fraction = position.fract();
    // Without a fraction the neighbour does not count: it may be infinite.
    if fraction == 0.0 { low } else { low + fraction * (high - low) }
}

fn pixel(index: usize, size: [u32; 2]) -> [u32; 2] {
    let pixel = (index / 3) as u32;
    [pixel % size[0], pixel / size[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(size: [u32; 2], value: impl Fn(u32, u32) -> f32) -> ScatterImage {
        let mut image = ScatterImage::new();
        image.resize(size);
        let width = size[0];
        for (index, pixel) in image.pixels_mut().0.iter_mut().enumerate() {
            *pixel = [value(index as u32 % width, index as u32 / width); 3];
        }
        image
    }

    fn expected(size: [u32; 2], radiance: f64, scale: f64) -> Expected {
        let count = (size[0] * size[1]) as usize;
        Expected {
            radiance: vec![[radiance; 3]; count],
            scale: vec![[scale; 3]; count],
            transmittance: vec![[1.0; 3]; count],
        }
    }

    #[test]
    fn an_error_is_a_share_of_the_unoccluded_value_and_names_its_pixel() {
        let size = [5, 3];
        let image = image(size, |x, y| if (x, y) == (3, 2) { 1.5 } else { 1.0 });
        let cell = judged(&image, size, &expected(size, 1.0, 2.0), Limit::Largest(0.1), 0.0);
        let Cell::Fail(miss) = cell else { panic!("{cell:?}") };
        assert_eq!((miss.figure, miss.error, miss.pixel), ("largest error", 0.25, Some([3, 2])));
        assert!(matches!(
            judged(&image, size, &expected(size, 1.0, 2.0), Limit::Largest(0.25), 0.0),
            Cell::Ok { error: 0.25 }
        ));
    }

    #[test]
    fn the_film_limit_lets_one_value_in_a_hundred_be_off_but_not_far() {
        let size = [20, 11];
        let one = |value: f32| image(size, move |x, y| if (x, y) == (7, 4) { value } else { 1.0 });
        // One of 220 pixels: RMS = x·√(1/220) = 0.067·x.
        let judge = |value| judged(&one(value), size, &expected(size, 1.0, 1.0), Limit::Film(0.01), 0.0);
        assert!(matches!(judge(1.1), Cell::Ok { .. }));
        assert!(matches!(judge(1.2), Cell::Fail(Miss { figure: "RMS", .. })));
    }

    #[test]
    fn a_nan_fails_and_so_do_a_wrong_size_and_a_wrong_transmittance() {
        let size = [3, 2];
        let limit = Limit::Largest(1e9);
        let with_nan = image(size, |x, _| if x == 1 { f32::NAN } else { 1.0 });
        assert!(matches!(judged(&with_nan, size, &expected(size, 1.0, 1.0), limit, 0.0), Cell::Fail(_)));
        let other = image([2, 3], |_, _| 1.0);
        assert!(matches!(judged(&other, size, &expected(size, 1.0, 1.0), limit, 0.0), Cell::Fail(_)));
        let mut opaque = expected(size, 1.0, 1.0);
        opaque.transmittance[4] = [0.5; 3];
        let Cell::Fail(miss) = judged(&image(size, |_, _| 1.0), size, &opaque, limit, 0.0) else { panic!() };
        assert_eq!((miss.figure, miss.pixel), ("transmittance", Some([1, 1])));
    }

    #[test]
    fn without_a_promise_an_error_is_told_and_everything_else_is_held_to() {
        let size = [3, 2];
        let half = expected(size, 0.5, 1.0);
        let cell = |image: &ScatterImage, expected: &Expected| {
            let no_promise = NoPromise { why: "why not".into(), may_be_brighter: false };
            unpromised(image, size, expected, (Limit::Film(0.01), 0.0), no_promise)
        };
        // 0.3 of the unoccluded value everywhere.
        let Cell::Unpromised { error, level, why } = cell(&image(size, |_, _| 0.8), &half) else { panic!() };
        assert!((error - 0.3).abs() < 1e-6 && level == 0.01 && why == "why not", "{error}");
        let Cell::Unpromised { error, .. } = cell(&image(size, |_, _| 0.5), &half) else { panic!() };
        assert_eq!(error, 0.0);
        // All of the light, rounded up, and more than all of it.
        let brighter = |value: f32| image(size, move |x, y| if (x, y) == (2, 1) { value } else { 0.5 });
        assert!(matches!(cell(&brighter(1.00001), &half), Cell::Unpromised { .. }));
        let Cell::Fail(miss) = cell(&brighter(1.001), &half) else { panic!() };
        assert_eq!((miss.figure, miss.pixel), ("above the unoccluded value by", Some([2, 1])));
        assert!(cell(&brighter(f32::NAN), &half).has_failed());
        assert!(cell(&brighter(-1e-9), &half).has_failed());
        let mut opaque = half;
        opaque.transmittance[0] = [0.5; 3];
        assert!(cell(&image(size, |_, _| 0.5), &opaque).has_failed());
    }

    #[test]
    fn against_black_the_smallest_light_is_infinitely_wrong() {
        let size = [3, 2];
        let black = expected(size, 0.0, 0.0);
        assert!(matches!(
            judged(&image(size, |_, _| 0.0), size, &black, Limit::Largest(0.0), 0.0),
            Cell::Ok { error: 0.0 }
        ));
        let lit = judged(&image(size, |_, _| 1e-30), size, &black, Limit::Largest(1e9), 0.0);
        assert!(matches!(lit, Cell::Fail(_)), "{lit:?}");
    }
}
