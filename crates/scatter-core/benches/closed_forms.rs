//! The price of one lit interval: directional, point and spot, with and without a phase function, f64 and f32.
//!
//! Each bench goes over the same 1,024 intervals; divide by 1,024 for ns each. `lamp_pixels` are 4,096 pixels with the lamp
//! in view instead, from the eye to a surface, as a technique asks for their unoccluded light.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use scatter_core::{
    Camera, LampIntegralF32, Light, Medium, Phase, RayLanes, RayLight, ViewRay, exp_f32, simd_level,
    sun_interval, sun_interval_f32,
};

const COUNT: usize = 1024;

/// Intervals of a ray of length 20, from short to long.
fn intervals() -> Vec<(f64, f64)> {
    (0..COUNT)
        .map(|n| {
            let start = 10.0 * (n as f64 / COUNT as f64);
            (start, start + 10f64.powf(-2.0 + 3.0 * ((n * 37 % COUNT) as f64 / COUNT as f64)))
        })
        .collect()
}

fn sun(c: &mut Criterion) {
    let intervals = intervals();
    let narrow: Vec<(f32, f32)> = intervals.iter().map(|&(a, b)| (a as f32, b as f32)).collect();
    let exact: f64 = intervals.iter().map(|&(a, b)| sun_interval(0.1, a, b)).sum();
    let fast: f32 = narrow.iter().map(|&(a, b)| sun_interval_f32(0.1, a, b)).sum();
    assert!((f64::from(fast) / exact - 1.0).abs() < 1e-5);
    let mut group = c.benchmark_group("sun_interval");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.bench_function("f64", |b| {
        b.iter(|| black_box(&intervals).iter().map(|&(a, b)| sun_interval(0.1, a, b)).sum::<f64>())
    });
    group.bench_function("f32", |b| {
        b.iter(|| black_box(&narrow).iter().map(|&(a, b)| sun_interval_f32(0.1, a, b)).sum::<f32>())
    });
    group.bench_function("exp_f32", |b| {
        b.iter(|| black_box(&narrow).iter().map(|&(a, _)| exp_f32(-a)).sum::<f32>())
    });
    group.finish();
}

fn lamp(c: &mut Criterion) {
    let intervals = intervals();
    let narrow: Vec<(f32, f32)> = intervals.iter().map(|&(a, b)| (a as f32, b as f32)).collect();
    let position = [0.1, 0.5, -8.0];
    let lights = [
        ("point", Light::point(position, [1.0; 3], 0.0)),
        ("spot", Light::spot(position, [0.1, -1.0, 0.2], [1.0; 3], 20.0, 40.0, 0.0)),
    ];
    let mut group = c.benchmark_group("lamp_interval");
    group.throughput(Throughput::Elements(COUNT as u64));
    for (kind, light) in lights {
        let light = light.expect("the bench's light is sane");
        for (phase_name, phase) in
            [("isotropic", Phase::Isotropic), ("hg", Phase::HenyeyGreenstein { g: 0.7 })]
        {
            let medium = Medium::homogeneous([0.1; 3], [0.0; 3], phase).expect("the bench's medium is sane");
            let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
            let exact = RayLight::new(&light, &medium, DVec3::ZERO, &ray);
            let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO).expect("a lamp");
            let rays = RayLanes::from_fn(|_| ray);
            let simd = simd_level();
            let sum_fast = |intervals: &[(f32, f32)]| -> f32 {
                let sums = intervals.as_chunks::<{ RayLanes::COUNT }>().0.iter().map(|chunk| {
                    let [a, b] = [chunk.map(|interval| interval.0), chunk.map(|interval| interval.1)];
                    fast.intervals(simd, &rays, &a, &b)[0].iter().sum::<f32>()
                });
                sums.sum()
            };
            let sum: f64 = intervals.iter().map(|&(a, b)| exact.interval(a, b).x).sum();
            assert!((f64::from(sum_fast(&narrow)) / sum - 1.0).abs() < 1e-4);
            let id = format!("{kind}/{phase_name}");
            group.bench_with_input(BenchmarkId::new("f64", &id), &exact, |b, exact| {
                b.iter(|| black_box(&intervals).iter().map(|&(a, b)| exact.interval(a, b).x).sum::<f64>())
            });
            group.bench_with_input(BenchmarkId::new("f32", &id), &narrow, |b, narrow| {
                b.iter(|| sum_fast(black_box(narrow)))
            });
        }
    }
    group.finish();
}

fn lamp_pixels(c: &mut Criterion) {
    const SIZE: [u32; 2] = [64, 64];
    let up = [0.0, 1.0, 0.0];
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], up, 65.0, SIZE).expect("a sane camera");
    let position = [0.7, 0.5, -4.0];
    let lights = [
        ("point", Light::point(position, [1.0; 3], 0.0)),
        ("spot", Light::spot(position, [-0.3, -1.0, 0.1], [1.0; 3], 24.0, 30.0, 0.0)),
    ];
    let end = |x: u32, y: u32| 6.0 + 0.05 * (x as f32) + 0.03 * (y as f32);
    let simd = simd_level();
    let mut group = c.benchmark_group("lamp_pixels");
    group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1])));
    for (kind, light) in lights {
        let light = light.expect("the bench's light is sane");
        let lobe = Phase::HenyeyGreenstein { g: 0.4 };
        for (air, sigma_s, phase) in [
            ("isotropic", [0.1; 3], Phase::Isotropic),
            ("hg", [0.1; 3], lobe),
            ("rgb", [0.05, 0.1, 0.2], lobe),
        ] {
            let medium = Medium::homogeneous(sigma_s, [0.0; 3], phase).expect("the bench's medium is sane");
            let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO).expect("a lamp");
            let sixteen = |x: u32, y: u32| {
                let ends = std::array::from_fn(|lane| end(x + lane as u32, y));
                fast.intervals(simd, &RayLanes::of_pixels(&camera, x, y), &[0.0; RayLanes::COUNT], &ends)
            };
            let exact = RayLight::new(&light, &medium, DVec3::ZERO, &camera.pixel_ray(30, 45));
            let exact = exact.interval(0.0, end(30, 45).into()).x;
            assert!((f64::from(sixteen(16, 45)[0][14]) / exact - 1.0).abs() < 1e-4);
            group.bench_function(BenchmarkId::new(air, kind), |b| {
                b.iter(|| {
                    for y in 0..SIZE[1] {
                        for x in (0..SIZE[0]).step_by(RayLanes::COUNT) {
                            black_box(sixteen(x, y));
                        }
                    }
                })
            });
        }
    }
    group.finish();
}

criterion_group!(benches, sun, lamp, lamp_pixels);
criterion_main!(benches);
