//! Whole frames: what is certified keeps its tolerance against the exact integral of the same rows, under every light and in every
//! medium; and what is filtered is not everything that is integrated exactly.

use std::cell::RefCell;

use epipolar::DirectIntegrator;
use epipolar::driver::{SliceDriver, SliceSettings};
use filtered_prefix::{DepthRange, Depths, Filter, FilteredPrefix, Options};
use proptest::test_runner::{Config, TestRunner};
use scatter_core::{Frame, HeightFalloff, RayLight, RenderStats, ScatterImage, VolumetricShadow};
use scatter_testing::{Filling, MapKind, OwnedFrame, SliceCase, coloured_medium, slice_cases};

/// Slices half a pixel apart, not halved, rows not simplified: the driver does the same whatever sums the slices.
fn settings(tolerance: f64, absolute: bool, filter: Filter) -> Options {
    let even = SliceSettings::even(0.5);
    Options {
        tolerance,
        absolute,
        filter,
        uncut_columns: 0.0,
        spacing: even.spacing,
        fewest_slices: even.fewest_slices,
        target: None,
        refinement: even.refinement,
        shared_columns: 0,
        ..Options::default()
    }
}

fn rendered(frame: &Frame<'_>, options: Options) -> (ScatterImage, RenderStats) {
    let mut image = ScatterImage::new();
    let stats = FilteredPrefix::new(options).render(frame, &mut image).unwrap();
    (image, stats)
}

fn direct(frame: &Frame<'_>) -> ScatterImage {
    let mut image = ScatterImage::new();
    SliceDriver::new(DirectIntegrator::default()).render(frame, &SliceSettings::even(0.5), &mut image);
    image
}

/// Each pixel's unoccluded radiance, by its channels.
fn unoccluded(frame: &Frame<'_>) -> Vec<[f64; 3]> {
    let [width, height] = frame.size();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    pixels
        .map(|[x, y]| {
            let ray = frame.camera().pixel_ray(x, y);
            let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
            light.interval(0.0, frame.ray_end(x, y)).to_array()
        })
        .collect()
}

/// What f32 adds to a share: rows of both are the same bits, sums and closed forms are not. Dense fog loses digits in differences
/// of transmittances, grazing lamps in their closed form.
const ROUNDING: f64 = 4e-4;

/// What was found over all frames.
#[derive(Default)]
struct Found {
    filtered: u64,
    exact: u64,
    uniform: u64,
    /// Largest error over what was allowed, and where.
    worst: f64,
    place: String,
}

impl Found {
    fn print(&self) {
        let Self { filtered, exact, uniform, worst, place } = self;
        println!(
            "{filtered} filtered, {exact} exact, {uniform} uniform; at most {worst:.3} of what is allowed: {place}"
        );
    }
}

fn check(frame: &OwnedFrame, options: Options, found: &mut Found) {
    let Options { tolerance, absolute, .. } = options;
    frame.with(|frame| {
        let exact = direct(frame);
        let (image, stats) = rendered(frame, options);
        let whole = unoccluded(frame);
        let brightest = frame.texture().map_or(1.0, |texture| {
            texture.texels().iter().flatten().fold(1.0f32, |most, &colour| most.max(colour))
        });
        for (pixel, whole) in whole.iter().enumerate() {
            for (channel, &whole) in whole.iter().enumerate() {
                let (test, exact) =
                    (image.inscattered()[pixel][channel], exact.inscattered()[pixel][channel]);
                let (test, exact) = (f64::from(test), f64::from(exact));
                let allowed = tolerance * if absolute { whole } else { exact }
                    + ROUNDING * f64::from(brightest) * whole
                    + 1e-30;
                let part = (test - exact).abs() / allowed;
                if part > found.worst || part.is_nan() {
                    found.worst = if part.is_nan() { f64::INFINITY } else { part };
                    let share = [test / whole, exact / whole];
                    found.place = format!(
                        "{:?} {tolerance} {absolute}, pixel {pixel}, channel {channel}: shares {share:?}",
                        frame.light()
                    );
                }
            }
        }
        let count = |name| stats.counts.get(name).unwrap_or(0);
        found.filtered += count("filtered queries");
        found.exact += count("exact queries");
        found.uniform += count("uniform queries");
    });
}

fn try_cases(cases: u32, seed: u64, change: impl Fn(&SliceCase, OwnedFrame) -> OwnedFrame) -> Found {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new(config);
    let found = RefCell::new(Found::default());
    let tolerances = [0.2, 0.05, 0.01, 0.001];
    runner
        .run(&slice_cases(), |case| {
            let frame = change(&case, case.frame_of([11, 7], Some([33, 64])));
            let which = (case.seed ^ seed) % 8;
            let tolerance = tolerances[(which % 4) as usize];
            // By the way of every slice's own choice, and by filters wherever they suffice.
            let filter = if case.seed % 3 == 0 { Filter::Auto } else { Filter::Always };
            check(&frame, settings(tolerance, which > 3, filter), &mut found.borrow_mut());
            Ok(())
        })
        .unwrap();
    let found = found.into_inner();
    found.print();
    found
}

#[test]
fn certified_frames_keep_their_tolerance_under_every_light() {
    let found = try_cases(200, 1, |_, frame| frame);
    assert!(found.worst < 1.0);
    assert!(found.filtered > 500 && found.exact > 500 && found.uniform > 500);
}

#[test]
fn certified_frames_keep_their_tolerance_in_height_fog() {
    let found = try_cases(120, 2, |case, mut frame| {
        if frame.light.position().is_none() {
            let scale = 0.5 + (case.seed % 7) as f64;
            let falloff = HeightFalloff::new([0.2, 1.0, 0.1], 0.3, scale).unwrap();
            frame.medium = frame.medium.with_height_falloff(falloff);
        }
        frame
    });
    assert!(found.worst < 1.0);
    assert!(found.filtered > 200 && found.exact > 500);
}

#[test]
fn certified_frames_keep_their_tolerance_through_coloured_glass() {
    let mut found = Found::default();
    for kind in MapKind::ALL {
        for (seed, tolerance) in [(1, 0.2), (2, 0.05), (3, 0.005)] {
            let stock = OwnedFrame::stock(kind, [23, 15], 40, Filling::Random { seed, far: 9.0 });
            let mut frame = stock.with_glass();
            if seed == 2 {
                frame.medium = coloured_medium();
            }
            for filter in [Filter::Auto, Filter::Always] {
                check(&frame, settings(tolerance, seed == 1, filter), &mut found);
            }
        }
    }
    found.print();
    assert!(found.worst < 1.0);
    assert!(found.filtered > 100 && found.exact > 100);
}

#[test]
fn certified_frames_keep_their_tolerance_by_any_measure_of_depth() {
    let mut found = Found::default();
    for kind in MapKind::ALL {
        for (depths, tolerance) in
            [(Depths::Places, 0.05), (Depths::Angles, 0.2), (Depths::Tangents, 0.05), (Depths::Warp, 0.005)]
        {
            for depth_range in [DepthRange::Band, DepthRange::Slice] {
                let stock = OwnedFrame::stock(kind, [23, 15], 40, Filling::Random { seed: 4, far: 9.0 });
                let options = settings(tolerance, depth_range == DepthRange::Band, Filter::Always);
                check(&stock, Options { depths, depth_range, ..options }, &mut found);
            }
        }
    }
    found.print();
    assert!(found.worst < 1.0);
    assert!(found.filtered > 100 && found.exact > 100);
}
