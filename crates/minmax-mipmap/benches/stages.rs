//! One group a stage of exact mode, by size: the mipmap, and a whole frame at every instruction set.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use minmax_mipmap::{DepthCodes, MinMaxMipmap, MinMaxTree, Options};
use scatter_core::{
    Camera, DepthMap, Frame, Level, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer,
    ShadowMap, VolumetricShadow, simd_level, walked_radiance,
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

fn mipmap(c: &mut Criterion) {
    let mut group = c.benchmark_group("mipmap");
    for side in [1024, 4096] {
        let (projection, texels) = map(side);
        let layer = ShadowLayer::new(projection, &texels).expect("sane");
        let (simd, codes) = (simd_level(), DepthCodes::new([2.0, 14.0], false));
        let mut tree = MinMaxTree::default();
        tree.build(simd, &layer, codes);
        // The block of the first texel holds it.
        let code = codes.of_point(texels[0].into());
        let node = tree.node(tree.finest(), 0, 0);
        assert!(node.nearest() <= code && code <= node.farthest());
        group.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter(|| tree.build(simd, black_box(&layer), codes));
        });
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
    for side in [1024, 4096] {
        let (projection, texels) = map(side);
        let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).expect("sane"));
        let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 30.0).expect("sane");
        for (name, simd) in [("widest", simd_level()), ("portable", Level::baseline())] {
            let mut technique = MinMaxMipmap::with_simd(Options::default(), simd);
            let mut image = ScatterImage::new();
            technique.render(&frame, &mut image).expect("supported");
            let exact = walked_radiance(&frame, 300, 200).x;
            assert!((f64::from(image.at(300, 200)[0]) - exact).abs() <= 1e-5 * exact);
            group.bench_function(BenchmarkId::new(name, side), |b| {
                b.iter(|| technique.render(black_box(&frame), &mut image));
            });
        }
    }
    group.finish();
}

criterion_group!(stages, mipmap, frame);
criterion_main!(stages);
