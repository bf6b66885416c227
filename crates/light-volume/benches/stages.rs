//! One group a stage, by size: the meshes of both surfaces, static and adaptive, a whole frame in each way to accumulate, and a
//! lamp's airlight in each closed form.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use light_volume::airlight::{SunTable, exact_airlight};
use light_volume::volume::{HeightField, SteppedVolume, Tessellation, Tolerance};
use light_volume::{Accumulate, LightVolume, Options, Surface, Tessellation as Tessellates};
use scatter_core::{
    Camera, DepthMap, Frame, LampIntegralF32, LampRay, Light, MapProjection, Medium, Phase, RayLanes,
    ScatterImage, ShadowLayer, ShadowMap, ViewRay, VolumetricShadow, airlight, simd_level, walked_radiance,
};

const SUN: [f64; 3] = [0.3, -1.0, -0.2];

/// A map over 18 × 18 units: smooth hills with boards over them.
fn map(side: u32) -> (MapProjection, Vec<f32>) {
    let projection = MapProjection::orthographic([0.0, 8.0, 0.0], SUN, [0.1, 0.0, 1.0], [9.0; 2], [side; 2])
        .expect("sane");
    let texels = (0..side * side)
        .map(|n| {
            let (i, j) = (f64::from(n % side) / f64::from(side), f64::from(n / side) / f64::from(side));
            let hill = 9.0 + (9.0 * i).sin() + (7.0 * j).cos();
            (if (i * 11.0).fract() < 0.2 { hill - 4.0 } else { hill }) as f32
        })
        .collect();
    (projection, texels)
}

fn mesh(c: &mut Criterion) {
    let mut group = c.benchmark_group("mesh");
    group.sample_size(10);
    let ways = [
        ("static", Tessellation::Static),
        ("exact", Tessellation::Adaptive(Tolerance::EXACT)),
        ("adaptive", Tessellation::Adaptive(Tolerance { absolute: 0.02, relative: 0.0 })),
    ];
    for side in [512, 1024] {
        let (projection, texels) = map(side);
        let layer = ShadowLayer::new(projection, &texels).expect("sane");
        for (name, tessellation) in ways {
            let mut volume = SteppedVolume::default();
            volume.build(&layer, tessellation);
            // Hills have no two texels alike: a cap each, and about two walls.
            let least = if name == "adaptive" { 1 } else { u64::from(side) * u64::from(side) };
            assert!(volume.face_count() >= least, "{name}: {}", volume.face_count());
            group.bench_function(BenchmarkId::new(name, side), |b| {
                b.iter(|| volume.build(black_box(&layer), tessellation));
            });
        }
    }
    for side in [512, 1024] {
        let (projection, texels) = map(side);
        let layer = ShadowLayer::new(projection, &texels).expect("sane");
        for (name, tessellation) in ways {
            let mut field = HeightField::default();
            field.build(&layer, tessellation);
            let all = 2 * (u64::from(side) + 1) * (u64::from(side) + 1);
            let found = field.triangle_count();
            assert!(if name == "adaptive" { 4 * found < all } else { found <= all }, "{name}: {found}");
            group.bench_function(BenchmarkId::new(format!("interpolated-{name}"), side), |b| {
                b.iter(|| field.build(black_box(&layer), tessellation));
            });
        }
    }
    group.finish();
}

/// The lit interval `[1, 9]` of sixteen rays past a lamp: core's quadrature in f32, the exponential integral in f64, Sun's table.
fn lamp_airlight(c: &mut Criterion) {
    let mut group = c.benchmark_group("airlight-16");
    let sigma = 0.1;
    let medium = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).expect("sane");
    let position = glam::DVec3::new(0.5, 0.2, -6.0);
    let light = Light::point(position.to_array(), [1.0; 3], 0.0).expect("sane");
    let lamp = LampIntegralF32::new(&light, &medium, glam::DVec3::ZERO).expect("a lamp");
    let ray = |n: usize| ViewRay {
        origin: glam::DVec3::ZERO,
        direction: glam::DVec3::new(0.05 * n as f64 - 0.4, 0.1, -1.0).normalize(),
    };
    let rays = RayLanes::from_fn(ray);
    let lamps: Vec<LampRay> =
        (0..16).map(|n| LampRay::new(ray(n).origin, ray(n).direction, position, 0.0)).collect();
    let exact: Vec<f64> = lamps.iter().map(|lamp| airlight(sigma, *lamp, 1.0, 9.0)).collect();
    let (a, b) = ([1.0f32; 16], [9.0f32; 16]);
    let scale = sigma / (4.0 * std::f64::consts::PI);
    let found = lamp.intervals(simd_level(), &rays, &a, &b)[0];
    for (found, exact) in found.iter().zip(&exact) {
        assert!((f64::from(*found) / (exact * scale) - 1.0).abs() < 2e-5, "{found} {exact}");
    }
    group.bench_function("quadrature", |bencher| {
        bencher.iter(|| lamp.intervals(simd_level(), black_box(&rays), &a, &b));
    });
    for (lamp, exact) in lamps.iter().zip(&exact) {
        assert!((exact_airlight(sigma, *lamp, 1.0, 9.0) / exact - 1.0).abs() < 1e-12);
    }
    group.bench_function("exponential-integral", |bencher| {
        let all = || black_box(&lamps).iter().map(|lamp| exact_airlight(sigma, *lamp, 1.0, 9.0)).sum::<f64>();
        bencher.iter(all);
    });
    let table = SunTable::new(64, 10.0);
    for (lamp, exact) in lamps.iter().zip(&exact) {
        let found = f64::from(table.airlight(sigma as f32, *lamp, 1.0, 9.0));
        assert!((found / exact - 1.0).abs() < 5e-2, "{found} {exact}");
    }
    group.bench_function("sun-table", |bencher| {
        let of = |lamp: &LampRay| table.airlight(sigma as f32, *lamp, 1.0, 9.0);
        bencher.iter(|| black_box(&lamps).iter().map(of).sum::<f32>());
    });
    group.finish();
}

fn frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame");
    group.sample_size(10);
    let size = [640, 480];
    let camera =
        Camera::perspective([0.2, 0.1, 6.0], [0.1, 0.4, 0.0], [0.0, 1.0, 0.0], 60.0, size).expect("sane");
    let distances = vec![11.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size).expect("sane");
    let light = Light::directional(SUN, [1.0; 3]).expect("sane");
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).expect("sane");
    let (projection, texels) = map(1024);
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).expect("sane"));
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 50.0).expect("sane");
    let ways = [
        ("intervals", Accumulate::Intervals),
        ("shares", Accumulate::Shares),
        ("signed", Accumulate::Signed),
        ("signed-f32", Accumulate::SignedSingle),
    ];
    let surfaces = [
        ("interpolated-static", Tessellates::Static, 0.0),
        ("interpolated-exact", Tessellates::Adaptive, 0.0),
        ("interpolated-0.001", Tessellates::Adaptive, 0.001),
    ];
    let mut triangles = u64::MAX;
    for (name, tessellation, threshold) in surfaces {
        let options = Options { surface: Surface::Interpolated, tessellation, threshold, ..Options::exact() };
        let mut technique = LightVolume::new(options);
        let mut image = ScatterImage::new();
        let stats = technique.render(&frame, &mut image).expect("supported");
        let found = stats.counts.get("triangles").expect("counted");
        assert!(found <= triangles, "{name}: {found} of {triangles}");
        triangles = found;
        group.bench_function(name, |b| {
            b.iter(|| technique.render(black_box(&frame), &mut image).expect("supported"));
        });
    }
    for (name, accumulate) in ways {
        let mut technique = LightVolume::new(Options { accumulate, ..Options::exact() });
        let mut image = ScatterImage::new();
        technique.render(&frame, &mut image).expect("supported");
        let (found, exact) = (f64::from(image.at(320, 200)[0]), walked_radiance(&frame, 320, 200).x);
        assert!((found - exact).abs() <= 1e-4 * exact.max(1e-3), "{name}: {found} {exact}");
        group.bench_function(name, |b| {
            b.iter(|| technique.render(black_box(&frame), &mut image).expect("supported"));
        });
    }
    group.finish();
}

criterion_group!(benches, mesh, lamp_airlight, frame);
criterion_main!(benches);
