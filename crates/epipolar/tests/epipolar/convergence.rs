//! The error against the exact walk falls with the distance of slices, and adaptive slices do better than even ones.

use scatter_core::RenderStats;

use crate::judged::{boards, rel_rmse, render, scene, truth, uniform};
use crate::random_scene::{MapKind, Recipe};

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

#[test]
fn halving_gaps_at_the_tolerance_of_a_game_beats_even_slices_of_the_same_number() {
    let scene = boards([321, 239]);
    let truth = truth(&scene);
    for tolerance in [0.03, 0.01] {
        let mut options = uniform(4.0);
        options.refinement.halvings = 4;
        options.refinement.tolerance = tolerance;
        let (image, stats) = render(&scene, options);
        let (adaptive, count) = (rel_rmse(&image, &truth), slices(&stats));
        // The coarsest even spacing with at least as many slices.
        let (even, even_count) = (0..40)
            .map(|step| render(&scene, uniform(4.0 * 0.9f64.powi(step))))
            .find(|(_, stats)| slices(stats) >= count)
            .map(|(image, stats)| (rel_rmse(&image, &truth), slices(&stats)))
            .unwrap();
        println!("tolerance {tolerance}: {count} slices {adaptive:.5}, {even_count} even ones {even:.5}");
        // Near the error that interpolation leaves everywhere, edges are no longer what matters: there adaptive slices
        // are shown beside even ones, no more.
        assert!(
            adaptive < even || tolerance < 0.03,
            "tolerance {tolerance}: {count} {adaptive} {even_count} {even}"
        );
    }
}
