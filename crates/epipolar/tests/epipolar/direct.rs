//! Two integrators on one driver: Baran's factors against the direct sum of closed forms, over all lights and maps.

use epipolar::driver::{SliceDriver, SliceIntegrator};
use epipolar::{Baran, DirectIntegrator, Options};
use proptest::prelude::*;
use scatter_core::{RayLight, ScatterImage};
use scatter_testing::{MapKind, SliceCase, slice_cases};

use crate::judged::uniform;

/// A scene's image by an integrator, on even slices a pixel apart, and how many pixels were walked instead.
fn image<I: SliceIntegrator>(case: SliceCase, integrator: I) -> (ScatterImage, u64) {
    let settings = uniform(1.0).slices();
    case.frame().with(|frame| {
        let mut out = ScatterImage::new();
        let stats = SliceDriver::new(integrator).render(frame, &settings, &mut out);
        (out, stats.counts.get("walked pixels").unwrap())
    })
}

/// What a lamp's factors are asked for.
const FACTOR_ERROR: f64 = 2e-3;

/// What the factors may be off by, of the unoccluded radiance: a sun's eight terms are exact to the reading of their tables
/// (`Factors::bound`: 5e-4 for the worst visibility). A lamp's are not used where their measured error is above 4e-3; it is
/// measured on rays of eight lengths, and the cone is a table of 1024 steps: half as much again.
const MOST: [f64; 2] = [1e-3, 6e-3];

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn factors_find_what_the_direct_sum_finds(case in slice_cases()) {
        // A spot's cone is a table of 1024 steps to the factors: of a sliver of a narrow cone they know a few of them, and err by
        // some percent of it. The wide one of six faces stands for spots.
        prop_assume!(case.kind != MapKind::Spot);
        let film = Options { factor_error: FACTOR_ERROR, ..uniform(1.0) };
        let (factored, walked) = image(case, Baran::new(film.sums()));
        let (direct, _) = image(case, DirectIntegrator::default());
        // Where a lamp's factors are not used all pixels are walked, and slices have nothing to say. One pixel may be the
        // epipole's.
        prop_assume!(walked <= 1);
        case.frame().with(|frame| {
            let most = MOST[usize::from(frame.light().position().is_some())];
            let width = frame.size()[0];
            let whole_of = |index: u32| {
                let (x, y) = (index % width, index / width);
                let ray = frame.camera().pixel_ray(x, y);
                let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
                light.interval(0.0, frame.ray_end(x, y)).to_array()
            };
            // Errors count against a hundredth of the mean at least, as in MODEL.md: a lamp's factors are fitted for all rays of
            // a band at once, and what reaches the eye through ten optical depths more is below their rounding.
            let pixels = width * frame.size()[1];
            let mean = (0..pixels).flat_map(whole_of).sum::<f64>() / f64::from(3 * pixels);
            for (index, (a, b)) in factored.inscattered().iter().zip(direct.inscattered()).enumerate() {
                let (x, y) = (index as u32 % width, index as u32 / width);
                let whole = whole_of(index as u32);
                for channel in 0..3 {
                    let off = f64::from((a[channel] - b[channel]).abs());
                    prop_assert!(off <= most * whole[channel].max(0.01 * mean), "{case:?} {x} {y}: {a:?} {b:?} of {whole:?}");
                }
            }
            Ok(())
        })?;
    }
}
