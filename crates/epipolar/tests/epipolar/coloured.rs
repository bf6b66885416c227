//! Coloured glass, coloured extinction and phase functions, against the exact walk and against formulas.

use std::f64::consts::PI;

use scatter_core::{Light, Medium, Phase, Scattering};
use scatter_testing::{MapKind, Recipe, boards, rel_rmse};

use crate::judged::{render, scene, truth, uniform};

/// What slices an eighth of a pixel apart may leave where light changes from texel to texel, and texels are as wide as
/// a pixel: an eighth of the contrast that a pixel's width makes, of which a random map has as much as its mean.
const FINE: f64 = 0.125;

#[test]
fn coloured_glass_colours_light_as_the_walk_does() {
    for kind in [MapKind::Orthographic, MapKind::Spot, MapKind::SpotCube, MapKind::Point] {
        for seed in 20..23 {
            let recipe = Recipe { size: [43, 29], textured: true, map_side: 20, ..Recipe::of(kind) };
            let scene = scene(seed, recipe);
            let truth = truth(&scene);
            let [coarse, fine] =
                [1.0, 0.125].map(|spacing| rel_rmse(&render(&scene, uniform(spacing)).0, &truth));
            println!("glass, {kind:?} {seed}: {coarse:.5} at 1, {fine:.5} at 1/8 pixel");
            assert!(fine < FINE && fine <= 0.5 * coarse, "{kind:?} {seed}: {coarse} {fine}");
        }
    }
}

#[test]
fn coloured_extinction_dims_each_channel_as_the_walk_does() {
    for kind in [MapKind::Orthographic, MapKind::Spot, MapKind::Point] {
        let mut scene = scene(31, Recipe { size: [43, 29], map_side: 20, ..Recipe::of(kind) });
        let component = |phase, sigma_s| Scattering { sigma_s, phase };
        scene.medium = Medium::new(
            vec![
                component(Phase::Rayleigh, [0.02, 0.05, 0.3]),
                component(Phase::HenyeyGreenstein { g: 0.6 }, [0.1, 0.05, 0.0]),
            ],
            [0.3, 0.0, 0.1],
        )
        .unwrap();
        let truth = truth(&scene);
        let error = rel_rmse(&render(&scene, uniform(0.125)).0, &truth);
        println!("coloured extinction, {kind:?}: {error:.5}");
        assert!(error < FINE, "{kind:?}: {error}");
    }
}

#[test]
fn a_suns_phase_function_multiplies_each_pixel_exactly() {
    let mut scene = boards([43, 29]);
    let isotropic = render(&scene, uniform(1.0)).0;
    let Light::Directional(sun) = scene.light.clone() else { unreachable!("a sun") };
    let (g, mut worst) = (0.7f64, 0.0f64);
    for (phase, p) in [
        (Phase::Rayleigh, &(|c: f64| 3.0 / (16.0 * PI) * (1.0 + c * c)) as &dyn Fn(f64) -> f64),
        (Phase::HenyeyGreenstein { g }, &|c: f64| {
            (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * c).powf(1.5))
        }),
    ] {
        scene.medium = Medium::homogeneous([0.08; 3], [0.01; 3], phase).unwrap();
        let image = render(&scene, uniform(1.0)).0;
        for (x, y) in (0..29).flat_map(|y| (0..43).map(move |x| (x, y))) {
            // Between the light's travel and the way to the camera.
            let cos_theta = sun.direction().dot(-scene.camera.pixel_ray(x, y).direction);
            for channel in 0..3 {
                let expected = f64::from(isotropic.at(x, y)[channel]) * 4.0 * PI * p(cos_theta);
                let off = (f64::from(image.at(x, y)[channel]) - expected).abs() / expected.max(1e-30);
                worst = worst.max(off);
            }
        }
    }
    println!("largest deviation of a phase function: {worst:.1e}");
    // A dozen f32 operations, a power of 3/2 among them.
    assert!(worst < 12.0 * f64::from(f32::EPSILON), "{worst}");
}
