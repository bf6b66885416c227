//! The invariants of the model as properties of random worlds, for both references and every technique of `TECHNIQUES`.
//!
//! Tolerances. Each technique declares how far its result moves where mathematics says that it does not, with the
//! settings for it and a derivation (`Rounding`); the references are held to that of f64. Shares are of a pixel's
//! unoccluded value, a spot's without its cone: where a ray grazes a cone, its own value can be as small as one likes
//! while its ends are rounded all the same. What order there is between two images (an occluder darkens, a longer ray
//! does not) is held to what techniques promise of either.
//!
//! A frame that a technique refuses proves nothing; refusals are counted, and who refuses everything fails.

use proptest::prelude::*;
use scatter::{Quality, Rounding, Target};
use scatter_testing::{Comparison, differing, exceeding, values};
use scatter_tests::{Method, World, WorldLight, for_all};

/// Images as numbers, `[y][x]`.
type Values = Vec<[f64; 3]>;

fn times(values: &[[f64; 3]], factor: f64) -> Values {
    values.iter().map(|pixel| pixel.map(|value| value * factor)).collect()
}

/// What techniques promise in the properties of order: |T − R| ≤ this times the unoccluded value, for the exact R.
const PROMISE: f64 = 0.01;

/// How much an image may break the order that exact ones keep: the references by rounding, a technique by its promise
/// at either of the two images.
fn order_slack(method: Method) -> f64 {
    match method {
        Method::Technique(_) => 2.0 * PROMISE,
        _ => Rounding::F64.scaled,
    }
}

/// Farther than any point of a world is from its light: eyes and lamps lie within 11 units of the origin, sun's maps
/// begin 12 units before it, rays are at most 20 long.
const BEHIND_EVERYTHING: f32 = 1e3;

/// 1. `0 ≤ L ≤` the unoccluded closed form.
#[test]
fn radiance_lies_between_darkness_and_the_unoccluded_value() {
    for_all(64, World::any(12), |world, tally| {
        let (bound, scale) = (world.unoccluded(), world.scale_of_rounding());
        for method in Method::all() {
            let Some(image) = method.render(&world, tally) else { continue };
            let bright = exceeding(&image, &bound, &scale, method.rounding().lit);
            tally.expect(method.id(), "the unoccluded value", &bright, 0)?;
            // Not "≥ 0": a NaN is no radiance either.
            let dark = image.inscattered().iter().flatten().find(|value| !(**value >= 0.0));
            prop_assert!(dark.is_none(), "{}: {dark:?}", method.id());
        }
        Ok(())
    });
}

/// 2. All light gives the closed form; none gives nothing.
#[test]
fn full_visibility_gives_the_closed_form_and_none_gives_zero() {
    for_all(64, World::any(6).prop_map(World::without_glass), |world, tally| {
        let (bound, scale) = (world.unoccluded(), world.scale_of_rounding());
        // Without any surface, which techniques see beforehand, and with surfaces behind everything, which they find.
        let lit_worlds = [f32::INFINITY, BEHIND_EVERYTHING].map(|depth| world.clone().with_shadow(depth));
        let dark_world = world.clone().with_shadow(0.0);
        for method in Method::all_by_maps() {
            let Rounding { lit, scaled, .. } = method.rounding();
            for lit_world in &lit_worlds {
                let Some(image) = method.render(lit_world, tally) else { continue };
                tally.expect(method.id(), "all light", &differing(&image, &bound, &scale, lit), 0)?;
            }
            // Depth 0 lies before everything in a sun's map and at the lamp itself in the others. The sun's map
            // starts before the world; what lies outside of it is lit by definition, so the world stays inside.
            if world.max_distance < 4.0 || !matches!(world.light, WorldLight::Sun(_)) {
                let Some(image) = method.render(&dark_world, tally) else { continue };
                // Between two faces of a cube, light rays as wide as numbers are rounded may belong to none.
                let none = vec![[0.0; 3]; bound.len()];
                tally.expect(
                    method.id(),
                    "no light",
                    &differing(&image, &none, &scale, lit.min(scaled)),
                    0,
                )?;
            }
        }
        Ok(())
    });
}

/// 3. Linear in the light's strength, and in σs where σt is held.
#[test]
fn radiance_is_linear_in_strength_and_in_scattering() {
    for_all(64, (World::any(12), 0.01..100.0f64), |(world, factor), tally| {
        let scale = world.scale_of_rounding();
        let mut stronger = world.clone();
        stronger.strength = stronger.strength.map(|s| s * factor);
        let mut thinner = world.clone();
        for c in 0..3 {
            let sigma_s: f64 = world.components.iter().map(|part| part.sigma_s[c]).sum();
            thinner.sigma_a[c] += 0.5 * sigma_s;
        }
        thinner.components.iter_mut().for_each(|part| part.sigma_s = part.sigma_s.map(|s| 0.5 * s));
        for method in Method::all() {
            let allowed = method.rounding().scaled;
            let Some(image) = method.render(&world, tally).map(|image| values(&image)) else { continue };
            let Some(strong) = method.render(&stronger, tally) else { continue };
            let found = differing(&strong, &times(&image, factor), &times(&scale, factor), allowed);
            tally.expect(method.id(), "a stronger light", &found, 0)?;
            let Some(thin) = method.render(&thinner, tally) else { continue };
            let found = differing(&thin, &times(&image, 0.5), &scale, allowed);
            tally.expect(method.id(), "less scattering", &found, 0)?;
        }
        Ok(())
    });
}

/// 3b. Two lights in the same place add up: what is found of the map does not depend on the light's strength. By every
/// technique's presets and error targets, whatever they choose for the frame.
#[test]
fn the_images_of_two_lights_in_one_place_add_up() {
    let targets = [Target::Quality(Quality::Preview), Target::Quality(Quality::Game), Target::Error(0.02)];
    for_all(64, (World::any(12), [0.0..50.0f64, 0.0..50.0, 0.0..50.0]), |(world, other), tally| {
        let with = |strength: [f64; 3]| {
            let mut world = world.clone();
            world.strength = strength;
            world
        };
        let both: [f64; 3] = std::array::from_fn(|c| world.strength[c] + other[c]);
        // Rounding in units of a light that is as strong as both.
        let scale = with(both).scale_of_rounding();
        for method in Method::techniques() {
            for target in targets {
                let image = |strength| method.render_for(&with(strength), target, &[], tally);
                let (Some(mut sum), Some(more)) = (image(world.strength), image(other)) else { continue };
                sum.add(&more).expect("images of one size");
                let Some(image) = image(both) else { continue };
                let found = differing(&image, &values(&sum), &scale, method.rounding().added);
                tally.expect(method.id(), &format!("two lights, {target:?}"), &found, 0)?;
            }
        }
        Ok(())
    });
}

/// 4. Lengths times k with σ / k: a sun's image stays, a lamp's with I·k² too.
#[test]
fn lengths_and_extinction_scale_against_each_other() {
    for_all(64, (World::any(12), -4i32..5), |(world, exponent), tally| {
        // A power of two, so that scaled f32 depths are the same depths.
        let k = 2f64.powi(3 * exponent);
        let mut scaled = world.clone();
        scaled.scale = k;
        scaled.components.iter_mut().for_each(|part| part.sigma_s = part.sigma_s.map(|s| s / k));
        scaled.sigma_a = scaled.sigma_a.map(|s| s / k);
        if !matches!(world.light, WorldLight::Sun(_)) {
            scaled.strength = scaled.strength.map(|s| s * k * k);
        }
        let scale = world.scale_of_rounding();
        for method in Method::all() {
            let Some(image) = method.render(&world, tally) else { continue };
            let Some(other) = method.render(&scaled, tally) else { continue };
            let found = differing(&other, &values(&image), &scale, method.rounding().scaled);
            tally.expect(method.id(), &format!("{k} times as large"), &found, method.flips())?;
        }
        Ok(())
    });
}

/// 5. A rigid motion leaves the image; a reflection reflects it.
#[test]
fn motions_leave_the_image_and_mirrors_mirror_it() {
    let motions = (
        World::any(12),
        [-1.0..1.0f64, -1.0..1.0, 0.1..1.0],
        0.0..6.0f64,
        [-1e4..1e4f64, -1e4..1e4, -1e4..1e4],
    );
    for_all(64, motions, |(world, axis, angle, shift), tally| {
        let scale = world.scale_of_rounding();
        let width = world.size[0] as usize;
        let reflected = |values: &[[f64; 3]]| -> Values {
            values.chunks(width).flat_map(|row| row.iter().rev()).copied().collect()
        };
        let rotation = glam::DQuat::from_axis_angle(glam::DVec3::from(axis).normalize(), angle);
        let mirrored = world.clone().mirrored();
        for method in Method::all() {
            let bound_to_axes = world.has_cube_map() && !matches!(method, Method::RaycastTruth);
            let rotation = if bound_to_axes { glam::DQuat::IDENTITY } else { rotation };
            let mut moved = world.clone();
            moved.motion = glam::DAffine3::from_rotation_translation(rotation, shift.into());
            let allowed = method.rounding().moved;
            let Some(image) = method.render(&world, tally).map(|image| values(&image)) else { continue };
            let Some(other) = method.render(&moved, tally) else { continue };
            let found = differing(&other, &image, &scale, allowed);
            tally.expect(method.id(), "moved", &found, method.flips())?;
            if bound_to_axes {
                continue;
            }
            let Some(other) = method.render(&mirrored, tally) else { continue };
            let found = differing(&other, &reflected(&image), &reflected(&scale), allowed);
            tally.expect(method.id(), "mirrored", &found, method.flips())?;
        }
        Ok(())
    });
}

/// 6. One more occluder never makes a pixel brighter, the map's frame held fixed.
#[test]
fn an_occluder_never_brightens() {
    for_all(64, (World::any(8), World::any(4)), |(world, more), tally| {
        let mut shaded = world.clone();
        shaded.triangles.extend(more.triangles);
        // The view is held fixed too: an occluder in front of the camera shortens rays, which only darkens.
        let shaded = shaded.with_maps();
        for method in Method::all() {
            let found = in_order(method, [&shaded, &world], &world, tally);
            let Some(found) = found else { continue };
            tally.expect(method.id(), "an occluder more", &found, 0)?;
        }
        Ok(())
    });
}

/// 7. `L(0, D)` is non-decreasing in D.
#[test]
fn radiance_grows_with_the_ray() {
    for_all(64, (World::any(12), 0.0..1.0f64), |(world, share), tally| {
        let mut shorter = world.clone();
        shorter.max_distance *= share;
        for method in Method::all() {
            let Some(found) = in_order(method, [&shorter, &world], &world, tally) else { continue };
            tally.expect(method.id(), "a shorter ray", &found, 0)?;
        }
        Ok(())
    });
}

/// Where the darker world's image exceeds the brighter one's, in units of what rounding is measured by in `of`.
fn in_order(
    method: Method,
    [darker, brighter]: [&World; 2],
    of: &World,
    tally: &scatter_tests::Tally,
) -> Option<Comparison> {
    let image = |world: &World| method.render_for(world, Target::Error(PROMISE), &[], tally);
    let (dark, bright) = (image(darker)?, image(brighter)?);
    Some(exceeding(&dark, &values(&bright), &of.scale_of_rounding(), order_slack(method)))
}

/// 9. A frame that is accepted is rendered within what is promised of the exact walk's image.
#[test]
fn a_promise_is_kept_on_every_frame_that_is_accepted() {
    for_all(64, World::any(12), |world, tally| {
        let Some(truth) = Method::ShadowMapWalk.render(&world, tally) else { return Ok(()) };
        let scale = world.scale_of_rounding();
        for method in Method::techniques() {
            let target = Target::Error(PROMISE);
            let Some(image) = method.render_for(&world, target, &[], tally) else { continue };
            let found = differing(&image, &values(&truth), &scale, PROMISE);
            tally.expect(method.id(), "its promise", &found, 0)?;
        }
        Ok(())
    });
}
