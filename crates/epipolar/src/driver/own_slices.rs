//! Which pixels get slices of their own, since slices that are close enough for them would cost more.
//!
//! The dark pixels whose rays [end on steps of the map](super::step_ends) are the ones. The measured sample knows them, so it tells what is missed
//! with and without them.

use super::spacing_sample::{ErrorTarget, Measured, SpacingSample, measured};

/// Multiples of the picture's mean lit share up to which pixels may be answered on their own: in steps that change the cost, not the
/// error. What is as bright as the picture needs it nowhere: a step is a small part of a ray.
const MULTIPLES: [f64; 4] = [0.1, 0.3, 1.0, 3.0];

/// Error that is accepted to answer fewer pixels, over that of answering all of them.
const AS_GOOD: f64 = 1.1;

/// What a slice of its own costs a pixel, and what a slice costs beside its queries, both in queries.
const OWN_SLICE: f64 = 250.0;
const SLICE: f64 = 1000.0;

/// Power of the spacing that errors fall with, where two measurements have not told it yet.
const POWER: f64 = 0.75;

/// Whether a frame whose slices miss their target by `without` is better served by slices of their own for pixels that end on steps:
/// up to which multiple of the mean share, and what is missed then. `pixels` and `slices` are those of the frame.
pub fn own_slices<'a>(
    samples: impl Iterator<Item = &'a SpacingSample> + Clone,
    target: ErrorTarget,
    without: Measured,
    (pixels, slices): (f64, f64),
) -> Option<(f64, Measured)> {
    let of = |multiple: f64| measured(samples.clone(), target, multiple);
    let best = of(MULTIPLES[MULTIPLES.len() - 1]);
    let multiple = MULTIPLES.into_iter().find(|&multiple| of(multiple).excess <= AS_GOOD * best.excess)?;
    let with = of(multiple);
    let finer = |excess: f64| excess.max(1.0).powf(1.0 / POWER);
    let saved = (finer(without.excess) - finer(with.excess)) * slices * SLICE;
    (saved > with.own_share * pixels * OWN_SLICE).then_some((multiple, with))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Confidence;

    const TARGET: ErrorTarget = ErrorTarget {
        error: 0.05,
        rms: 1.0,
        within: [0.1, 4.0],
        confidence: Confidence { gaps: 80, sigmas: 0.75 },
    };

    #[test]
    fn the_dark_that_ends_on_steps_gets_slices_of_its_own_where_finer_ones_cost_more() {
        // A tenth of the picture is lit; a fifth of the dark ends on steps, a hundredth as bright as the mean and off by all of it.
        let mut sample = SpacingSample::default();
        for _ in 0..40 {
            sample.begin();
            sample.push((0..100).map(|pixel| match pixel {
                0..10 => ([1.0, 0.5, 0.0], false),
                10..28 => ([1.0, 5e-4, 5e-4], true),
                _ => ([1.0, 0.0, 0.0], false),
            }));
        }
        let samples = [&sample];
        let without = measured(samples.into_iter(), TARGET, 0.0);
        // 5e-4 of 0.5001e-1 · 0.01, that is 0.99 of what is relative to it.
        assert!((without.excess - 1.0 / 0.05).abs() < 0.5, "{without:?}");
        let (multiple, with) = own_slices(samples.into_iter(), TARGET, without, (3e5, 1e3)).unwrap();
        assert_eq!(multiple, 0.1);
        assert!(with.excess < 0.02 && (with.own_share - 0.18).abs() < 1e-9, "{with:?}");
        // Few slices over many pixels: finer ones are cheaper.
        assert_eq!(own_slices(samples.into_iter(), TARGET, without, (3e8, 1e3)), None);
    }
}
