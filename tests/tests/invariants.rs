//! The invariants of the model as properties of random worlds, for both references, the marcher and
//! epipolar integration.
//!
//! Tolerances. The references are f64 but write f32 pixels and read f32 depths: 2⁻²³ of a pixel, and for the end of
//! the ray 2⁻²⁴ of its length, which at most doubles that. `ROUNDING` allows ten times as much, of the pixel's
//! unoccluded value (a spot's: without its cone). The marcher works in f32: `MARCHER` allows for 2,048 additions of rounded weights.

use proptest::prelude::*;
use scatter::TECHNIQUES;
use scatter_core::{Quality, ScatterImage, Target};
use scatter_tests::{Method, World, WorldLight};

const ROUNDING: f64 = 2e-6;
const MARCHER: f64 = 1e-4;
/// Twice what the closed form of a lamp in f32 promises, in core: 2.3e-5 was met. A sun's is a dozen roundings.
const EPIPOLAR_LIT: f64 = 4e-5;
/// Between two faces of a cube light rays as wide as f32 rounds may belong to none: three borders of a few ulps, 1e-7
/// each, and ten times the mean light where a lamp's is densest.
const EPIPOLAR_FACES: f64 = 2e-5;
/// The tables of eight terms are interpolated linearly in f32; a changed view changes where.
const EPIPOLAR_FACTORS: f64 = 1e-4;
/// Two view rays an eighth of a pixel of 75°/9 apart, in radians: how differently they weigh a lamp's light.
const EPIPOLAR_LAMP: f64 = 2e-2;
/// A product of f32 factors of which the light's strength is one, three times, and a sum: a few roundings of 6e-8 each.
/// A lamp's closed form is rounded as a whole before it.
const PRODUCTS: f64 = 1e-6;
const EXACT: [Method; 2] = [Method::RaycastTruth, Method::ShadowMapWalk];
const ALL: [Method; 4] =
    [Method::RaycastTruth, Method::ShadowMapWalk, Method::RayMarch(32), Method::Epipolar];

fn tolerance(method: Method) -> f64 {
    match method {
        Method::RaycastTruth | Method::ShadowMapWalk => ROUNDING,
        Method::RayMarch(_) => MARCHER,
        Method::Epipolar => EPIPOLAR_FACTORS,
    }
}

fn cases(count: u32) -> ProptestConfig {
    // Failures shrink for long; the worlds are small enough to read as they are.
    ProptestConfig {
        cases: count,
        max_shrink_iters: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// How many pixel-channels of `image` differ from `expected` by more than `tolerance` of `scale`.
fn differing(
    image: &ScatterImage,
    expected: impl Fn(usize) -> [f64; 3],
    scale: &[[f64; 3]],
    tolerance: f64,
) -> usize {
    let pixels = image.inscattered();
    (0..pixels.len())
        .flat_map(|n| (0..3).map(move |c| (n, c)))
        .filter(|&(n, c)| {
            !((f64::from(pixels[n][c]) - expected(n)[c]).abs() <= tolerance * scale[n][c] + 1e-30)
        })
        .count()
}

fn at(image: &ScatterImage) -> impl Fn(usize) -> [f64; 3] + '_ {
    |n| image.inscattered()[n].map(f64::from)
}

/// Where triangles decide visibility, a motion's rounding may carry a pixel's ray over a triangle's edge: its first
/// hit is then another surface. Two channels-triples in 63 pixels allow for two such rays.
fn flips(method: Method) -> usize {
    if method == Method::RaycastTruth { 6 } else { 0 }
}

proptest! {
    #![proptest_config(cases(64))]

    /// 1. `0 ≤ L ≤` the unoccluded closed form.
    #[test]
    fn radiance_lies_between_darkness_and_the_unoccluded_value(world in World::any(12)) {
        let (bound, scale) = (world.unoccluded(), world.scale_of_rounding());
        // Near a lamp a marcher's error falls with the square of its steps: 32 were seen to overshoot by 6 %,
        // 256 leave a sixty-fourth of that.
        for method in [Method::RaycastTruth, Method::ShadowMapWalk, Method::RayMarch(256), Method::Epipolar] {
            let image = world.render(method);
            for (n, pixel) in image.inscattered().iter().enumerate() {
                for c in 0..3 {
                    let (value, bound) = (pixel[c], bound[n][c]);
                    let slack = lit_slack(method, &world);
                    prop_assert!(value >= 0.0 && f64::from(value) <= bound + slack * scale[n][c] + 1e-30, "{method:?}: {value} {bound}");
                }
            }
        }
    }

    /// 2. All light gives the closed form; none gives nothing.
    #[test]
    fn full_visibility_gives_the_closed_form_and_none_gives_zero(world in World::any(6)) {
        let (bound, scale) = (world.unoccluded(), world.scale_of_rounding());
        for method in [Method::ShadowMapWalk, Method::RayMarch(256), Method::Epipolar] {
            let slack = lit_slack(method, &world);
            let lit = world.clone().with_shadow(f32::INFINITY).render(method);
            let off = (0..bound.len())
                .flat_map(|n| (0..3).map(move |c| (n, c)))
                .map(|(n, c)| (at(&lit)(n)[c] - bound[n][c]).abs() / scale[n][c].max(1e-30))
                .fold(0.0, f64::max);
            prop_assert!(off <= slack, "{method:?}: {off:e} of the light");
            // Depth 0 lies before everything in a sun's map and at the lamp itself in the others. The sun's map
            // starts before the world; what lies outside of it is lit by definition, so the world stays inside.
            if world.max_distance < 4.0 || !matches!(world.light, WorldLight::Sun(_)) {
                let dark = world.clone().with_shadow(0.0).render(method);
                let none = if method == Method::Epipolar { EPIPOLAR_FACES } else { 0.0 };
                for (n, (pixel, scale)) in dark.inscattered().iter().zip(&scale).enumerate() {
                    for c in 0..3 {
                        let share = f64::from(pixel[c]) / scale[c].max(1e-30);
                        prop_assert!(share <= none, "{method:?}, pixel {n}: {share:e} of the light");
                    }
                }
            }
        }
    }

    /// 3. Linear in the light's strength, and in σs where σt is held.
    #[test]
    fn radiance_is_linear_in_strength_and_in_scattering(world in World::any(12), factor in 0.01..100.0f64) {
        for method in ALL {
            let image = world.render(method);
            let scale = world.scale_of_rounding();
            let mut stronger = world.clone();
            stronger.strength = stronger.strength.map(|s| s * factor);
            let strong = stronger.render(method);
            let larger: Vec<[f64; 3]> = scale.iter().map(|p| p.map(|v| v * factor)).collect();
            let expected = |n: usize| at(&image)(n).map(|v| v * factor);
            prop_assert_eq!(differing(&strong, expected, &larger, tolerance(method)), 0, "{:?}", method);

            let mut thinner = world.clone();
            for c in 0..3 {
                let sigma_s: f64 = world.components.iter().map(|part| part.sigma_s[c]).sum();
                thinner.sigma_a[c] += 0.5 * sigma_s;
            }
            thinner.components.iter_mut().for_each(|part| part.sigma_s = part.sigma_s.map(|s| 0.5 * s));
            let thin = thinner.render(method);
            let expected = |n: usize| at(&image)(n).map(|v| 0.5 * v);
            prop_assert_eq!(differing(&thin, expected, &scale, tolerance(method)), 0, "{:?}", method);
        }
    }

    /// 3b. Two lights in the same place add up: what is found of the map does not depend on the light's strength. By
    /// every technique's presets and error targets, whatever they choose for the frame.
    #[test]
    fn the_images_of_two_lights_in_one_place_add_up(world in World::any(12), other in [0.0..50.0f64, 0.0..50.0, 0.0..50.0]) {
        let scale = world.scale_of_rounding();
        let with = |strength: [f64; 3]| {
            let mut world = world.clone();
            world.strength = strength;
            world
        };
        let both: [f64; 3] = std::array::from_fn(|c| world.strength[c] + other[c]);
        // The same in units of a light that is as strong as both.
        let scale: Vec<[f64; 3]> =
            scale.iter().map(|p| std::array::from_fn(|c| p[c] / world.strength[c] * both[c])).collect();
        for technique in TECHNIQUES {
            for target in [Target::Quality(Quality::Preview), Target::Quality(Quality::Game), Target::Error(0.02)] {
                let Some(mut sum) = world.render_by(*technique, target) else { continue };
                sum.add(&with(other).render_by(*technique, target).unwrap()).unwrap();
                let image = with(both).render_by(*technique, target).unwrap();
                let tolerance = if technique.info().id == "epipolar" { PRODUCTS } else { MARCHER };
                let found = differing(&image, at(&sum), &scale, tolerance);
                prop_assert_eq!(found, 0, "{} {:?}", technique.info().id, target);
            }
        }
    }

    /// 4. Lengths times k with σ / k: a sun's image stays, a lamp's with I·k² too.
    #[test]
    fn lengths_and_extinction_scale_against_each_other(world in World::any(12), exponent in -4i32..5) {
        // A power of two, so that scaled f32 depths are the same depths.
        let k = 2f64.powi(3 * exponent);
        for method in ALL {
            let image = world.render(method);
            let mut scaled = world.clone();
            scaled.scale = k;
            scaled.components.iter_mut().for_each(|part| part.sigma_s = part.sigma_s.map(|s| s / k));
            scaled.sigma_a = scaled.sigma_a.map(|s| s / k);
            if !matches!(world.light, WorldLight::Sun(_)) {
                scaled.strength = scaled.strength.map(|s| s * k * k);
            }
            let expected = at(&image);
            let found = differing(&scaled.render(method), expected, &world.scale_of_rounding(), tolerance(method));
            prop_assert!(found <= flips(method), "{method:?}: {found}");
        }
    }

    /// 5. A rigid motion leaves the image; a reflection reflects it.
    #[test]
    fn motions_leave_the_image_and_mirrors_mirror_it(
        world in World::any(12),
        axis in [-1.0..1.0f64, -1.0..1.0, 0.1..1.0],
        angle in 0.0..6.0f64,
        shift in [-1e4..1e4f64, -1e4..1e4, -1e4..1e4],
    ) {
        for method in ALL {
            let image = world.render(method);
            let scale = world.scale_of_rounding();
            let bound_to_axes = world.has_cube_map() && method != Method::RaycastTruth;
            let mut moved = world.clone();
            let rotation = glam::DQuat::from_axis_angle(glam::DVec3::from(axis).normalize(), angle);
            let rotation = if bound_to_axes { glam::DQuat::IDENTITY } else { rotation };
            moved.motion = glam::DAffine3::from_rotation_translation(rotation, shift.into());
            let found = differing(&moved.render(method), at(&image), &scale, moved_tolerance(method));
            prop_assert!(found <= flips(method), "{method:?} moved: {found}");

            if bound_to_axes {
                continue;
            }
            let width = world.size[0] as usize;
            let reflected = |n: usize| n / width * width + (width - 1 - n % width);
            let mirrored = world.clone().mirrored().render(method);
            let expected = |n: usize| at(&image)(reflected(n));
            let scale: Vec<[f64; 3]> = (0..scale.len()).map(|n| scale[reflected(n)]).collect();
            let found = differing(&mirrored, expected, &scale, moved_tolerance(method));
            prop_assert!(found <= flips(method), "{method:?} mirrored: {found}");
        }
    }

    /// 6. One more occluder never makes a pixel brighter, the map's frame held fixed.
    #[test]
    fn an_occluder_never_brightens(world in World::any(8), more in World::any(4)) {
        let mut shaded = world.clone();
        shaded.triangles.extend(more.triangles);
        // The view is held fixed too: an occluder in front of the camera shortens rays, which only darkens.
        let shaded = shaded.with_maps();
        let scale = world.scale_of_rounding();
        for method in [Method::RaycastTruth, Method::ShadowMapWalk, Method::Epipolar] {
            let (before, after) = (world.render(method), shaded.render(method));
            for (n, (a, b)) in before.inscattered().iter().zip(after.inscattered()).enumerate() {
                for c in 0..3 {
                    let slack = (darkening_slack(method, &world) * scale[n][c]) as f32 + 1e-30;
                    prop_assert!(b[c] <= a[c] + slack, "{method:?} pixel {n}: {} became {}", a[c], b[c]);
                }
            }
        }
    }

    /// 7. `L(0, D)` is non-decreasing in D.
    #[test]
    fn radiance_grows_with_the_ray(world in World::any(12), share in 0.0..1.0f64) {
        let mut shorter = world.clone();
        shorter.max_distance *= share;
        let scale = world.scale_of_rounding();
        for method in EXACT {
            let (near, far) = (shorter.render(method), world.render(method));
            for (n, (a, b)) in near.inscattered().iter().zip(far.inscattered()).enumerate() {
                for c in 0..3 {
                    let slack = (ROUNDING * scale[n][c]) as f32 + 1e-30;
                    prop_assert!(b[c] >= a[c] - slack, "{method:?} pixel {n}");
                }
            }
        }
    }
}

/// A world 10⁴ units from the origin has coordinates good to 2e-12, over distances of about 1: nothing beside f32. The
/// marcher's nearest texel may then be the neighbour: one sample of 32.
fn moved_tolerance(method: Method) -> f64 {
    match method {
        Method::RaycastTruth | Method::ShadowMapWalk => ROUNDING,
        Method::RayMarch(steps) => 2.0 / f64::from(steps),
        Method::Epipolar => EPIPOLAR_FACTORS,
    }
}

/// How far above the closed form a lit pixel may be. Epipolar integration multiplies the closed form, in f32, by a share
/// that is at most 1, and exactly 1 where nothing shadows: interpolation never overshoots.
fn lit_slack(method: Method, world: &World) -> f64 {
    match method {
        Method::RaycastTruth | Method::ShadowMapWalk => ROUNDING,
        Method::RayMarch(_) => lamp_slack(world),
        Method::Epipolar => EPIPOLAR_LIT,
    }
}

/// How much brighter an occluder may make a pixel. A share is a quotient of sums with the same weights; those of eight
/// terms may be below 0 by the error of the factorisation. Under a lamp a slice's light rays are weighted by the
/// angle of its own view ray, an eighth of a pixel from the pixel's.
fn darkening_slack(method: Method, world: &World) -> f64 {
    match (method, world.light) {
        (Method::Epipolar, WorldLight::Sun(_)) => EPIPOLAR_FACTORS,
        (Method::Epipolar, _) => EPIPOLAR_LAMP,
        _ => ROUNDING,
    }
}

/// How far a lit marcher may be from the closed form: a sun's steps are exact, a lamp's follow the phase function and
/// the cone by midpoints.
fn lamp_slack(world: &World) -> f64 {
    match world.light {
        WorldLight::Sun(_) => MARCHER,
        WorldLight::Point(_) | WorldLight::Spot(..) => 0.05,
    }
}
