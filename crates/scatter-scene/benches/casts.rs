//! The price of ray casts: tree, depth map, shadow maps and ray-cast truth, on generated scenes.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowMap, VolumetricShadow,
};
use scatter_scene::{RaycastTruth, Scene, SceneCaster};

/// A room, open on top, under a grid of `count`² leaves, each a triangle turned by its number.
fn canopy(count: u32) -> Scene {
    let mut scene = Scene::default();
    let mut add = |corners: [DVec3; 3]| {
        let first = scene.positions.len() as u32;
        scene.positions.extend(corners);
        scene.triangles.push([first, first + 1, first + 2]);
    };
    let floor = [DVec3::new(-30.0, 0.0, -30.0), DVec3::new(30.0, 0.0, -30.0), DVec3::new(0.0, 0.0, 60.0)];
    add(floor);
    let spacing = 20.0 / f64::from(count);
    for i in 0..count {
        for j in 0..count {
            let turn = f64::from(i * 7919 + j * 104_729) * 0.1;
            let height = 6.0 + 2.0 * (turn * 0.37).sin();
            let middle = DVec3::new(f64::from(i) * spacing - 10.0, height, f64::from(j) * spacing - 10.0);
            let corner = |k: f64| {
                let angle = turn + k * std::f64::consts::TAU / 3.0;
                middle + 0.6 * spacing * DVec3::new(angle.cos(), 0.3 * (angle + turn).sin(), angle.sin())
            };
            add([corner(0.0), corner(1.0), corner(2.0)]);
        }
    }
    scene
}

fn camera(size: [u32; 2]) -> Camera {
    Camera::perspective([-9.0, 1.5, -8.0], [2.0, 3.0, 1.0], [0.0, 1.0, 0.0], 60.0, size).unwrap()
}

fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for count in [32, 128] {
        let scene = canopy(count);
        assert_eq!(SceneCaster::new(&scene).unwrap().triangle_count(), (count * count) as usize + 1);
        group.bench_with_input(BenchmarkId::from_parameter(scene.triangles.len()), &scene, |b, scene| {
            b.iter(|| black_box(SceneCaster::new(scene).unwrap().triangle_count()));
        });
    }
    group.finish();
}

fn maps(c: &mut Criterion) {
    let caster = SceneCaster::new(&canopy(128)).unwrap();
    let mut group = c.benchmark_group("maps");
    group.sample_size(10);
    let mut out = Vec::new();
    let camera = camera([320, 240]);
    caster.depth_map(&camera, &mut out);
    assert!(out.iter().any(|d| d.is_finite()), "the camera sees the canopy");
    group.bench_function("depth/320x240", |b| b.iter(|| caster.depth_map(&camera, &mut out)));
    let sun =
        MapProjection::orthographic([0.0, 20.0, 0.0], [0.1, -1.0, 0.2], [0.0, 0.0, 1.0], [10.0; 2], [256; 2])
            .unwrap();
    caster.shadow_map(&sun, &mut out).unwrap();
    assert!(out.iter().all(|d| d.is_finite()), "the floor ends every ray");
    group.bench_function("orthographic/256", |b| b.iter(|| caster.shadow_map(&sun, &mut out).unwrap()));
    caster.cube_map([0.0, 4.0, 0.0], 128, &mut out).unwrap();
    // Face −Y: the floor, 4 units below.
    assert!((out[3 * 128 * 128 + 64 * 128 + 64] - 4.0).abs() < 1e-5);
    group.bench_function("cube/128", |b| {
        b.iter(|| caster.cube_map([0.0, 4.0, 0.0], 128, &mut out).unwrap());
    });
    group.finish();
}

fn truth(c: &mut Criterion) {
    let caster = SceneCaster::new(&canopy(128)).unwrap();
    let size = [80, 60];
    let camera = camera(size);
    let medium = Medium::homogeneous([0.05; 3], [0.0; 3], Phase::HenyeyGreenstein { g: 0.5 }).unwrap();
    let texels = vec![f32::INFINITY; 80 * 60];
    let depth = DepthMap::new(&texels, size).unwrap();
    let mut group = c.benchmark_group("truth/80x60");
    group.sample_size(10);
    for (name, light) in [
        ("sun", Light::directional([0.3, -1.0, 0.2], [1.0; 3]).unwrap()),
        ("point", Light::point([1.0, 9.5, 0.0], [50.0; 3], 0.0).unwrap()),
    ] {
        let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 40.0).unwrap();
        let mut truth = RaycastTruth::new(&caster);
        let mut image = ScatterImage::new();
        let stats = truth.render(&frame, &mut image).unwrap();
        // Between total darkness and what an empty scene would give.
        let sum = |image: &ScatterImage| image.inscattered().iter().map(|rgb| rgb[0]).sum::<f32>();
        let empty = SceneCaster::new(&Scene::default()).unwrap();
        let mut lit = ScatterImage::new();
        RaycastTruth::new(&empty).render(&frame, &mut lit).unwrap();
        assert!(sum(&image) > 0.0 && sum(&image) < 0.9 * sum(&lit));
        assert!(stats.counts.get("intervals").is_some_and(|count| count > 0));
        group.bench_function(name, |b| b.iter(|| truth.render(&frame, &mut image).unwrap()));
    }
    group.finish();
}

criterion_group!(benches, build, maps, truth);
criterion_main!(benches);
