//! The marcher against shadow-map truth, against closed forms, and against itself on other instruction sets.

use proptest::prelude::*;
use raymarch_ref::{Distribution, Options, RayMarch, ShadowMapWalk};
use scatter_core::{Camera, ScatterImage};
use scatter_testing::{Filling, MapKind, OwnedFrame, Recipe, largest_difference, rel_rmse};

fn options(steps: u32) -> Options {
    Options { steps, jitter: None, distribution: Distribution::EquiAngular }
}

fn march(scene: &OwnedFrame, options: Options) -> ScatterImage {
    scene.render(&mut RayMarch::new(options).unwrap())
}

/// Least-squares slope of ln(error) over ln(steps).
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let covariance: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    covariance / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

#[test]
fn the_march_converges_to_the_walk() {
    /// Steps of the sweep; at the finest the march must equal the walk.
    const STEPS: [u32; 6] = [64, 256, 1024, 4096, 16_384, 65_536];
    /// Issue 2: "equals it to 1e-3 at the finest", "slope ≥ 0.9 on average".
    const FINEST: f64 = 1e-3;
    const LEAST_SLOPE: f64 = 0.9;
    for (distribution, jitter) in [
        (Distribution::EquiAngular, None),
        (Distribution::Uniform, None),
        (Distribution::EquiAngular, Some(7)),
    ] {
        let mut slopes = Vec::new();
        let mut worst = 0.0f64;
        for seed in 0..36u64 {
            let kind = MapKind::ALL[1 + seed as usize % 5];
            let textured = seed % 4 == 3;
            let scene = OwnedFrame::random(seed, Recipe { textured, size: [13, 9], ..Recipe::of(kind) });
            let truth = scene.render(&mut ShadowMapWalk::new());
            let points: Vec<_> = STEPS
                .iter()
                .map(|&steps| {
                    let image = march(&scene, Options { steps, jitter, distribution });
                    (f64::from(steps).ln(), rel_rmse(&image, &truth).max(1e-12).ln())
                })
                .collect();
            let finest = points[points.len() - 1].1.exp();
            worst = worst.max(finest);
            assert!(finest < FINEST, "seed {seed} {kind:?} {distribution} {jitter:?}: {finest:e}");
            // Beyond 4096 steps f32 positions begin to show; the slope is that of the march before.
            slopes.push(-slope(&points[..4]));
        }
        let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
        println!(
            "{distribution}, jitter {jitter:?}: mean slope {mean:.2}, worst error at 65536 steps {worst:.1e}"
        );
        assert!(mean >= LEAST_SLOPE, "{distribution}: {slopes:?}");
    }
}

/// Surfaces that are too far away to shadow anything.
const FAR: Filling = Filling::Constant(1e30);

/// Surfaces at the light.
const NEAR: Filling = Filling::Constant(0.0);

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn an_unoccluded_sun_is_exact_at_any_step_count(seed: u64, cascades: bool, steps in 1u32..3000, jitter: bool) {
        let kind = if cascades { MapKind::Cascades } else { MapKind::Orthographic };
        let scene = OwnedFrame::random(seed, Recipe::of(kind)).filled(FAR);
        let image = march(&scene, Options { jitter: jitter.then_some(3), ..options(steps) });
        let truth = scene.render(&mut ShadowMapWalk::new());
        prop_assert_eq!(image, truth);
    }

    #[test]
    fn where_light_never_comes_there_is_nothing(seed: u64, cube: bool, steps in 1u32..300) {
        let kind = if cube { MapKind::SpotCube } else { MapKind::Point };
        let scene = OwnedFrame::random(seed, Recipe::of(kind)).filled(NEAR);
        let image = march(&scene, options(steps));
        prop_assert!(image.inscattered().iter().flatten().all(|&value| value == 0.0));
    }

    #[test]
    fn instruction_sets_differ_in_rounding_alone(seed: u64, kind in 0..6usize, textured: bool, steps in 1u32..600) {
        // A sample at a texel's border may fall on either side: one step of the ray, and a few of them.
        let one_step = 4.0 / f64::from(steps) + 1e-5;
        let scene = OwnedFrame::random(seed, Recipe { textured, size: [9, 6], ..Recipe::of(MapKind::ALL[kind]) });
        let fast = march(&scene, options(steps));
        let portable = scene.render(&mut RayMarch::portable(options(steps)).unwrap());
        prop_assert_eq!(fast.transmittance(), portable.transmittance());
        prop_assert!(largest_difference(&fast, &portable) < one_step);
        let same = fast.inscattered().iter().zip(portable.inscattered()).filter(|(a, b)| {
            a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() <= 2e-5 * a.abs().max(b.abs()))
        }).count();
        // Border cases are rare: most pixels agree to rounding.
        prop_assert!(same * 10 >= fast.inscattered().len() * 7, "{} of {}", same, fast.inscattered().len());
    }
}

#[test]
fn an_unoccluded_lamp_converges_with_the_square_of_the_step() {
    // Where f32 sums end, and where a cone does: cosines are known to 6e-8, and a cone whose angles coincide is
    // 1000 times as steep and squared.
    let rounding = |kind| if kind == MapKind::Spot { 2.5e-4 } else { 3e-5 };
    for (kind, distribution) in [
        (MapKind::Point, Distribution::EquiAngular),
        (MapKind::Spot, Distribution::EquiAngular),
        (MapKind::Point, Distribution::Uniform),
    ] {
        for seed in 0..20 {
            let scene = OwnedFrame::random(seed, Recipe::of(kind)).filled(FAR);
            let truth = scene.render(&mut ShadowMapWalk::new());
            let error = |steps| rel_rmse(&march(&scene, Options { distribution, ..options(steps) }), &truth);
            let (coarse, fine) = (error(512), error(2048));
            // A quarter of the step is a sixteenth of the error; a cone's kinks are of second order too. Lobes that
            // 512 uniform steps do not resolve converge slower.
            let rate = if distribution == Distribution::Uniform { 3.0 } else { 8.0 };
            assert!(
                fine < coarse / rate + rounding(kind),
                "{kind:?} {distribution} {seed}: {coarse:e} {fine:e}"
            );
        }
    }
}

#[test]
fn a_ray_that_leads_straight_away_from_a_lamp_keeps_its_digits() {
    for seed in 0..30 {
        let mut scene = OwnedFrame::random(seed, Recipe { size: [3, 3], ..Recipe::of(MapKind::Point) });
        let (eye, lamp) = (scene.camera.eye(), scene.light.position().unwrap());
        let target = eye + (eye - lamp);
        scene.camera = Camera::perspective(eye.into(), target.into(), [0.1, 0.9, 0.3], 50.0, [3, 3]).unwrap();
        scene.depth.fill(f32::INFINITY);
        let truth = scene.render(&mut ShadowMapWalk::new());
        let whole = scene.unoccluded().render(&mut ShadowMapWalk::new()).at(1, 1);
        let image = march(&scene, options(16_384));
        for c in 0..3 {
            // The middle pixel's ray lies on the lamp's: it passes at the least distance the model has, 1e-6 of the
            // eye's. One texel decides for all of it, so that it has one edge, of a step.
            let off = (image.at(1, 1)[c] - truth.at(1, 1)[c]).abs();
            assert!(
                off <= 1e-3 * whole[c],
                "seed {seed}: {:?} {:?} of {whole:?}",
                image.at(1, 1),
                truth.at(1, 1)
            );
        }
    }
}
