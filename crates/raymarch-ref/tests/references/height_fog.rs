//! Height fog: the marcher against the exact walk, the core's walk against it, and both against their limits.

use raymarch_ref::{Distribution, Options, RayMarch, ShadowMapWalk};
use scatter_core::{HeightFalloff, ScatterImage};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, Recipe, rel_rmse};

use super::core_walk::compare;

/// A random scene whose medium is fog with its base near the eye: from far below a ray's length a scale height to far
/// beyond.
fn foggy(seed: u64, recipe: Recipe) -> OwnedFrame {
    let mut scene = OwnedFrame::random(seed, recipe);
    let mut random = Random(7000 + seed);
    let reach = if scene.max_distance.is_finite() { scene.max_distance } else { 10.0 };
    let scale = reach * 10f64.powf(random.range(-1.3, 2.0));
    let up = random.direction();
    let base = up.dot(scene.camera.eye()) + scale * random.range(-2.0, 2.0);
    let falloff = HeightFalloff::new(up.to_array(), base, scale).unwrap();
    scene.medium = scene.medium.with_height_falloff(falloff);
    scene
}

fn march(scene: &OwnedFrame, options: Options) -> ScatterImage {
    scene.render(&mut RayMarch::new(options).unwrap())
}

fn options(steps: u32) -> Options {
    Options { steps, jitter: None, distribution: Distribution::EquiAngular }
}

#[test]
fn an_unoccluded_sun_in_fog_is_exact_at_any_step_count() {
    for seed in 0..60 {
        let kind = if seed % 2 == 0 { MapKind::Cascades } else { MapKind::Orthographic };
        let scene = foggy(seed, Recipe::of(kind)).filled(Filling::Constant(1e30));
        let jitter = (seed % 3 == 0).then_some(3);
        let image = march(&scene, Options { jitter, ..options(1 + (seed as u32 * 37) % 900) });
        assert_eq!(image.inscattered(), scene.render(&mut ShadowMapWalk::new()).inscattered(), "seed {seed}");
    }
}

#[test]
fn the_march_in_fog_converges_to_the_walk() {
    for (distribution, jitter) in [
        (Distribution::EquiAngular, None),
        (Distribution::Uniform, None),
        (Distribution::EquiAngular, Some(7)),
    ] {
        let mut errors = Vec::new();
        for seed in 0..30u64 {
            let kind = MapKind::ALL[1 + seed as usize % 5];
            let recipe = Recipe { textured: seed % 4 == 3, size: [9, 7], ..Recipe::of(kind) };
            let scene = foggy(seed, recipe);
            let truth = scene.render(&mut ShadowMapWalk::new());
            let error = rel_rmse(&march(&scene, Options { steps: 16_384, jitter, distribution }), &truth);
            // A uniform medium's 1e-3 at 65,536 steps (`march_against_walk`), at a quarter of them: steps weigh as they do
            // there where the fog is even, and are spent on at most 21 scale heights where it is not.
            assert!(error < 4e-3, "seed {seed} {kind:?} {distribution} {jitter:?}: {error:e}");
            errors.push(error);
        }
        errors.sort_by(f64::total_cmp);
        let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
        println!(
            "{distribution}, jitter {jitter:?}: error at 16,384 steps {median:.1e}, at worst {worst:.1e}"
        );
        // Most scenes have light everywhere.
        assert!(median < 1e-3, "{median:e}");
    }
}

#[test]
fn an_unoccluded_lamp_in_fog_converges_to_rounding() {
    let mut worst = 0.0f64;
    for (kind, distribution) in [
        (MapKind::Point, Distribution::EquiAngular),
        (MapKind::Spot, Distribution::EquiAngular),
        (MapKind::Point, Distribution::Uniform),
    ] {
        for seed in 0..12 {
            let scene =
                foggy(seed, Recipe { size: [7, 5], ..Recipe::of(kind) }).filled(Filling::Constant(1e30));
            let truth = scene.render(&mut ShadowMapWalk::new());
            let error = |steps| rel_rmse(&march(&scene, Options { distribution, ..options(steps) }), &truth);
            let (coarse, fine) = (error(1024), error(8192));
            // An eighth of the step is a 64th of the error, but for the ends of f32 and of steep cones
            // (`march_against_walk`): ln ρ and optical depths of some tens add some tens of ulp.
            let rounding = if kind == MapKind::Spot { 3e-4 } else { 6e-5 };
            assert!(fine < coarse / 6.0 + rounding, "{kind:?} {distribution} {seed}: {coarse:e} {fine:e}");
            worst = worst.max(fine);
        }
    }
    println!("lamps in fog at 8192 steps: worst error {worst:.1e}");
}

#[test]
fn the_cores_walk_is_the_walk_in_fog_too() {
    let mut count = 0;
    for kind in MapKind::ALL {
        for seed in 0..8 {
            let recipe = Recipe { size: [7, 5], textured: seed % 3 == 0, ..Recipe::of(kind) };
            foggy(seed, recipe).with(|frame| count += compare(frame, &format!("fog, {kind:?} seed {seed}")));
        }
    }
    assert!(count > 6 * 8 * 35 / 4, "{count} stretches are too few to test anything");
}

#[test]
fn instruction_sets_differ_in_rounding_alone_in_fog() {
    for seed in 0..24 {
        let kind = MapKind::ALL[seed as usize % 6];
        let recipe = Recipe { textured: seed % 5 == 0, size: [9, 6], ..Recipe::of(kind) };
        let scene = foggy(seed, recipe);
        let fast = march(&scene, options(300));
        let portable = scene.render(&mut RayMarch::portable(options(300)).unwrap());
        assert_eq!(fast.transmittance(), portable.transmittance());
        let same = fast.inscattered().iter().zip(portable.inscattered()).filter(|(a, b)| {
            a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() <= 5e-5 * a.abs().max(b.abs()))
        });
        let same = same.count();
        // Samples at a texel's border may fall on either side.
        assert!(same * 10 >= fast.inscattered().len() * 7, "{same} of {}", fast.inscattered().len());
    }
}
