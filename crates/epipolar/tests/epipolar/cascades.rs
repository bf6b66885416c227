//! Cascades however they lie: overlapping, nested, disjoint, turned against each other, of different sizes, all sixteen.
//!
//! A light ray in the wrong cascade, or in none, is an error that no number of slices mends; so what is asked for is that
//! the error against the exact walk falls as slices draw together.

use glam::DVec3;
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Light, MapProjection};
use scatter_testing::{MapKind, OwnedFrame, Random, Recipe, rel_rmse};

use crate::judged::{render, scene, truth, uniform};

/// Middle across the light, turn \[radians\], half extent and texels of a cascade.
type Cascade = ([f64; 2], f64, [f64; 2], [u32; 2]);

const OVERLAPPING: &[Cascade] = &[
    ([-0.8, 0.1], 0.0, [1.5, 1.2], [33, 21]),
    ([0.6, 0.4], 0.0, [1.6, 1.4], [24, 40]),
    ([0.1, -1.0], 0.0, [1.7, 1.1], [29, 29]),
];
const NESTED: &[Cascade] = &[
    ([0.1, 0.0], 0.0, [0.8, 0.7], [32, 24]),
    ([0.0, 0.1], 0.0, [1.7, 1.5], [40, 33]),
    ([0.0, 0.0], 0.0, [4.0, 3.5], [21, 27]),
];
/// The second holds the third, which decides about nothing.
const HIDDEN: &[Cascade] = &[
    ([0.1, 0.0], 0.0, [0.8, 0.7], [32, 24]),
    ([0.0, 0.0], 0.0, [4.0, 3.5], [31, 27]),
    ([0.0, 0.1], 0.0, [1.7, 1.5], [40, 33]),
];
const DISJOINT: &[Cascade] =
    &[([-1.3, 0.0], 0.0, [0.9, 1.4], [17, 31]), ([1.2, 0.3], 0.0, [1.0, 1.1], [40, 9])];
const TURNED: &[Cascade] = &[
    ([-0.4, 0.2], 0.3, [1.1, 0.8], [25, 33]),
    ([0.5, 0.0], 1.1, [1.6, 1.3], [37, 23]),
    ([0.0, 0.0], 2.4, [2.8, 2.9], [31, 35]),
];
const SIZES: &[Cascade] = &[
    ([0.0, 0.0], 0.0, [0.9, 0.9], [1, 1]),
    ([0.4, 0.0], 0.0, [1.8, 1.2], [64, 3]),
    ([0.0, 0.0], 0.2, [3.0, 3.0], [5, 48]),
];

fn arranged(seed: u64, cascades: &[Cascade]) -> OwnedFrame {
    let recipe = Recipe { size: [43, 29], map_side: 8, ..Recipe::of(MapKind::Cascades) };
    let mut frame = scene(seed, recipe);
    let Light::Directional(sun) = &frame.light else { panic!("cascades are a sun's") };
    let forward = sun.direction();
    let (x, y) = forward.any_orthonormal_pair();
    frame.projections = cascades
        .iter()
        .map(|&([aside, above], turn, half, size)| {
            let origin: DVec3 = recipe.centre + x * aside + y * above - forward * 4.0;
            let up = x * turn.sin() + y * turn.cos();
            MapProjection::orthographic(origin.into(), forward.into(), up.into(), half, size).unwrap()
        })
        .collect();
    let mut random = Random(seed);
    frame.texels = cascades
        .iter()
        .map(|(.., [width, height])| {
            // Blocks of three texels: walls between them, and none of them alone.
            let blocks: Vec<f32> = (0..(width / 3 + 1) * (height / 3 + 1))
                .map(|_| if random.below(4) == 0 { f32::INFINITY } else { random.range(0.5, 7.0) as f32 })
                .collect();
            let block = |i: u32, j: u32| blocks[(j / 3 * (width / 3 + 1) + i / 3) as usize];
            (0..*height).flat_map(|j| (0..*width).map(move |i| (i, j))).map(|(i, j)| block(i, j)).collect()
        })
        .collect();
    frame
}

#[test]
fn the_error_falls_with_the_distance_of_slices_however_cascades_lie() {
    /// As for one map: of first order between kinks at the worst, and walls that lie in a slice's plane are rare.
    const LEAST_SLOPE: f64 = 0.9;
    const SPACINGS: [f64; 3] = [1.0, 0.25, 0.0625];
    let sixteen: Vec<Cascade> = (0..16)
        .map(|index| {
            let place = [f64::from(index % 4) * 0.9 - 1.35, f64::from(index / 4) * 0.8 - 1.2];
            (place, 0.4 * f64::from(index), [0.7, 0.6], [7 + index as u32, 23 - index as u32])
        })
        .collect();
    let arrangements = [
        ("overlapping", OVERLAPPING),
        ("nested", NESTED),
        ("one hidden behind another", HIDDEN),
        ("disjoint", DISJOINT),
        ("turned against each other", TURNED),
        ("of one texel, a strip, a column", SIZES),
        ("sixteen", &sixteen),
    ];
    let mut slopes = Vec::new();
    for (name, cascades) in arrangements {
        for seed in [5, 6] {
            let frame = arranged(seed, cascades);
            let exact = truth(&frame);
            let errors = SPACINGS.map(|spacing| rel_rmse(&render(&frame, uniform(spacing)).0, &exact));
            let slope = (errors[0] / errors[2]).ln() / 16f64.ln();
            // What is lost if the order of the cascades is: how far the test would see it.
            let reversed = arranged_in_reverse(&frame).render(&mut ShadowMapWalk::new());
            let order = rel_rmse(&reversed, &exact);
            println!(
                "{name}: {:.5} {:.5} {:.5}, slope {slope:.2}; reversed {order:.4}",
                errors[0], errors[1], errors[2]
            );
            assert!(errors[2] < errors[0], "{name}: {errors:?}");
            assert!(
                name == "disjoint" || order > 10.0 * errors[2],
                "{name}: the order does not matter: {order}"
            );
            slopes.push(slope);
        }
    }
    let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
    println!("mean slope {mean:.2}");
    assert!(mean >= LEAST_SLOPE, "{slopes:?}");
}

fn arranged_in_reverse(frame: &OwnedFrame) -> OwnedFrame {
    let mut reversed = frame.clone();
    reversed.projections.reverse();
    reversed.texels.reverse();
    reversed
}
