//! The extremes: nothing panics, nothing is NaN, and 0 ≤ L ≤ the unoccluded closed form.

use glam::DVec3;
use proptest::prelude::*;
use raymarch_ref::{Distribution, Options, RayMarch, ShadowMapWalk};
use scatter_core::{Camera, Light, Medium, Phase, ScatterImage, VolumetricShadow};
use scatter_testing::{MapKind, OwnedFrame, Recipe};

/// How much f32 sums may exceed the closed form: the walk rounds once, a sun's march is a share ≤ 1, a lamp's march
/// has no normalisation (512 steps of lobes with |g| = 0.99 at fov 170° miss by several percent).
fn overshoot(kind: MapKind, marched: bool) -> f32 {
    if marched && kind.is_lamp() { 0.5 } else { 1e-6 }
}

#[track_caller]
fn assert_sane(name: &str, scene: &OwnedFrame) {
    let whole = scene.unoccluded().render(&mut ShadowMapWalk::new());
    let march = |steps, distribution| RayMarch::new(Options { steps, distribution, jitter: None }).unwrap();
    let techniques: [(&str, Box<dyn VolumetricShadow>); 5] = [
        ("walk", Box::new(ShadowMapWalk::new())),
        ("1 step", Box::new(march(1, Distribution::EquiAngular))),
        ("512 steps", Box::new(march(512, Distribution::EquiAngular))),
        ("512 uniform steps", Box::new(march(512, Distribution::Uniform))),
        ("portable", Box::new(RayMarch::portable(Options { steps: 67, ..Options::default() }).unwrap())),
    ];
    for (method, mut technique) in techniques {
        let image: ScatterImage = scene.render(technique.as_mut());
        let resolved = method == "walk" || method == "512 steps";
        for (pixel, (value, limit)) in image.inscattered().iter().zip(whole.inscattered()).enumerate() {
            for channel in 0..3 {
                let (value, limit) = (value[channel], limit[channel]);
                let place = format!("{name}, {method}, pixel {pixel}: {value:e} of {limit:e}");
                assert!(value.is_finite() && value >= 0.0, "{place}");
                let bound = limit * (1.0 + overshoot(scene.kind, method != "walk")) + f32::MIN_POSITIVE;
                assert!(!resolved || value <= bound, "{place}");
            }
        }
        assert!(image.transmittance().iter().flatten().all(|t| (0.0..=1.0).contains(t)), "{name} {method}");
    }
}

fn medium(sigma: f64, g: f64) -> Medium {
    Medium::homogeneous([sigma, 0.5 * sigma, 0.0], [0.0, 0.0, 0.1 * sigma], Phase::HenyeyGreenstein { g })
        .unwrap()
}

#[test]
fn thin_and_thick_media_and_short_and_endless_rays() {
    for (n, kind) in MapKind::ALL.into_iter().enumerate() {
        for sigma in [1e-9, 1e-3, 1.0, 1e4] {
            for end in [0.0, 1e-6, 1.0, 1e6, f64::INFINITY] {
                for g in [-0.99, 0.0, 0.99] {
                    let mut scene = OwnedFrame::random(n as u64, Recipe { size: [3, 2], ..Recipe::of(kind) });
                    scene.medium = medium(sigma, g);
                    scene.max_distance = end;
                    scene.depth.fill(f32::INFINITY);
                    assert_sane(&format!("{kind:?} sigma {sigma} end {end} g {g}"), &scene);
                }
            }
        }
    }
}

#[test]
fn an_endless_vacuum_scatters_nothing() {
    for kind in MapKind::ALL {
        let mut scene = OwnedFrame::random(3, Recipe::of(kind));
        scene.medium = Medium::homogeneous([0.0; 3], [0.0; 3], Phase::Isotropic).unwrap();
        scene.max_distance = f64::INFINITY;
        for technique in [
            &mut ShadowMapWalk::new() as &mut dyn VolumetricShadow,
            &mut RayMarch::new(Options::default()).unwrap(),
        ] {
            let image = scene.render(technique);
            assert!(image.inscattered().iter().flatten().all(|&v| v == 0.0), "{kind:?} {}", technique.id());
        }
    }
}

#[test]
fn the_light_straight_ahead_and_behind_and_a_milliradian_off() {
    for kind in MapKind::ALL {
        for side in [1.0, -1.0] {
            for angle in [0.0, 1e-12, 1e-3] {
                let mut scene = OwnedFrame::random(11, Recipe { size: [3, 3], ..Recipe::of(kind) });
                let towards = match &scene.light {
                    Light::Directional(sun) => -sun.direction(),
                    lamp => (lamp.position().unwrap() - scene.camera.eye()).normalize(),
                };
                let off = towards.any_orthonormal_vector() * angle;
                let target = scene.camera.eye() + (towards + off) * side;
                scene.camera = Camera::perspective(
                    scene.camera.eye().into(),
                    target.into(),
                    [0.1, 0.9, 0.3],
                    60.0,
                    [3, 3],
                )
                .unwrap();
                assert_sane(&format!("{kind:?} {side} {angle}"), &scene);
            }
        }
    }
}

#[test]
fn narrow_wide_and_parallel_views_of_every_image_size() {
    for kind in MapKind::ALL {
        for size in [[1, 1], [1, 37], [37, 1], [33, 5]] {
            let base = OwnedFrame::random(5, Recipe { size, ..Recipe::of(kind) });
            let (eye, target) = (base.camera.eye().to_array(), [0.1, 0.2, -0.1]);
            let up = [0.1, 0.9, 0.3];
            for camera in [
                Camera::perspective(eye, target, up, 1.0, size),
                Camera::perspective(eye, target, up, 170.0, size),
                Camera::orthographic(eye, target, up, 50.0, size),
            ] {
                assert_sane(
                    &format!("{kind:?} {size:?}"),
                    &OwnedFrame { camera: camera.unwrap(), ..base.clone() },
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_stay_between_dark_and_unoccluded(
        seed: u64, kind in 0..6usize, far: bool, one_texel: bool, filling in 0..4usize
    ) {
        let centre = if far { DVec3::new(1e5, 3e4, -1e5) } else { DVec3::ZERO };
        let map_side = if one_texel { 1 } else { 40 };
        let recipe = Recipe { centre, map_side, ..Recipe::of(MapKind::ALL[kind]) };
        let mut scene = OwnedFrame::random(seed, recipe);
        for (projection, texels) in scene.projections.iter().zip(&mut scene.texels) {
            let width = projection.size()[0] as usize;
            for (index, depth) in texels.iter_mut().enumerate() {
                match filling {
                    0 => *depth = 0.0,
                    1 => *depth = f32::INFINITY,
                    2 => *depth = if (index % width + index / width).is_multiple_of(2) { 0.0 } else { f32::INFINITY },
                    _ => {}
                }
            }
        }
        assert_sane(&format!("seed {seed} {recipe:?} {filling}"), &scene);
    }

    #[test]
    fn one_more_surface_never_brightens_a_pixel(seed: u64, kind in 1..6usize) {
        let scene = OwnedFrame::random(seed, Recipe::of(MapKind::ALL[kind]));
        let mut darker = scene.clone();
        darker.texels.iter_mut().flatten().step_by(3).for_each(|depth| *depth = depth.min(1.0));
        for technique in
            [&mut ShadowMapWalk::new() as &mut dyn VolumetricShadow, &mut RayMarch::new(Options::default()).unwrap()]
        {
            let (before, after) = (scene.render(technique), darker.render(technique));
            for (b, a) in before.inscattered().iter().flatten().zip(after.inscattered().iter().flatten()) {
                // The walk joins its stretches differently; the march takes the closed form where no texel casts
                // a shadow, from which 1024 steps near a lamp differ.
                let tolerance = if technique.id() == "raymarch" { 1e-4 } else { 1e-6 };
                prop_assert!(*a <= *b * (1.0 + tolerance), "{}: {a} {b}", technique.id());
            }
        }
    }

    #[test]
    fn longer_rays_are_never_darker(seed: u64, kind in 0..6usize) {
        let mut scene = OwnedFrame::random(seed, Recipe::of(MapKind::ALL[kind]));
        scene.depth.fill(f32::INFINITY);
        let mut last = vec![0.0; 15 * 3];
        for end in [0.0, 0.3, 1.0, 2.5, 2.6, 7.0, 100.0] {
            scene.max_distance = end;
            let image = scene.render(&mut ShadowMapWalk::new());
            for (value, last) in image.inscattered().iter().flatten().zip(&mut last) {
                prop_assert!(*value >= *last * (1.0 - 1e-6));
                *last = *value;
            }
        }
    }
}
