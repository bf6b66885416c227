//! Two integrators on one driver: Baran's factors against the direct sum of closed forms, over all lights and maps.

use epipolar::driver::{SliceDriver, SliceIntegrator};
use epipolar::{Baran, DirectIntegrator, Options};
use proptest::prelude::*;
use scatter_core::{RayLight, ScatterImage};
use scatter_testing::{SliceCase, slice_cases};

use crate::judged::uniform;

/// A scene's image by an integrator, on even slices a pixel apart.
fn image<I: SliceIntegrator>(case: SliceCase, integrator: I) -> ScatterImage {
    let settings = uniform(1.0).slices();
    case.frame().with(|frame| {
        let mut out = ScatterImage::new();
        SliceDriver::new(integrator).render(frame, &settings, &mut out);
        out
    })
}

/// Rays whose unoccluded light is below this share of the brightest ray's are left out: a lamp's factors are fitted for all rays
/// of a band at once, and what reaches the eye through fourteen optical depths less is below their rounding.
const DIMMEST: f64 = 1e-6;

/// What a lamp's factors are asked for.
const FACTOR_ERROR: f64 = 2e-3;

/// What the factors may be off by, of the unoccluded radiance: a sun's eight terms are exact to the reading of their tables
/// (`Factors::bound`: 5e-4 for the worst visibility). A lamp's have no bound: they are not used where the error that is measured
/// on rays of eight lengths is above 4e-3, and rays between those lengths err more; film's level is what they must keep.
const MOST: [f64; 2] = [1e-3, 1e-2];

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn factors_find_what_the_direct_sum_finds(case in slice_cases()) {
        let film = Options { factor_error: FACTOR_ERROR, ..uniform(1.0) };
        let factored = image(case, Baran::new(film.sums()));
        let direct = image(case, DirectIntegrator::default());
        case.frame().with(|frame| {
            let most = MOST[usize::from(frame.light().position().is_some())];
            let width = frame.size()[0];
            let whole_of = |index: u32| {
                let (x, y) = (index % width, index / width);
                let ray = frame.camera().pixel_ray(x, y);
                let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
                light.interval(0.0, frame.ray_end(x, y)).to_array()
            };
            let brightest = (0..width * frame.size()[1]).flat_map(whole_of).fold(0.0, f64::max);
            for (index, (a, b)) in factored.inscattered().iter().zip(direct.inscattered()).enumerate() {
                let (x, y) = (index as u32 % width, index as u32 / width);
                let whole = whole_of(index as u32);
                for channel in 0..3 {
                    if whole[channel] < DIMMEST * brightest {
                        continue;
                    }
                    let off = f64::from((a[channel] - b[channel]).abs());
                    prop_assert!(off <= most * whole[channel] + 1e-30, "{case:?} {x} {y}: {a:?} {b:?} of {whole:?}");
                }
            }
            Ok(())
        })?;
    }
}
