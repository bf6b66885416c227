//! Ray-cast truth against the second way, and against what geometry demands.

mod cutouts;
mod occluders;

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use scatter_core::{
    Camera, DepthMap, Frame, Light, Medium, Phase, ScatterImage, ShadowMap, VolumetricShadow,
};
use scatter_testing::Random;

use super::second_way::{PlainLight, PlainMedium, SecondWay};
use super::shadow_walk::ShadowWalk;
use super::*;
use crate::scene::Scene;

/// Random triangles around `centre`.
fn soup(random: &mut Random, count: u32, centre: DVec3) -> Scene {
    let mut scene = Scene::default();
    for index in 0..count {
        let middle = centre + random.in_cube(4.0);
        let size = random.range(0.3, 2.5);
        scene.positions.extend((0..3).map(|_| middle + random.in_cube(size)));
        scene.triangles.push([3 * index, 3 * index + 1, 3 * index + 2]);
    }
    scene
}

fn light_of(plain: PlainLight) -> Light {
    let strength = [1.0, 2.0, 0.5];
    match plain {
        PlainLight::Sun { travel } => Light::directional(travel.to_array(), strength),
        PlainLight::Lamp { position } => Light::point(position.to_array(), strength, 0.0),
        PlainLight::Spot { position, axis, inner_degrees, outer_degrees } => {
            Light::spot(position.to_array(), axis.to_array(), strength, inner_degrees, outer_degrees, 0.0)
        }
    }
    .unwrap()
}

/// A setting for both ways.
struct Setting {
    scene: Scene,
    light: PlainLight,
    medium: PlainMedium,
    camera: Camera,
    max_distance: f64,
}

impl Setting {
    /// Every pixel by both ways; the largest difference relative to the unoccluded value, which is at most `tolerance`
    /// where sampling did not merely miss a narrow stretch: 64 times as many samples would find it, or one in the
    /// middle of each stretch of the first way.
    fn check(&self, tolerance: f64) -> f64 {
        let light = light_of(self.light);
        let PlainMedium { sigma_s, sigma_a, g } = self.medium;
        let phase = Phase::henyey_greenstein(g).unwrap();
        let medium = Medium::homogeneous([sigma_s; 3], [sigma_a; 3], phase).unwrap();
        let [width, height] = self.camera.size();
        let texels = vec![f32::INFINITY; (width * height) as usize];
        let depth = DepthMap::new(&texels, [width, height]).unwrap();
        let frame =
            Frame::new(&self.camera, depth, &light, &ShadowMap::Unshadowed, &medium, self.max_distance)
                .unwrap();
        let caster = SceneCaster::new(&self.scene).unwrap();
        let mut truth = RaycastTruth::new(&caster);
        truth.render(&frame, &mut ScatterImage::new()).unwrap();
        let mut walk = ShadowWalk::default();
        let mut worst = 0.0f64;
        for (index, &end) in truth.ray_ends.iter().enumerate() {
            let ray = self.camera.pixel_ray(index as u32 % width, index as u32 / width);
            let second = SecondWay {
                scene: &self.scene,
                light: self.light,
                medium: self.medium,
                eye: self.camera.eye(),
                start: ray.origin,
                along: ray.direction,
            };
            let expected_end = second.ray_end(self.max_distance);
            assert!((end - expected_end).abs() <= tolerance * expected_end, "ray end {end} {expected_end}");
            let value = ray_radiance(&caster, &mut walk, &mut Dimming::default(), &frame, &ray, end);
            let bound = second.radiance(0.0, end).max(f64::MIN_POSITIVE);
            let error = |samples: usize, hints: &[f64]| {
                let lit = second.lit(end, samples, hints);
                let sum: f64 = lit.iter().map(|&(a, b)| second.radiance(a, b)).sum();
                (value - sum * DVec3::new(1.0, 2.0, 0.5)).abs().max_element() / bound
            };
            let mut difference = error(512, &[]);
            if difference > tolerance {
                let mut ends = vec![0.0, end];
                ends.extend(walk.spans.lit().flat_map(|(a, b)| [a, b]));
                ends.sort_by(f64::total_cmp);
                let hints: Vec<f64> = ends.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
                difference = error(32_768, &hints);
            }
            assert!(difference <= tolerance, "pixel {index}: {difference:e} of {bound:e}, value {value}");
            worst = worst.max(difference);
        }
        worst
    }
}

fn perspective(eye: DVec3, target: DVec3) -> Camera {
    let up = if (target - eye).normalize().y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
    Camera::perspective(eye.to_array(), target.to_array(), up.to_array(), 70.0, [5, 3]).unwrap()
}

fn random_setting(random: &mut Random, centre: DVec3, light: impl Fn(&mut Random) -> PlainLight) -> Setting {
    let count = random.range(20.0, 120.0) as u32;
    let scene = soup(random, count, centre);
    let (eye, target) = (centre + random.in_cube(6.0), centre + random.in_cube(2.0));
    let max_distance = random.range(5.0, 15.0);
    // Optical depths along the ray from 1e-6 to 1e3.
    let sigma_t = 10f64.powf(random.range(-6.0, 3.0)) / max_distance;
    let albedo = random.range(0.2, 1.0);
    let medium = PlainMedium {
        sigma_s: sigma_t * albedo,
        sigma_a: sigma_t * (1.0 - albedo),
        g: random.pick(&[0.0, 0.5, 0.95, -0.9]),
    };
    let camera = if random.range(0.0, 1.0) < 0.7 {
        perspective(eye, target)
    } else {
        let up = random.direction().to_array();
        Camera::orthographic(eye.to_array(), target.to_array(), up, 6.0, [5, 3]).unwrap()
    };
    Setting { light: light(random), scene, medium, camera, max_distance }
}

/// Bisection ends at a rounding of t, and a change of visibility where ray and edge meet at a small angle carries the
/// coordinates' rounding over that angle.
const TOLERANCE: f64 = 1e-9;
/// The same 1e5 units from the origin, where coordinates are rounded to 1.5e-11 of the scene's size.
const FAR_TOLERANCE: f64 = 1e-7;

#[test]
fn suns_agree_with_the_second_way() {
    let mut random = Random(1);
    for _ in 0..40 {
        random_setting(&mut random, DVec3::ZERO, |r| PlainLight::Sun { travel: r.direction() })
            .check(TOLERANCE);
    }
}

#[test]
fn lamps_agree_with_the_second_way() {
    let mut random = Random(2);
    for _ in 0..25 {
        random_setting(&mut random, DVec3::ZERO, |r| PlainLight::Lamp { position: r.in_cube(6.0) })
            .check(TOLERANCE);
    }
}

#[test]
fn spots_agree_with_the_second_way_also_with_coinciding_angles() {
    let mut random = Random(3);
    for round in 0..25 {
        let light = |r: &mut Random| {
            let outer_degrees = r.range(10.0, 90.0);
            let inner_degrees = if round % 2 == 0 { outer_degrees } else { r.range(0.0, outer_degrees) };
            let position = r.in_cube(6.0);
            let axis = (r.in_cube(2.0) - position).normalize();
            PlainLight::Spot { position, axis, inner_degrees, outer_degrees }
        };
        // At the edge of a cone a thousandth wide the factor, squared, amplifies the cosine's rounding.
        random_setting(&mut random, DVec3::ZERO, light).check(10.0 * TOLERANCE);
    }
}

#[test]
fn scenes_far_from_the_origin_lose_no_more_than_their_coordinates_rounding() {
    let mut random = Random(4);
    for distance in [1e4, 1e5] {
        for _ in 0..8 {
            let centre = random.direction() * distance;
            random_setting(&mut random, centre, |r| PlainLight::Sun { travel: r.direction() })
                .check(FAR_TOLERANCE);
            random_setting(&mut random, centre, |r| PlainLight::Lamp { position: centre + r.in_cube(6.0) })
                .check(FAR_TOLERANCE);
        }
    }
}

#[test]
fn a_stray_corner_does_not_make_all_boxes_overlap() {
    let mut random = Random(10);
    let scene = soup(&mut random, 4000, DVec3::ZERO);
    let mut strayed = scene.clone();
    strayed.positions[7] = DVec3::new(1e13, -3e12, 2e12);
    let camera = perspective(DVec3::new(9.0, 1.0, 2.0), DVec3::ZERO).with_size([16, 12]).unwrap();
    let light = light_of(PlainLight::Lamp { position: DVec3::new(0.5, 6.0, 0.3) });
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let texels = vec![f32::INFINITY; 192];
    let depth = DepthMap::new(&texels, [16, 12]).unwrap();
    let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 30.0).unwrap();
    let boxes = |scene: &Scene| {
        let caster = SceneCaster::new(scene).unwrap();
        let stats = RaycastTruth::new(&caster).render(&frame, &mut ScatterImage::new()).unwrap();
        stats.counts.get("boxes").unwrap()
    };
    let (without, with) = (boxes(&scene), boxes(&strayed));
    // One triangle more in every ray's way, and another tree. It was all boxes of all rays before.
    assert!(with < 2 * without, "{with} boxes, {without} without the stray");
}

#[test]
fn the_tree_loses_neither_shadow_nor_hit() {
    let mut random = Random(9);
    for round in 0..30 {
        let centre = random.direction() * random.pick(&[0.0, 1e3, 1e5]);
        let mut scene = soup(&mut random, 400, centre);
        // Every other scene with a sheet that dwarfs it: boxes are rounded to its coordinates.
        if round % 2 == 0 {
            let first = scene.positions.len() as u32;
            scene.positions.extend((0..3).map(|_| centre + random.in_cube(1e5)));
            scene.triangles.push([first, first + 1, first + 2]);
        }
        // Every third one with a corner 1e13 units away.
        if round % 3 == 0 {
            let corner = scene.positions.len() - 1 - round % 7;
            scene.positions[corner] = random.direction() * 1e13;
        }
        let caster = SceneCaster::new(&scene).unwrap();
        // Eyes within the scene, at its side and far outside.
        let eye = centre + random.direction() * random.pick(&[1.0, 8.0, 1e4]);
        let camera = perspective(eye, centre + random.in_cube(2.0)).with_size([9, 7]).unwrap();
        let light = light_of(match round % 3 {
            0 => PlainLight::Lamp { position: centre + random.in_cube(5.0) },
            1 => PlainLight::Sun { travel: random.direction() },
            // Within a milliradian of the view.
            _ => PlainLight::Sun { travel: ((centre - eye).normalize() + random.in_cube(5e-4)).normalize() },
        });
        let (mut walk, mut all) = (ShadowWalk::default(), ShadowWalk::default());
        for index in 0..63 {
            let ray = camera.pixel_ray(index % 9, index / 9);
            let light = LightOnRay::new(&light, eye, &ray);
            let crossings = (0..caster.triangle_count() as u32)
                .filter_map(|triangle| light.plane().cut(caster.corners(triangle))?.crossing());
            let first = crossings.filter(|&x| x > 0.0).fold(f64::INFINITY, f64::min);
            assert_eq!(caster.first_crossing(light.plane(), f64::INFINITY).unwrap_or(f64::INFINITY), first);
            let LightOnRay::Plane(shadow) = light else { continue };
            let end = first.min(2e4);
            walk.collect(&caster, &shadow, end);
            all.spans.reset(end);
            for triangle in 0..caster.triangle_count() as u32 {
                if let Some((low, high)) =
                    shadow.plane.cut(caster.corners(triangle)).and_then(|segment| shadow.shadow(&segment))
                {
                    all.spans.add(low, high);
                }
            }
            let (found, expected): (Vec<_>, Vec<_>) = (walk.spans.lit().collect(), all.spans.lit().collect());
            assert_eq!(found, expected, "round {round}, ray {index}");
        }
    }
}

#[test]
fn rays_of_a_wedge_find_the_shadows_of_all_triangles_to_the_bit() {
    let mut random = Random(11);
    let (mut shared, mut dropped) = (0, 0);
    for round in 0..40 {
        let centre = random.direction() * random.pick(&[0.0, 1e3, 1e5]);
        let mut scene = soup(&mut random, 600, centre);
        if round % 2 == 0 {
            // Sheets that hide much of it from the sun.
            for _ in 0..3 {
                let first = scene.positions.len() as u32;
                scene.positions.extend((0..3).map(|_| centre + random.in_cube(9.0)));
                scene.triangles.push([first, first + 1, first + 2]);
            }
        }
        if round % 5 == 0 {
            scene.positions[3] = random.direction() * 1e13;
        }
        if round % 4 == 1 {
            cutouts::cut_out(&mut random, &mut scene);
        }
        let caster = SceneCaster::new(&scene).unwrap();
        let eye = centre + random.direction() * random.pick(&[1.0, 8.0, 40.0]);
        let sun = Light::directional(random.direction().to_array(), [1.0; 3]).unwrap();
        let Light::Directional(directional) = &sun else { panic!() };
        let to_sun = -directional.direction();
        // Rays at all angles to the sun, within half of a thousandth of one half plane.
        let (middle, side) = to_sun.any_orthonormal_pair();
        let rays: Vec<WedgeRay> = (0..40)
            .filter_map(|_| {
                let (angle, turn) = (random.range(0.01, 3.13), random.range(-5e-4, 5e-4));
                let across = middle * f64::cos(turn) + side * f64::sin(turn);
                let along = (to_sun * f64::cos(angle) + across * f64::sin(angle)).normalize();
                let ray = ViewRay { origin: DVec3::ZERO, direction: along };
                let LightOnRay::Plane(shadow) = LightOnRay::new(&sun, eye, &ray) else { return None };
                let first = caster.first_crossing(&shadow.plane, f64::INFINITY);
                let end = first.unwrap_or(random.pick(&[3.0, 30.0, f64::INFINITY]));
                Some(WedgeRay { shadow, end })
            })
            .collect();
        let (mut wedge, mut walk, mut all) =
            (SunWedge::default(), ShadowWalk::default(), ShadowWalk::default());
        assert!(wedge.gather(&caster, eye, to_sun, &rays, &mut walk));
        for ray in &rays {
            wedge.collect(&caster, ray, &mut walk);
            all.spans.reset(ray.end);
            for triangle in 0..caster.triangle_count() as u32 {
                all.add(&caster, &ray.shadow, triangle);
            }
            let (found, expected): (Vec<_>, Vec<_>) = (walk.spans.lit().collect(), all.spans.lit().collect());
            assert_eq!(found, expected, "round {round}");
            shared += u32::from(expected.len() > 1);
        }
        dropped += all.counts.candidates - walk.counts.candidates;
    }
    assert!(shared > 100 && dropped > 500_000, "{shared} rays lit in pieces, {dropped} triangles left out");
}

#[test]
fn rays_parallel_to_the_sun_are_lit_whole_or_not_at_all() {
    let mut random = Random(5);
    for round in 0..40 {
        let mut setting = random_setting(&mut random, DVec3::ZERO, |_| PlainLight::Sun { travel: DVec3::X });
        // The camera's middle pixel looks straight at the sun, or straight away from it.
        let middle = setting.camera.pixel_ray(2, 1).direction;
        setting.light = PlainLight::Sun { travel: if round % 2 == 0 { -middle } else { middle } };
        // Few triangles, so that both outcomes occur.
        setting.scene.triangles.truncate(12);
        setting.check(TOLERANCE);
    }
}

#[test]
fn rays_through_the_lamp_see_it_up_to_the_first_surface() {
    let mut random = Random(6);
    for round in 0..30 {
        let mut setting =
            random_setting(&mut random, DVec3::ZERO, |_| PlainLight::Lamp { position: DVec3::ZERO });
        setting.camera = perspective(random.in_cube(5.0), random.in_cube(1.0));
        setting.scene.triangles.truncate(15);
        // In front of the eye or behind it, before max_distance or beyond.
        let along = setting.camera.pixel_ray(2, 1).direction;
        let distance = random.range(0.5, 20.0) * if round % 3 == 0 { -1.0 } else { 1.0 };
        setting.light = PlainLight::Lamp { position: setting.camera.eye() + distance * along };
        // The eye's distance times 1e-6 is the closest approach: the second way loses digits in its asinh.
        setting.check(1e-8);
    }
}

/// A sphere of triangles with every corner a vertex of its own, dented at random, in closed form watertight.
fn dented_sphere(random: &mut Random, rings: u32, centre: DVec3, radius: f64) -> Scene {
    let around = 2 * rings;
    let dents: Vec<f64> = (0..(rings + 1) * around).map(|_| random.range(0.5, 1.0)).collect();
    let turn = DMat3::from_axis_angle(random.direction(), random.range(0.0, TAU));
    let vertex = |ring: u32, step: u32| {
        let step = if ring == 0 || ring == rings { 0 } else { step % around };
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        let angle = TAU * f64::from(step) / f64::from(around);
        let unit = DVec3::new(polar.sin() * angle.cos(), polar.cos(), polar.sin() * angle.sin());
        centre + turn * (unit * (radius * dents[(ring * around + step) as usize]))
    };
    let mut scene = Scene::default();
    let mut add = |corners: [DVec3; 3]| {
        let first = scene.positions.len() as u32;
        scene.positions.extend(corners);
        scene.triangles.push([first, first + 1, first + 2]);
    };
    for ring in 0..rings {
        for step in 0..around {
            let [a, b] = [vertex(ring, step), vertex(ring, step + 1)];
            let [c, d] = [vertex(ring + 1, step), vertex(ring + 1, step + 1)];
            add([a, b, d]);
            add([a, d, c]);
        }
    }
    scene
}

fn brightest(scene: &Scene, camera: &Camera, light: &Light) -> f32 {
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let [width, height] = camera.size();
    let texels = vec![f32::INFINITY; (width * height) as usize];
    let depth = DepthMap::new(&texels, [width, height]).unwrap();
    let frame = Frame::new(camera, depth, light, &ShadowMap::Unshadowed, &medium, 1e3).unwrap();
    let caster = SceneCaster::new(scene).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
    image.inscattered().iter().flatten().copied().fold(0.0, f32::max)
}

#[test]
fn no_sliver_of_light_enters_a_closed_mesh() {
    let mut random = Random(7);
    for round in 0..24 {
        let distance = random.pick(&[0.0, 10.0, 1e4, 1e5]);
        let centre = random.direction() * distance;
        let scene = dented_sphere(&mut random, 3 + round % 20, centre, 3.0);
        let inside = centre + random.in_cube(0.2);
        let camera = perspective(inside, inside + random.direction()).with_size([64, 48]).unwrap();
        let outside = inside + 20.0 * random.direction();
        for light in [
            // From any side, from straight ahead and along the axes, where edges lie in the plane.
            Light::directional(random.direction().to_array(), [1e6; 3]).unwrap(),
            Light::directional((-camera.pixel_ray(32, 24).direction).to_array(), [1e6; 3]).unwrap(),
            Light::directional([0.0, -1.0, 0.0], [1e6; 3]).unwrap(),
            Light::point(outside.to_array(), [1e6; 3], 0.0).unwrap(),
        ] {
            assert_eq!(brightest(&scene, &camera, &light), 0.0, "round {round}, {light:?}");
        }
        // And none leaves one: the lamp inside, the camera outside.
        let lamp = Light::point(inside.to_array(), [1e6; 3], 0.0).unwrap();
        let camera = perspective(outside, centre).with_size([64, 48]).unwrap();
        assert_eq!(brightest(&scene, &camera, &lamp), 0.0, "round {round}, lamp inside");
    }
}

#[test]
fn an_axis_parallel_room_is_dark_although_edges_lie_in_the_planes() {
    // A cube whose edges, light and camera are all axis-parallel: zeros in every dot product.
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
    let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let mut scene = Scene { positions: (0..8).map(corner).collect(), ..Scene::default() };
    for [a, b, c, d] in quads {
        scene.triangles.extend([[a, b, c], [a, c, d]]);
    }
    for eye in [DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.25, -0.5, 0.75)] {
        let camera =
            Camera::perspective(eye.to_array(), (eye - DVec3::Z).to_array(), [0.0, 1.0, 0.0], 90.0, [33, 33]);
        for direction in
            [[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]
        {
            let sun = Light::directional(direction, [1.0; 3]).unwrap();
            assert_eq!(brightest(&scene, camera.as_ref().unwrap(), &sun), 0.0, "{eye} {direction:?}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let mut random = Random(8);
    let setting = random_setting(&mut random, DVec3::ZERO, |r| PlainLight::Sun { travel: r.direction() });
    let camera = setting.camera.with_size([37, 29]).unwrap();
    let light = light_of(setting.light);
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let texels = vec![f32::INFINITY; 37 * 29];
    let depth = DepthMap::new(&texels, [37, 29]).unwrap();
    let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 30.0).unwrap();
    let caster = SceneCaster::new(&setting.scene).unwrap();
    let mut truth = RaycastTruth::new(&caster);
    let mut render = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut image = ScatterImage::new();
        let stats = pool.install(|| truth.render(&frame, &mut image)).unwrap();
        (image, stats.counts)
    };
    let one = render(1);
    assert!(one.0.inscattered().iter().any(|rgb| rgb[0] > 0.0));
    assert_eq!(one, render(3));
    assert_eq!(one, render(8));
}

#[test]
fn an_occluder_beyond_max_distance_still_blocks() {
    // The camera looks along −z; a large sheet behind max_distance, the sun behind it.
    let mut scene = Scene { positions: vec![], ..Scene::default() };
    scene.positions = vec![
        DVec3::new(-500.0, -500.0, -50.0),
        DVec3::new(500.0, -500.0, -50.0),
        DVec3::new(0.0, 900.0, -50.0),
    ];
    scene.triangles = vec![[0, 1, 2]];
    let camera = perspective(DVec3::ZERO, DVec3::NEG_Z);
    let sun = |direction: [f64; 3]| Light::directional(direction, [1.0; 3]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let texels = [f32::INFINITY; 15];
    let depth = DepthMap::new(&texels, [5, 3]).unwrap();
    let caster = SceneCaster::new(&scene).unwrap();
    let value = |light: &Light, max_distance: f64| {
        let frame = Frame::new(&camera, depth, light, &ShadowMap::Unshadowed, &medium, max_distance).unwrap();
        let mut image = ScatterImage::new();
        RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
        (image.at(2, 1)[0], image.transmittance()[7][0])
    };
    for towards_the_viewer in [[0.0, 0.0, 1.0], [1e-3, 0.0, 1.0]] {
        assert_eq!(value(&sun(towards_the_viewer), 10.0), (0.0, (-1.0f64).exp() as f32));
    }
    // ∫₀¹⁰ 0.1·e^(−0.1t)/4π dt; an endless ray ends at the sheet, at 50.
    let lit = |end: f64| ((1.0 - (-0.1 * end).exp()) * scatter_core::INV_4PI) as f32;
    let away = sun([0.0, -0.3, -1.0]);
    assert_eq!(value(&away, 10.0), (lit(10.0), (-1.0f64).exp() as f32));
    assert_eq!(value(&away, f64::INFINITY), (lit(50.0), (-5.0f64).exp() as f32));
    assert_eq!(value(&away, 0.0), (0.0, 1.0));
    // A lamp behind the sheet, hidden although the ray ends before it.
    let lamp = Light::point([0.0, 0.0, -80.0], [1.0; 3], 0.0).unwrap();
    assert_eq!(value(&lamp, 10.0).0, 0.0);
}

#[test]
fn an_empty_scene_is_lit_everywhere() {
    let caster = SceneCaster::new(&Scene::default()).unwrap();
    let camera = perspective(DVec3::ONE, DVec3::ZERO);
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let sun = Light::directional([1.0, 0.0, 0.0], [1.0; 3]).unwrap();
    let texels = [f32::INFINITY; 15];
    let depth = DepthMap::new(&texels, [5, 3]).unwrap();
    let frame = Frame::new(&camera, depth, &sun, &ShadowMap::Unshadowed, &medium, f64::INFINITY).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
    assert!(image.inscattered().iter().flatten().all(|&l| l == scatter_core::INV_4PI as f32));
    assert!(image.transmittance().iter().flatten().all(|&t| t == 0.0));
}

#[test]
fn coloured_glass_multiplies_the_light_texel_by_texel() {
    use scatter_core::{LightTexture, MapProjection};
    // Light down −y; glass of two columns over x in [−1, 1): red and blue; white outside.
    let projection = MapProjection::orthographic(
        [0.0, 10.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 100.0],
        [2, 1],
    );
    let texels = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.5]];
    let texture = LightTexture::new(projection.unwrap(), &texels).unwrap();
    let caster = SceneCaster::new(&Scene::default()).unwrap();
    let camera = Camera::orthographic([-4.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0], 1.0, [1, 1]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
    let depth = DepthMap::new(&[f32::INFINITY], [1, 1]).unwrap();
    let frame = Frame::new(&camera, depth, &sun, &ShadowMap::Unshadowed, &medium, 10.0).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame.with_texture(&texture).unwrap(), &mut image).unwrap();
    let piece = |a: f64, b: f64| ((-0.1 * a).exp() - (-0.1 * b).exp()) * scatter_core::INV_4PI;
    // The map's u axis is forward × up = −y × z = −x: red lies on the far side of the ray, x in [0, 1).
    let white = piece(0.0, 3.0) + piece(5.0, 10.0);
    let expected = [white + piece(4.0, 5.0), white, white + 0.5 * piece(3.0, 4.0)];
    for (found, expected) in image.at(0, 0).into_iter().zip(expected) {
        // f32 rounding of the image.
        assert!((f64::from(found) / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    }
}
