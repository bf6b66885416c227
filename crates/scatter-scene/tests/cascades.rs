//! Cascades that are fitted to a shot: nothing that the one map knows is lost, and texels are where the view is.

use glam::DVec3;
use scatter_core::{Camera, DepthMap, Light, MapProjection};
use scatter_scene::{
    BuiltinShot, FittedMap, MapResolution, Scene, SceneCaster, Shot, ShotMaps, builtin_shots, fit_map,
    load_shot,
};
use scatter_testing::Random;

fn built_in(shot: &BuiltinShot) -> Shot {
    let files = shot.files();
    let folder = tempfile::tempdir().unwrap();
    for file in [&files.shot, &files.mesh].into_iter().chain(&files.others) {
        std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
    }
    load_shot(&folder.path().join(&files.shot.name)).unwrap()
}

fn cascades(fitted: FittedMap) -> Vec<MapProjection> {
    let FittedMap::Cascades(maps) = fitted else { panic!("a sun has cascades: {fitted:?}") };
    maps
}

/// The first of the maps that contains a point.
fn holder(maps: &[MapProjection], p: DVec3) -> Option<usize> {
    maps.iter().position(|map| {
        let (uvd, [width, height]) = (map.texel_from_world(p), map.size().map(f64::from));
        (0.0..width).contains(&uvd.x) && (0.0..height).contains(&uvd.y) && uvd.z > 0.0
    })
}

/// Sum of the squares of a texel's sides \[world units²\].
fn texel_size_sq(map: &MapProjection) -> f64 {
    let [u, v, _] = map.rows();
    u.truncate().length_squared().recip() + v.truncate().length_squared().recip()
}

/// What a view sees through cascades and through one map of as many texels.
struct Seen {
    /// Points that something shadows.
    shadowed: u32,
    /// Geometric mean of a texel's squared sides over the one map's, over all points: near the eye texels are much
    /// smaller, and at the far end a little larger.
    size_sq: f64,
    /// Cascades that decide about a point.
    deciding: usize,
}

/// Checks points along the rays of a view, surfaces among them: a point that anything shadows lies in a cascade.
#[track_caller]
fn check(
    what: &str,
    caster: &SceneCaster,
    camera: &Camera,
    sun: DVec3,
    max_distance: f64,
    of: MapResolution,
) -> Seen {
    let mut depth = Vec::new();
    caster.depth_map(camera, &mut depth);
    let depth = DepthMap::new(&depth, camera.size()).unwrap();
    let light = Light::directional(sun.to_array(), [1.0; 3]).unwrap();
    let maps = cascades(fit_map(caster, camera, depth, &light, max_distance, of).unwrap());
    assert_eq!(maps.len(), of.cascades as usize, "{what}");
    let FittedMap::Orthographic(one) =
        fit_map(caster, camera, depth, &light, max_distance, of.in_one_map()).unwrap()
    else {
        panic!("{what}: a sun has one parallel map")
    };
    let mut random = Random(9);
    let (mut shadowed, mut size_sq, mut count) = (0, 0.0, 0.0);
    let mut decides = vec![false; maps.len()];
    let [width, height] = camera.size();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let ray = camera.pixel_ray(x, y);
        let end = f64::from(depth.at(x, y)).min(max_distance);
        let finite = end.min(1e4);
        // The surface lies at the ray's end, to the rounding of its distance.
        for t in [0.0, random.range(0.0, finite), random.range(0.0, finite), end * (1.0 - 1e-6)] {
            if t == f64::INFINITY {
                continue;
            }
            let p = camera.eye() + ray.origin + t * ray.direction;
            let (found, in_one) = (holder(&maps, p), holder(&[one], p).is_some());
            if caster.any_hit(p, -sun, f64::INFINITY) {
                shadowed += 1;
                assert!(found.is_some(), "{what}: pixel ({x}, {y}) at {t} is shadowed and in no cascade");
            }
            if let (Some(index), true) = (found, in_one) {
                decides[index] = true;
                size_sq += (texel_size_sq(&maps[index]) / texel_size_sq(&one)).ln();
                count += 1.0;
            }
        }
    }
    Seen {
        shadowed,
        size_sq: (size_sq / count).exp(),
        deciding: decides.into_iter().filter(|&decides| decides).count(),
    }
}

#[test]
fn on_every_suns_shot_what_is_shadowed_lies_in_a_cascade_and_texels_are_smaller() {
    /// Texels that are no smaller than those of one map would be cascades for nothing.
    const LARGEST_SHARE: f64 = 0.6;
    let mut suns = 0;
    for built in builtin_shots() {
        let shot = built_in(built);
        let Light::Directional(sun) = &shot.lights[0].light else { continue };
        suns += 1;
        let caster = SceneCaster::new(&shot.scene).unwrap();
        let camera = shot.camera.with_size([41, 31]).unwrap();
        for count in [2, 4, 16] {
            let of = MapResolution::cascaded(128, count);
            let seen = check(built.name, &caster, &camera, sun.direction(), shot.max_distance, of);
            let name = built.name;
            println!(
                "{name}, {count} cascades: {} points shadowed, {} decide, squared texels {:.3} of one map's",
                seen.shadowed, seen.deciding, seen.size_sq
            );
            assert!(seen.shadowed > 0, "{name}: nothing was checked");
            assert!(seen.deciding > 1, "{name}: one cascade decides about everything");
            assert!(count != 4 || seen.size_sq < LARGEST_SHARE, "{name}: {}", seen.size_sq);
        }
    }
    assert!(suns >= 6, "{suns}");
}

#[test]
fn whatever_the_camera_and_the_sun_what_is_shadowed_lies_in_a_cascade() {
    let mut random = Random(11);
    let mut shadowed = 0;
    for round in 0..60 {
        let centre = random.direction() * [0.0, 1e4][round % 2];
        let mut scene = Scene::default();
        for index in 0..40 {
            let middle = centre + random.in_cube(4.0);
            scene.positions.extend((0..3).map(|_| middle + random.in_cube(1.5)));
            scene.triangles.push([3 * index, 3 * index + 1, 3 * index + 2]);
        }
        let caster = SceneCaster::new(&scene).unwrap();
        // Inside of the scene and far before it.
        let eye = centre + random.direction() * [3.0, 40.0][round / 2 % 2];
        let sun = random.direction();
        let target = match round % 5 {
            0 => eye + sun,
            1 => eye - sun,
            2 => eye + sun + 1e-3 * random.direction(),
            3 => centre + random.in_cube(3.0),
            _ => eye + random.direction(),
        };
        let (eye, target, up) = (eye.to_array(), target.to_array(), random.direction().to_array());
        let camera = match round % 3 {
            0 => Camera::orthographic(eye, target, up, 6.0, [17, 13]),
            1 => Camera::perspective(eye, target, up, 40.0, [17, 13]),
            _ => Camera::perspective(eye, target, up, 150.0, [17, 13]),
        };
        let max_distance = [0.0, 7.0, 60.0, f64::INFINITY][round / 4 % 4];
        let of = MapResolution::cascaded([1, 5, 64][round % 3], [2, 3, 7, 16][round % 4]);
        let seen = check(&format!("round {round}"), &caster, &camera.unwrap(), sun, max_distance, of);
        shadowed += seen.shadowed;
    }
    assert!(shadowed > 2000, "{shadowed}");
}

#[test]
fn a_cascade_is_the_map_of_its_projection() {
    let shot = built_in(BuiltinShot::find("arcade").unwrap());
    let caster = SceneCaster::new(&shot.scene).unwrap();
    let camera = shot.camera.with_size([31, 23]).unwrap();
    let (light, of) = (&shot.lights[0].light, MapResolution::cascaded(65, 3));
    let maps = ShotMaps::build(&caster, &camera, light, shot.max_distance, of).unwrap();
    let projections = cascades(maps.fitted().clone());
    let mut layers = Vec::new();
    let shadow = maps.shadow_map(&mut layers).unwrap();
    let mut texels = Vec::new();
    for (projection, layer) in projections.iter().zip(shadow.layers()) {
        assert_eq!(layer.projection(), projection);
        caster.shadow_map(projection, &mut texels).unwrap();
        assert_eq!(layer.texels(), texels);
        assert!(texels.iter().any(|t| t.is_finite()));
    }
    assert_eq!((maps.shadow().len(), shadow.layer_count()), (3 * 65 * 65, 3));
}

#[test]
fn cascades_that_no_set_up_holds_are_an_error() {
    let caster = SceneCaster::new(&Scene::default()).unwrap();
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], 60.0, [2, 2]).unwrap();
    let sun = Light::directional([0.3, -1.0, 0.2], [1.0; 3]).unwrap();
    for count in [0, 17] {
        let error =
            ShotMaps::build(&caster, &camera, &sun, 9.0, MapResolution::cascaded(8, count)).unwrap_err();
        assert!(error.to_string().contains("1 to 16 cascades"), "{error}");
    }
    let lamp = Light::point([0.5, 7.0, -1.0], [1.0; 3], 0.0).unwrap();
    let maps = ShotMaps::build(&caster, &camera, &lamp, 9.0, MapResolution::cascaded(8, 4)).unwrap();
    assert!(matches!(maps.fitted(), FittedMap::Cube { size: 8, .. }), "a lamp keeps its own map");
}
