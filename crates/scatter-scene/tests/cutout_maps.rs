//! Depth maps, shadow maps and cube maps of scenes with cut-outs, against brute force over all triangles.

use glam::{DVec2, DVec3};
use scatter_core::{Camera, MapProjection};
use scatter_scene::{AlphaMask, Cutout, Scene, SceneCaster, Wrap};
use scatter_testing::Random;

/// A soup of which most triangles are cut out, by four masks under all wraps.
fn soup(random: &mut Random, count: u32, centre: DVec3) -> Scene {
    let mut scene = Scene::default();
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge, Wrap::Repeat] {
        let holes = random.bits();
        let size = [random.range(1.0, 20.0) as u32, random.range(1.0, 20.0) as u32];
        let is_there = |column: u32, row: u32| (holes >> ((column * 5 + row * 3) % 64)) & 1 == 0;
        scene.masks.push(AlphaMask::new(size, [wrap, Wrap::Repeat], is_there));
    }
    for triangle in 0..count {
        let middle = centre + random.in_cube(4.0);
        let size = random.range(0.3, 2.0);
        scene.positions.extend((0..3).map(|_| middle + random.in_cube(size)));
        scene.triangles.push([3 * triangle, 3 * triangle + 1, 3 * triangle + 2]);
        if triangle % 5 != 0 {
            let uv = [0; 3].map(|_| random.in_cube(2.0).truncate());
            scene.cutouts.push(Cutout { triangle, mask: (random.bits() % 4) as u32, uv });
        }
    }
    scene
}

/// The smallest t > 0 at which `origin + t·step` meets what is there of a triangle (Möller and Trumbore 1997).
fn first_hit(scene: &Scene, origin: DVec3, step: DVec3) -> f64 {
    let mut first = f64::INFINITY;
    for (number, triangle) in (0..).zip(&scene.triangles) {
        let [a, b, c] = triangle.map(|i| scene.positions[i as usize] - origin);
        let (e1, e2) = (b - a, c - a);
        let p = step.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let u = -a.dot(p) * inverse;
        let q = -a.cross(e1);
        let (v, t) = (step.dot(q) * inverse, e2.dot(q) * inverse);
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0) {
            continue;
        }
        let cutout = scene.cutouts.iter().find(|cutout| cutout.triangle == number);
        let is_there = cutout.is_none_or(|Cutout { mask, uv, .. }| {
            let at: DVec2 = uv[0] * (1.0 - u - v) + uv[1] * u + uv[2] * v;
            scene.masks[*mask as usize].is_there(at)
        });
        if is_there {
            first = first.min(t);
        }
    }
    first
}

#[track_caller]
fn assert_texel(found: f32, expected: f64) {
    let expected = expected as f32;
    // One rounding of each side.
    let close = found == expected || (found - expected).abs() <= 2.0 * f32::EPSILON * expected.abs();
    assert!(close, "{found} {expected}");
}

#[test]
fn every_map_looks_through_the_texels_that_are_gone() {
    let mut random = Random(31);
    for centre in [DVec3::ZERO, DVec3::new(3e3, -1e3, 700.0)] {
        let scene = soup(&mut random, 200, centre);
        let opaque = Scene { cutouts: Vec::new(), ..scene.clone() };
        let (caster, opaque) = (SceneCaster::new(&scene).unwrap(), SceneCaster::new(&opaque).unwrap());
        let eye = (centre + random.in_cube(6.0)).to_array();
        let (travel, up) = (random.direction().to_array(), random.direction().to_array());
        let mut seen_through = 0;
        let mut compare = |found: &[f32], opaque: &[f32], expected: &dyn Fn(usize) -> f64| {
            for (index, (&found, opaque)) in found.iter().zip(opaque).enumerate() {
                assert_texel(found, expected(index));
                seen_through += u32::from(found != *opaque);
            }
        };

        let camera = Camera::perspective(eye, centre.to_array(), [0.0, 1.0, 0.0], 75.0, [61, 37]).unwrap();
        let (mut a, mut b) = (Vec::new(), Vec::new());
        caster.depth_map(&camera, &mut a);
        opaque.depth_map(&camera, &mut b);
        compare(&a, &b, &|index| {
            let ray = camera.pixel_ray(index as u32 % 61, index as u32 / 61);
            first_hit(&scene, camera.eye() + ray.origin, ray.direction)
        });

        let start = (centre - 20.0 * DVec3::from(travel)).to_array();
        let maps = [
            MapProjection::orthographic(start, travel, up, [6.0, 6.0], [53, 53]).unwrap(),
            MapProjection::perspective(start, travel, up, 0.6, 53).unwrap(),
        ];
        let depth_at = |map: &MapProjection, index: usize| {
            let (column, row) = (index as u32 % map.size()[0], index as u32 / map.size()[0]);
            let (origin, step) = map.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5).unwrap();
            first_hit(&scene, origin, step)
        };
        for map in maps {
            caster.shadow_map(&map, &mut a).unwrap();
            opaque.shadow_map(&map, &mut b).unwrap();
            compare(&a, &b, &|index| depth_at(&map, index));
        }

        let lamp = (centre + random.in_cube(2.0)).to_array();
        caster.cube_map(lamp, 24, &mut a).unwrap();
        opaque.cube_map(lamp, 24, &mut b).unwrap();
        let faces = [0, 1, 2, 3, 4, 5].map(|face| MapProjection::cube_face(lamp, face, 24).unwrap());
        compare(&a, &b, &|index| depth_at(&faces[index / 576], index % 576));
        println!("{seen_through} texels see through a cut-out");
        assert!(seen_through > 500, "{seen_through}");
    }
}
