//! The price of one lit interval: directional, point and spot, with and without a phase function, f64 and f32.
//!
//! Each bench goes over the same 1,024 intervals; divide by 1,024 for ns each.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use scatter_core::{
    LampIntegralF32, Light, Medium, Phase, RayLight, ViewRay, exp_f32, sun_interval, sun_interval_f32,
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
            let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO, &ray).expect("a lamp");
            let sum: f64 = intervals.iter().map(|&(a, b)| exact.interval(a, b).x).sum();
            let fast_sum: f32 = intervals.iter().map(|&(a, b)| fast.interval(a as f32, b as f32).x).sum();
            assert!((f64::from(fast_sum) / sum - 1.0).abs() < 1e-4);
            let id = format!("{kind}/{phase_name}");
            group.bench_with_input(BenchmarkId::new("f64", &id), &exact, |b, exact| {
                b.iter(|| black_box(&intervals).iter().map(|&(a, b)| exact.interval(a, b).x).sum::<f64>())
            });
            group.bench_with_input(BenchmarkId::new("f32", &id), &fast, |b, fast| {
                b.iter(|| {
                    black_box(&intervals)
                        .iter()
                        .map(|&(a, b)| fast.interval(a as f32, b as f32).x)
                        .sum::<f32>()
                })
            });
        }
    }
    group.finish();
}

criterion_group!(benches, sun, lamp);
criterion_main!(benches);
