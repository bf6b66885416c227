//! One group a stage, by size: the mesh, static and adaptive, and a whole frame in each way to accumulate.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use light_volume::volume::{SteppedVolume, Tessellation, Tolerance};
use light_volume::{Accumulate, LightVolume, Options};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer, ShadowMap,
    VolumetricShadow, walked_radiance,
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

criterion_group!(benches, mesh, frame);
criterion_main!(benches);
