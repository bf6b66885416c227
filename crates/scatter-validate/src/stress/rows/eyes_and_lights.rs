//! Where the eye is, where the light is, and where the epipole falls on the image.

use glam::DVec3;
use scatter_core::{Camera, ModelError};

use crate::scenario::{MapLayer, Scenario, Shadow};
use crate::stress::row::StressRow;
use crate::stress::scenes::{self, EYE, LAMP, SCENES, SIZE, TARGET};

/// Rows of places and directions.
pub fn rows() -> Vec<StressRow> {
    [eyes(), straight(), epipoles()].into_iter().flatten().collect()
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
