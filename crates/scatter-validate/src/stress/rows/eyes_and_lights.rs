//! Where the eye is, where the light is, and where the epipole falls on the image.

use glam::DVec3;
use scatter_core::{Camera, ModelError, Phase};

use crate::scenario::{MapLayer, Scenario, Shadow};
use crate::stress::row::StressRow;
use crate::stress::scenes::{self, EYE, LAMP, SCENES, SIZE, TARGET};

/// Rows of places and directions.
pub fn rows() -> Vec<StressRow> {
    [eyes(), straight(), epipoles(), beside_centres()].into_iter().flatten().collect()
}

fn eyes() -> Vec<StressRow> {
    let row = |name: String, scene| StressRow::image("the eye", name, scene);
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        let far = DVec3::new(1e5, -3.7e4, 9.1e4);
        rows.push(row(format!("1e5 units from the origin, {light}"), scene().and_then(|s| s.moved(far))));
        rows.push(row(format!("outside of the map, {light}"), outside_of_the_map(light)));
        rows.push(row(format!("inside an occluder, {light}"), inside_an_occluder(light)));
    }
    rows.push(row("behind the spot".into(), spot_from(DVec3::new(0.4, -0.5, -1.0).normalize(), 3.0)));
    rows.push(row("before the spot, looking into it".into(), spot_from(DVec3::new(0.1, -0.1, 1.0), 1.0)));
    let near = EYE + DVec3::new(1e-3, 5e-4, -1e-3);
    rows.push(row(
        "1.5e-3 units from a lamp".into(),
        scenes::camera(SIZE).and_then(|c| scenes::point_at(near, c)),
    ));
    rows
}

/// The eye stays; the map reaches over the target alone, or the cone leaves the eye out.
fn outside_of_the_map(light: &str) -> Result<Scenario, ModelError> {
    match light {
        "sun" => {
            let mut scene = scenes::sun()?;
            let frame = scenes::sun_frame(scenes::SUN, TARGET, [1.9, 1.3], [11, 13]);
            let dark = |i: u32, j: u32| if (i + j).is_multiple_of(3) { f32::INFINITY } else { 18.5 };
            scene.shadow = Shadow::Parallel(vec![MapLayer::filled(frame, dark)]);
            Ok(scene)
        }
        "point" => {
            // A cube map has no outside: the eye is far from all that the map knows of.
            let camera = Camera::perspective([0.4, 60.0, 80.0], [0.0; 3], [0.0, 1.0, 0.0], 10.0, SIZE)?;
            let mut scene = scenes::point_at(LAMP, camera)?;
            scene.max_distance = 150.0;
            Ok(scene)
        }
        _ => {
            let position = DVec3::new(1.0, 3.1, -1.2);
            scenes::spot_at(position, DVec3::new(-0.3, -1.0, -0.1), scenes::camera(SIZE)?)
        }
    }
}

/// Every texel around the eye stores a surface between it and the light.
fn inside_an_occluder(light: &str) -> Result<Scenario, ModelError> {
    match light {
        "sun" => {
            let scene = scenes::sun()?;
            // The map's plane is 20 before the target; the eye's depth is 20 + (EYE − TARGET)·l.
            let depth = 20.0 + (EYE - TARGET).dot(scenes::SUN.normalize());
            Ok(scene.with_depths(move |old, i, _| if i % 4 == 3 { old } else { old.min(depth as f32 - 0.7) }))
        }
        "point" => Ok(scenes::point()?.with_depths(|old, i, _| if i % 4 == 3 { old } else { 0.8 })),
        _ => {
            let position = EYE + DVec3::new(0.2, 2.0, -0.6);
            let scene = scenes::spot_at(position, EYE - position, scenes::camera(SIZE)?)?;
            Ok(scene.with_depths(|_, i, j| if (i + j) % 5 == 0 { 2.6 } else { 1.2 }))
        }
    }
}

/// A spot on the view axis, `distance` ahead of the eye, that shines along `direction`.
fn spot_from(direction: DVec3, distance: f64) -> Result<Scenario, ModelError> {
    let camera = scenes::camera(SIZE)?;
    let aside = 0.3 * camera.right() + 0.2 * camera.up();
    scenes::spot_at(EYE + distance * camera.forward() + aside, direction, camera)
}

/// Straight ahead, straight behind, and a milliradian off either.
fn straight() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (way, side) in [("ahead", 1.0), ("behind", -1.0)] {
        for (off, angle) in [("straight", 0.0), ("1 mrad off straight", 1e-3)] {
            for (light, _) in SCENES {
                let scene = scenes::camera(SIZE).and_then(|camera| {
                    let towards =
                        side * (camera.forward() + angle * (0.6 * camera.right() + 0.8 * camera.up()));
                    with_light_towards(light, towards.normalize(), camera)
                });
                rows.push(StressRow::image("light on the view axis", format!("{off} {way}, {light}"), scene));
            }
        }
    }
    rows
}

/// A scene whose light is seen in a direction from the eye: a sun there, a lamp 3.3 units away, a spot that shines
/// back over the eye.
fn with_light_towards(light: &str, towards: DVec3, camera: Camera) -> Result<Scenario, ModelError> {
    let place = EYE + 3.3 * towards;
    match light {
        "sun" => scenes::sun_along(-towards, camera),
        "point" => scenes::point_at(place, camera),
        _ => scenes::spot_at(place, -towards + DVec3::new(0.05, 0.11, -0.03), camera),
    }
}

/// Where the light, or for a sun the opposite point too, falls on the image.
fn epipoles() -> Vec<StressRow> {
    let [width, height] = SIZE.map(f64::from);
    let places = [
        ("on a pixel's centre", [3.5, 2.5]),
        ("on a pixel's corner", [4.0, 6.0]),
        ("inside of a pixel", [9.3, 4.8]),
        ("on the image's corner", [0.0, 0.0]),
        ("on the image's border", [width, 3.3]),
        ("1e-3 pixels outside", [5.2, height + 1e-3]),
        ("1e6 pixels outside", [1e6, 4.5]),
    ];
    let mut rows = Vec::new();
    for (light, _) in SCENES {
        for (place, [x, y]) in places {
            let scene = scenes::camera(SIZE).and_then(|camera| {
                let towards = camera.ray(x, y).direction;
                with_light_towards(light, towards, camera)
            });
            rows.push(StressRow::image("the epipole", format!("{place}, {light}"), scene));
        }
        let at_infinity = scenes::camera(SIZE).and_then(|camera| {
            let across = 0.8 * camera.right() + 0.6 * camera.up();
            with_light_towards(light, across, camera)
        });
        rows.push(StressRow::image("the epipole", format!("at infinity, {light}"), at_infinity));
    }
    let anti = scenes::camera(SIZE).and_then(|camera| {
        let away = camera.ray(8.4, 3.1).direction;
        scenes::sun_along(away, camera)
    });
    rows.push(StressRow::image("the epipole", "the opposite point in view, sun", anti));
    rows
}

/// The singular point beside the centre of a pixel: where its sines and slopes vanish, but not to zero. From an f64's last bit
/// at pixel coordinates of an image to a whole pixel, the light before the eye and behind it.
fn beside_centres() -> Vec<StressRow> {
    /// Distances \[pixels\]; around the ones in which a product of two of them, or an f32, loses itself.
    const DISTANCES: [f64; 12] = [1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 0.03, 1.0];
    let mut rows = Vec::new();
    for (light, _) in SCENES {
        for side in [1.0, -1.0] {
            for (index, distance) in DISTANCES.into_iter().enumerate() {
                // Every distance in another direction, among them along the axes and the diagonals.
                let angle = index as f64 * std::f64::consts::FRAC_PI_4 + if index > 7 { 0.3 } else { 0.0 };
                let aside = [distance * angle.cos(), distance * angle.sin()];
                let behind = if side > 0.0 { "" } else { ", behind the eye" };
                let name = format!("{distance:.0e} pixels beside a centre, {light}{behind}");
                rows.push(StressRow::image("the epipole", name, beside_a_centre(light, side, aside)));
            }
        }
    }
    rows
}

/// The image around the singular point: so few values that their p99 is the largest of them.
const AROUND: [u32; 2] = [3, 5];
/// The pixel beside whose centre the singular point lies: its middle.
const SINGULAR: [u32; 2] = [1, 2];

/// The light in the direction of [`SINGULAR`]'s centre and a bit `aside` \[pixels\], `side` 1, or opposite to it, −1. Its map
/// ends all light rays around the eye's in one place, so that the ray of this pixel is lit in part.
fn beside_a_centre(light: &str, side: f64, aside: [f64; 2]) -> Result<Scenario, ModelError> {
    let camera = Camera::perspective(EYE.to_array(), TARGET.to_array(), [0.0, 1.0, 0.0], 30.0, AROUND)?;
    let [x, y] = [0, 1].map(|axis| f64::from(SINGULAR[axis]) + 0.5 + aside[axis]);
    let towards = side * camera.ray(x, y).direction;
    // Isotropic, because some lobes send all pixels of a lamp to another path.
    let scene = with_light_towards(light, towards, camera)?.in_medium(0.05, 0.01, Phase::Isotropic)?;
    // Two units before the eye: between it and the light, or where the ray goes on behind it.
    let at_eye = if light == "sun" { 20.0 - (EYE - TARGET).dot(towards) } else { 3.3 };
    let depth = (at_eye - 2.0 * side) as f32;
    Ok(scene.with_depths(|old, i, j| if (i / 4 + j / 4).is_multiple_of(5) { old } else { depth }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pixel_beside_the_singular_point_is_lit_in_part() {
        for (light, _) in SCENES {
            for side in [1.0, -1.0] {
                let expected = beside_a_centre(light, side, [1e-3, 2e-3]).unwrap().expected();
                let index = (SINGULAR[1] * AROUND[0] + SINGULAR[0]) as usize;
                let share = expected.radiance[index][0] / expected.scale[index][0];
                // A ray that runs into a lamp has nearly all of its light from around it.
                let most = if light != "sun" && side > 0.0 { 1.0 } else { 0.9 };
                assert!((0.1..most).contains(&share), "{light} {side}: {share}");
            }
        }
    }
}
