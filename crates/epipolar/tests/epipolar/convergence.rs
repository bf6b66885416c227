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
/// by more than it, at edges; with as many slices there are fewer of them than between even ones. Between slices that
/// agree the error is that of the first distance, which therefore falls with the tolerance, as on the technique's ladder:
/// at 1 % from four pixels on, smooth parts alone leave a third of a percent of the pixels beyond it.
#[test]
fn halving_gaps_beats_even_slices_of_the_same_number_at_every_tolerance() {
    /// Even slices pass every edge at half their distance; halved gaps leave the edges' ends, which lie within one gap.
    /// A tenth is far from both: a hundredth was met.
    const MOST_OF_EVEN: f64 = 0.1;
    let scene = boards([321, 239]);
    let truth = truth(&scene);
    for (start, tolerance) in [(4.0, 0.03), (2.0, 0.01)] {
        let mut options = uniform(start);
        options.refinement.halvings = 4;
        options.refinement.tolerance = tolerance as f32;
        let (adaptive, stats) = render(&scene, options);
        let count = slices(&stats);
        // The coarsest even spacing with at least as many slices.
        let (even, even_count) = (0..40)
            .map(|step| render(&scene, uniform(start * 0.9f64.powi(step))))
            .map(|(image, stats)| (image, slices(&stats)))
            .find(|&(_, even_count)| even_count >= count)
            .unwrap();
        let unrefined = render(&scene, uniform(start)).0;
        let [off, even_off, unrefined_off] =
            [&adaptive, &even, &unrefined].map(|image| share_beyond(image, &truth, tolerance));
        let [rms, even_rms] = [&adaptive, &even].map(|image| rel_rmse(image, &truth));
        println!(
            "tolerance {tolerance} from {start} pixels on: {count} slices {rms:.5} ({off:.5} beyond), {even_count} even \
             ones {even_rms:.5} ({even_off:.5}), unrefined {unrefined_off:.5}"
        );
        assert!(rms < even_rms, "tolerance {tolerance}: RMS {rms} of {count}, {even_rms} of {even_count}");
        assert!(off <= MOST_OF_EVEN * even_off, "tolerance {tolerance}: {off} beyond it, {even_off}");
        // There is something to find, and it takes slices to find it.
        assert!(even_off > 1e-4 && unrefined_off > even_off, "tolerance {tolerance}: {unrefined_off}");
    }
}
