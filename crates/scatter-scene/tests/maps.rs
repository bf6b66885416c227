//! Depth and shadow maps against brute force, and the fit of shadow maps against what the camera sees.

use glam::{DMat4, DVec3, DVec4};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, MapSource, Medium, Phase, ShadowMap, cube_face_of,
};
use scatter_scene::{FittedMap, MapResolution, Scene, SceneCaster, ShotMaps, fit_map};
use scatter_testing::Random;

fn soup(random: &mut Random, count: u32, centre: DVec3) -> Scene {
    let mut scene = Scene::default();
    for index in 0..count {
        let middle = centre + random.in_cube(4.0);
        let size = random.range(0.3, 2.0);
        scene.positions.extend((0..3).map(|_| middle + random.in_cube(size)));
        scene.triangles.push([3 * index, 3 * index + 1, 3 * index + 2]);
    }
    scene
}

/// All t > 0 at which `origin + t·step` meets a triangle (Möller and Trumbore 1997).
fn hits(scene: &Scene, origin: DVec3, step: DVec3) -> impl Iterator<Item = f64> + '_ {
    scene.triangles.iter().filter_map(move |triangle| {
        let [a, b, c] = triangle.map(|i| scene.positions[i as usize] - origin);
        let (e1, e2) = (b - a, c - a);
        let p = step.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let u = -a.dot(p) * inverse;
        let q = -a.cross(e1);
        let v = step.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    })
}

fn first_hit(scene: &Scene, origin: DVec3, step: DVec3) -> f64 {
    hits(scene, origin, step).fold(f64::INFINITY, f64::min)
}

#[track_caller]
fn assert_texel(found: f32, expected: f64) {
    let expected = expected as f32;
    // One rounding of each side.
    let close = found == expected || (found - expected).abs() <= 2.0 * f32::EPSILON * expected.abs();
    assert!(close, "{found} {expected}");
}

#[test]
fn a_depth_map_holds_the_first_surface_of_every_pixel() {
    let mut random = Random(1);
    for centre in [DVec3::ZERO, DVec3::new(3e4, -1e4, 7e3)] {
        let scene = soup(&mut random, 200, centre);
        let caster = SceneCaster::new(&scene).unwrap();
        let eye = (centre + random.in_cube(6.0)).to_array();
        let (target, up) = (centre.to_array(), [0.0, 1.0, 0.0]);
        for camera in [
            Camera::perspective(eye, target, up, 75.0, [61, 37]).unwrap(),
            Camera::orthographic(eye, target, up, 7.0, [61, 37]).unwrap(),
        ] {
            let mut depth = vec![7.0];
            caster.depth_map(&camera, &mut depth);
            assert_eq!(depth.len(), 61 * 37);
            for (index, &texel) in depth.iter().enumerate() {
                let ray = camera.pixel_ray(index as u32 % 61, index as u32 / 61);
                assert_texel(texel, first_hit(&scene, camera.eye() + ray.origin, ray.direction));
            }
            assert!(depth.iter().any(|d| d.is_finite()) && depth.iter().any(|d| !d.is_finite()));
        }
    }
}

#[test]
fn a_shadow_map_holds_the_first_surface_of_every_light_ray() {
    let mut random = Random(2);
    let scene = soup(&mut random, 200, DVec3::ZERO);
    let caster = SceneCaster::new(&scene).unwrap();
    let (travel, up) = (random.direction(), random.direction().to_array());
    // The parallel map's near plane cuts the scene: what lies before it counts at depth 0.
    let parallel =
        MapProjection::orthographic((-2.0 * travel).to_array(), travel.to_array(), up, [3.0, 2.0], [41, 23]);
    let spot =
        MapProjection::perspective((-7.0 * travel).to_array(), travel.to_array(), up, 0.5, 29).unwrap();
    let parallel = parallel.unwrap();
    let mut texels = Vec::new();
    caster.shadow_map(&parallel, &mut texels).unwrap();
    let mut before = 0;
    for (index, &texel) in texels.iter().enumerate() {
        let (column, row) = (index as u32 % 41, index as u32 / 41);
        let (origin, step) = parallel.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5).unwrap();
        let depth = first_hit(&scene, origin - 100.0 * step, step) - 100.0;
        before += usize::from(depth < 0.0);
        // 100 units in front of the map cost 1e-14.
        assert!(
            (f64::from(texel) - depth.max(0.0)).abs() < 1e-6 || f64::from(texel) == depth,
            "{texel} {depth}"
        );
    }
    assert!(before > 10, "the near plane was to cut the scene: {before}");
    caster.shadow_map(&spot, &mut texels).unwrap();
    for (index, &texel) in texels.iter().enumerate() {
        let (column, row) = (index as u32 % 29, index as u32 / 29);
        let (origin, step) = spot.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5).unwrap();
        assert_texel(texel, first_hit(&scene, origin, step));
    }
}

#[test]
fn cube_faces_look_where_the_core_looks_them_up() {
    let mut random = Random(3);
    let scene = soup(&mut random, 100, DVec3::ZERO);
    let caster = SceneCaster::new(&scene).unwrap();
    let position = DVec3::new(0.2, -0.1, 0.3);
    let light = Light::point(position.to_array(), [1.0; 3], 0.0).unwrap();
    let camera = Camera::perspective([6.0, 1.0, 2.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, [4, 3]).unwrap();
    let maps = ShotMaps::build(&caster, &camera, &light, 50.0, 33).unwrap();
    let mut layers = Vec::new();
    let shadow = maps.shadow_map(&mut layers).unwrap();
    let ShadowMap::Cube(cube) = &shadow else { panic!("a point light has a cube") };
    for face in 0..6 {
        for (row, column) in [(0, 0), (3, 17), (16, 16), (31, 2), (32, 32)] {
            // A point of the texel's ray, looked up the core's way.
            let (u, v) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
            let (origin, step) = cube.face(face).projection().light_ray(u, v).unwrap();
            assert_eq!(cube_face_of(step), face);
            let depth = first_hit(&scene, origin, step);
            assert_texel(cube.face(face).at(column, row), depth);
            if depth.is_finite() {
                assert!(shadow.is_lit(position + 0.99 * depth * step));
                assert!(!shadow.is_lit(position + 1.01 * depth * step));
            }
        }
    }
}

/// Rigid view matrix of an engine: looks along −z.
fn view_from_world(eye: DVec3, forward: DVec3, up: DVec3) -> DMat4 {
    let right = forward.cross(up).normalize();
    let up = right.cross(forward);
    let row = |axis: DVec3| axis.extend(-axis.dot(eye));
    DMat4::from_cols(row(right), row(up), row(-forward), DVec4::W).transpose()
}

#[test]
fn a_shadow_map_source_gives_the_depths_of_engine_matrices() {
    let mut random = Random(4);
    let scene = soup(&mut random, 150, DVec3::ZERO);
    let caster = SceneCaster::new(&scene).unwrap();
    let (eye, up, tan) = (DVec3::new(5.0, 6.0, -4.0), DVec3::Y, 0.6);
    let forward = -eye.normalize();
    let view = view_from_world(eye, forward, up);
    let (near, far) = (7.0, 11.0);
    // Row by row; view z is −distance. Each with its z/w for a distance along the axis.
    let rows = |x: f64, z: DVec4, w: DVec4| {
        DMat4::from_cols(DVec4::new(x, 0.0, 0.0, 0.0), DVec4::new(0.0, x, 0.0, 0.0), z, w).transpose()
    };
    let scale = far / (far - near);
    type DepthOf = Box<dyn Fn(f64) -> f64>;
    let projections: [(DMat4, DepthOf, bool); 4] = [
        (
            rows(0.25, DVec4::new(0.0, 0.0, -1.0 / (far - near), -near / (far - near)), DVec4::W),
            Box::new(move |d| (d - near) / (far - near)),
            false,
        ),
        (
            rows(1.0 / tan, DVec4::new(0.0, 0.0, -scale, -scale * near), -DVec4::Z),
            Box::new(move |d| scale * (d - near) / d),
            true,
        ),
        // Infinite reversed z: the smallest z/w is the farthest surface, which is what the trait asks for.
        (rows(1.0 / tan, DVec4::new(0.0, 0.0, 0.0, near), -DVec4::Z), Box::new(move |d| near / d), true),
        // z = 1 − near/d: everything up to infinity.
        (
            rows(1.0 / tan, DVec4::new(0.0, 0.0, -1.0, -near), -DVec4::Z),
            Box::new(move |d| 1.0 - near / d),
            true,
        ),
    ];
    for (number, (clip_from_view, depth_of, perspective)) in projections.iter().enumerate() {
        let clip = *clip_from_view * view;
        let size = [31, 17];
        let mut out = Vec::new();
        caster.clip_map(clip.to_cols_array_2d(), size, &mut out).unwrap();
        let map = MapProjection::from_clip_from_world(clip.to_cols_array_2d(), size).unwrap();
        let mut clamped = 0;
        for (index, &texel) in out.iter().enumerate() {
            let (column, row) = (index as u32 % 31, index as u32 / 31);
            let (origin, step) = map.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5).unwrap();
            // A parallel map's rays have no beginning.
            let origin = if *perspective { origin } else { origin - 100.0 * step };
            let smallest = hits(&scene, origin, step)
                .map(|t| depth_of((origin + t * step - eye).dot(forward)))
                .filter(|&depth| depth <= 1.0)
                .fold(f64::INFINITY, f64::min);
            clamped += usize::from(smallest < 0.0);
            let expected = smallest.max(0.0);
            let close = f64::from(texel) == expected || (f64::from(texel) - expected).abs() < 1e-6;
            assert!(close, "projection {number}, texel {index}: {texel} {expected}");
        }
        assert!(out.iter().filter(|t| t.is_finite()).count() > 50);
        assert!(clamped > 0 || number == 2, "projection {number} was to cut the scene with its near plane");
    }
}

#[test]
fn a_map_source_refuses_what_it_cannot_draw() {
    let caster = SceneCaster::new(&Scene::default()).unwrap();
    let identity = DMat4::IDENTITY.to_cols_array_2d();
    let mut out = vec![0.0; 7];
    assert!(caster.clip_map(identity, [3, 0], &mut out).unwrap_err().to_string().contains("1x1"));
    assert!(caster.clip_map([[0.0; 4]; 4], [1, 1], &mut out).unwrap_err().to_string().contains("singular"));
    assert!(caster.clip_map([[f64::NAN; 4]; 4], [1, 1], &mut out).is_err());
    caster.clip_map(identity, [3, 2], &mut out).unwrap();
    assert_eq!(out, [f32::INFINITY; 6]);
}

#[test]
fn whatever_shadows_a_visible_point_lies_inside_of_the_map() {
    let mut random = Random(5);
    for round in 0..20 {
        let centre = random.direction() * [0.0, 1e4][round % 2];
        let scene = soup(&mut random, 60, centre);
        let caster = SceneCaster::new(&scene).unwrap();
        let eye = (centre + random.in_cube(8.0)).to_array();
        let target = (centre + random.in_cube(3.0)).to_array();
        let up = random.direction().to_array();
        let camera = if round % 3 == 0 {
            Camera::orthographic(eye, target, up, 5.0, [19, 13]).unwrap()
        } else {
            Camera::perspective(eye, target, up, 50.0, [19, 13]).unwrap()
        };
        let travel = random.direction();
        let light = Light::directional(travel.to_array(), [1.0; 3]).unwrap();
        let max_distance = [15.0, f64::INFINITY][round / 2 % 2];
        for size in [1, 2, 64] {
            let single = ShotMaps::build(&caster, &camera, &light, max_distance, size).unwrap();
            let cascaded =
                ShotMaps::build(&caster, &camera, &light, max_distance, MapResolution::cascaded(size, 3))
                    .unwrap();
            for maps in [&single, &cascaded] {
                let mut layers = Vec::new();
                let shadow = maps.shadow_map(&mut layers).unwrap();
                assert_eq!(shadow.layers().count(), if std::ptr::eq(maps, &single) { 1 } else { 3 });
                let depth = maps.depth_map().unwrap();
                for _ in 0..300 {
                    let (x, y) = (random.range(0.0, 19.0) as u32, random.range(0.0, 13.0) as u32);
                    let ray = camera.pixel_ray(x, y);
                    let end = f64::from(depth.at(x, y)).min(max_distance).min(30.0);
                    let p = camera.eye() + ray.origin + random.range(0.0, 1.0) * end * ray.direction;
                    if first_hit(&scene, p, -travel) == f64::INFINITY {
                        continue;
                    }
                    let inside = shadow.layers().any(|layer| {
                        let uvd = layer.projection().texel_from_world(p);
                        let range = 0.0..f64::from(size);
                        range.contains(&uvd.x) && range.contains(&uvd.y) && uvd.z > 0.0
                    });
                    assert!(inside, "round {round}, size {size}: {p}");
                }
            }
        }
    }
}

#[test]
fn a_fine_map_knows_what_is_lit() {
    let mut random = Random(6);
    let scene = soup(&mut random, 60, DVec3::ZERO);
    let caster = SceneCaster::new(&scene).unwrap();
    let camera = Camera::perspective([6.0, 3.0, 4.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, [40, 30]).unwrap();
    let spot = |outer| Light::spot([0.5, 7.0, -1.0], [0.0, -1.0, 0.1], [1.0; 3], 10.0, outer, 0.0).unwrap();
    let lights = [
        Light::directional([0.3, -1.0, 0.2], [1.0; 3]).unwrap(),
        spot(40.0),
        spot(85.0),
        Light::point([0.5, 7.0, -1.0], [1.0; 3], 0.0).unwrap(),
    ];
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    for light in &lights {
        let maps = ShotMaps::build(&caster, &camera, light, 20.0, 512).unwrap();
        let mut layers = Vec::new();
        let (depth, shadow) = (maps.depth_map().unwrap(), maps.shadow_map(&mut layers).unwrap());
        Frame::new(&camera, depth, light, &shadow, &medium, 20.0).unwrap();
        let (mut right, mut shadowed, mut count) = (0, 0, 0);
        for _ in 0..3000 {
            let (x, y) = (random.range(0.0, 40.0) as u32, random.range(0.0, 30.0) as u32);
            let ray = camera.pixel_ray(x, y);
            let end = f64::from(depth.at(x, y)).min(20.0);
            let p = camera.eye() + random.range(0.0, 1.0) * end * ray.direction;
            let lit = match light {
                Light::Directional(sun) => first_hit(&scene, p, -sun.direction()) == f64::INFINITY,
                _ => first_hit(&scene, p, light.position().unwrap() - p) > 1.0,
            };
            if let Light::Spot(spot) = light {
                let axis = (p - spot.lamp().position()).normalize().dot(spot.direction());
                if axis <= spot.cos_outer() {
                    continue;
                }
            }
            count += 1;
            right += usize::from(shadow.is_lit(p) == lit);
            shadowed += usize::from(!lit);
        }
        // Wrong only within a texel of an edge: outlines of 60 triangles on 512² texels.
        assert!(
            right as f64 >= 0.95 * count as f64 && shadowed * 20 > count,
            "{light:?}: {right} of {count}"
        );
    }
    assert!(matches!(
        ShotMaps::build(&caster, &camera, &lights[2], 20.0, 4).unwrap().fitted(),
        FittedMap::Cube { .. }
    ));
}

#[test]
fn the_last_bits_of_a_depth_move_no_texel() {
    let mut random = Random(8);
    let scene = soup(&mut random, 60, DVec3::ZERO);
    let caster = SceneCaster::new(&scene).unwrap();
    let light = Light::directional([0.3, -1.0, 0.2], [1.0; 3]).unwrap();
    let mut same = 0;
    for _ in 0..50 {
        let eye = (random.direction() * 7.0).to_array();
        let camera = Camera::perspective(eye, [0.0; 3], [0.0, 1.0, 0.0], 60.0, [40, 30]).unwrap();
        let mut depth = Vec::new();
        caster.depth_map(&camera, &mut depth);
        let fit = |depth: &[f32]| {
            let map = DepthMap::new(depth, camera.size()).unwrap();
            fit_map(&caster, &camera, map, &light, 20.0, 64.into()).unwrap()
        };
        let other: Vec<f32> = depth.iter().map(|d| d * (1.0 + f32::EPSILON)).collect();
        same += usize::from(fit(&depth) == fit(&other));
    }
    // A side lies within 1e-7·20 units of a line of the grid, 16/4096 units apart, once in two thousand times; there
    // are four sides.
    assert!(same >= 49, "{same} of 50");
}

#[test]
fn maps_survive_scenes_without_size_and_cameras_that_see_nothing() {
    let flat = Scene {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Z],
        triangles: vec![[0, 1, 2], [0, 0, 1]],
        ..Scene::default()
    };
    let point = Scene { positions: vec![DVec3::ONE], triangles: vec![[0, 0, 0]], ..Scene::default() };
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let light = |direction| Light::directional(direction, [1.0; 3]).unwrap();
    for scene in [&Scene::default(), &flat, &point] {
        let caster = SceneCaster::new(scene).unwrap();
        for light in [light([1.0, 0.0, 0.0]), light([0.0, -1.0, 0.0]), light([0.3, -1.0, 0.2])] {
            // At the scene, and away from it.
            for target in [[0.0; 3], [1e3, 1e3, 1e3]] {
                let camera =
                    Camera::perspective([5.0, 5.0, 5.0], target, [0.0, 1.0, 0.0], 40.0, [3, 1]).unwrap();
                for (size, max_distance) in [(1, 10.0), (7, f64::INFINITY), (7, 0.0)] {
                    for count in [1, 4] {
                        let maps = ShotMaps::build(
                            &caster,
                            &camera,
                            &light,
                            max_distance,
                            MapResolution::cascaded(size, count),
                        )
                        .unwrap();
                        let mut layers = Vec::new();
                        let shadow = maps.shadow_map(&mut layers).unwrap();
                        let depth = maps.depth_map().unwrap();
                        Frame::new(&camera, depth, &light, &shadow, &medium, max_distance).unwrap();
                    }
                }
            }
        }
    }
}

#[test]
fn scenes_that_cannot_be_cast_against_are_errors() {
    let bad = |positions: Vec<DVec3>, triangle: [u32; 3]| {
        let scene = Scene { positions, triangles: vec![triangle], ..Scene::default() };
        SceneCaster::new(&scene).unwrap_err().to_string()
    };
    assert!(bad(vec![DVec3::ZERO, DVec3::X, DVec3::NAN], [0, 1, 2]).contains("vertex 2"));
    assert!(bad(vec![DVec3::ZERO, DVec3::X * 1e16, DVec3::Y], [0, 1, 2]).contains("vertex 1"));
    assert!(bad(vec![DVec3::ZERO, DVec3::X, DVec3::Y], [0, 1, 3]).contains("vertex 3 of 3"));
}
