//! The error against the exact walk falls with the distance of slices, and adaptive slices do better than even ones.

use scatter_core::{RenderStats, ScatterImage};
use scatter_testing::{MapKind, Recipe, boards, rel_rmse};

use crate::judged::{render, scene, truth, uniform};

fn slices(stats: &RenderStats) -> u64 {
    stats.counts.iter().find(|(name, _)| *name == "slices").map_or(0, |(_, count)| count)
}

#[test]
fn the_error_falls_with_the_distance_of_slices() {
    /// In-scattering is continuous across slices, with a kink where a slice passes a texel's corner: linear
    /// interpolation is of first order in the worst case and of second order between kinks. Walls of texels that lie
    /// in a slice's plane make jumps, of order one half; they are rare.
    const LEAST_SLOPE: f64 = 0.9;
    const SPACINGS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
    let recipe = |kind| Recipe { size: [43, 29], map_side: 40, ..Recipe::of(kind) };
    let scenes = [
        ("boards under a sun", boards([67, 45])),
        ("random sun", scene(5, recipe(MapKind::Orthographic))),
        ("random spot", scene(20, recipe(MapKind::Spot))),
        ("random lamp", scene(8, recipe(MapKind::Point))),
    ];
    let mut slopes = Vec::new();
    for (name, scene) in scenes {
        let truth = truth(&scene);
        let errors = SPACINGS.map(|spacing| rel_rmse(&render(&scene, uniform(spacing)).0, &truth));
        let slope = (errors[0] / errors[3]).ln() / 8f64.ln();
        println!(
            "{name}: {:.5} {:.5} {:.5} {:.5}, slope {slope:.2}",
            errors[0], errors[1], errors[2], errors[3]
        );
        for pair in errors.windows(2) {
            assert!(pair[1] < pair[0], "{name}: {errors:?}");
        }
        slopes.push(slope);
    }
    let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
    println!("mean slope {mean:.2}");
    assert!(mean >= LEAST_SLOPE, "{slopes:?}");
}

/// Pixels that are off by more than a share of their radiance, as a share of all; darker ones than a hundredth of the
/// mean count as that bright, as in MODEL.md's p99.
fn share_beyond(image: &ScatterImage, truth: &ScatterImage, tolerance: f64) -> f64 {
    let count = truth.inscattered().len() as f64;
    let mean = truth.inscattered().iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / count;
    let is_off = |(found, exact): (&[f32; 3], &[f32; 3])| {
        let exact = f64::from(exact[0]);
        (f64::from(found[0]) - exact).abs() > tolerance * exact.max(0.01 * mean)
    };
    image.inscattered().iter().zip(truth.inscattered()).filter(|&pair| is_off(pair)).count() as f64 / count
}

/// A gap is halved where its two slices differ by more than the tolerance, so what halving is for is pixels that are off
/// by more than it: with as many slices there are fewer of them than between even ones. (By RMS even slices win at fine
/// tolerances: most pixels lie where light changes smoothly, between slices that agree, and there the error falls with the
/// square of the distance.)
#[test]
fn halving_gaps_leaves_fewer_pixels_beyond_the_tolerance_than_even_slices_of_the_same_number() {
    let scene = boards([321, 239]);
    let truth = truth(&scene);
    for start in [4.0, 2.0] {
        for tolerance in [0.03, 0.01] {
            let mut options = uniform(start);
            options.refinement.halvings = 4;
            options.refinement.tolerance = tolerance as f32;
            let (image, stats) = render(&scene, options);
            let (adaptive, count) = (share_beyond(&image, &truth, tolerance), slices(&stats));
            // The coarsest even spacing with at least as many slices.
            let (even, even_image, even_count) = (0..40)
                .map(|step| render(&scene, uniform(start * 0.9f64.powi(step))))
                .find(|(_, stats)| slices(stats) >= count)
                .map(|(image, stats)| (share_beyond(&image, &truth, tolerance), image, slices(&stats)))
                .unwrap();
            let unrefined = share_beyond(&render(&scene, uniform(start)).0, &truth, tolerance);
            println!(
                "start {start} tolerance {tolerance}: {count} slices {adaptive:.5}, {even_count} even ones {even:.5}, unrefined {unrefined:.5}, rms {:.6} {:.6}",
                rel_rmse(&image, &truth),
                rel_rmse(&even_image, &truth)
            );
        }
    }
}
