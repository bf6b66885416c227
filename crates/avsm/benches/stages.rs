//! One group a stage: curves built, curves looked up, maps streamed and a whole frame.
//!
//! Every benchmark asserts its answer once before it is timed. All curves are built of the same captured segments: 282 nodes of
//! smoke a texel.

use std::hint::black_box;

use avsm::{
    Avsm, AvsmCurve, DeepCurve, DepthRange, FourierCurve, LinearAvsm, MomentCurve, OpacityCurve, Options,
    Removal, TranslucentSegment, TransmittanceCurve, UncompressedCurve,
};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowMap, Translucent,
    TranslucentLayer, VolumetricShadow,
};

/// 141 segments of three puffs of smoke, in no order.
fn texel(seed: u32) -> Vec<TranslucentSegment> {
    let at = |n: u32| (f64::from(n * 37 + seed * 101) * 0.618_034).fract() as f32;
    (0..141)
        .map(|n| {
            let middle = [2.0, 7.0, 13.0][n as usize % 3] + 0.8 * at(n) - 0.4;
            let half = 0.02 + 0.15 * at(n + 500);
            TranslucentSegment {
                entry: middle - half,
                exit: middle + half,
                optical_depth: 0.03 * at(n + 900),
            }
        })
        .collect()
}

/// Eight nodes, removed in pairs.
#[derive(Default)]
struct LookAhead(AvsmCurve<8>);

impl TransmittanceCurve for LookAhead {
    fn insert(&mut self, segment: &TranslucentSegment) {
        self.0.insert_by(segment, Removal::LookAhead);
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        self.0.optical_depth(depth)
    }

    fn first_depth(&self) -> f32 {
        self.0.first_depth()
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self.0.visit(depths, each);
    }
}

fn built<C: TransmittanceCurve>(mut curve: C, segments: &[TranslucentSegment]) -> C {
    segments.iter().for_each(|segment| curve.insert(segment));
    curve.finish();
    curve
}

/// Building and looking up one kind of curve; `allowed` is its error at 64 depths.
fn kind<C: TransmittanceCurve>(c: &mut Criterion, name: &str, allowed: f64, make: impl Fn() -> C) {
    let segments = texel(1);
    let exact = built(UncompressedCurve::default(), &segments);
    let curve = built(make(), &segments);
    let depths: Vec<f64> = (0..64).map(|n| f64::from(n) * 0.25).collect();
    for &depth in &depths {
        let error = (curve.transmittance(depth) - exact.transmittance(depth)).abs();
        assert!(error <= allowed, "{name} at {depth}: {error}");
    }
    c.benchmark_group("build").bench_function(BenchmarkId::new(name, segments.len()), |b| {
        b.iter(|| built(make(), black_box(&segments)));
    });
    c.benchmark_group("lookup").bench_function(BenchmarkId::new(name, depths.len()), |b| {
        b.iter(|| depths.iter().map(|&depth| curve.optical_depth(black_box(depth))).sum::<f64>());
    });
}

fn curves(c: &mut Criterion) {
    let range = DepthRange::of(&texel(1));
    kind(c, "avsm-4", 0.5, AvsmCurve::<4>::default);
    kind(c, "avsm-8", 0.1, AvsmCurve::<8>::default);
    kind(c, "avsm-12", 0.05, AvsmCurve::<12>::default);
    kind(c, "avsm-16", 0.05, AvsmCurve::<16>::default);
    kind(c, "avsm-8-look-ahead", 0.15, LookAhead::default);
    kind(c, "avsm-8-linear", 0.1, LinearAvsm::<8>::default);
    kind(c, "opacity-32", 0.1, || OpacityCurve::<32>::new(range));
    kind(c, "fourier-16", 0.1, || FourierCurve::<16>::new(range));
    kind(c, "moments-4", 0.5, || MomentCurve::<5>::new(range));
    kind(c, "moments-8", 0.5, || MomentCurve::<9>::new(range));
    kind(c, "deep-0.01", 0.01, || DeepCurve::new(0.01));
    kind(c, "deep-0.002", 0.002, || DeepCurve::new(0.002));
    kind(c, "uncompressed", 1e-6, UncompressedCurve::default);
}

fn frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame");
    group.sample_size(10);
    let size = [320, 240];
    let camera =
        Camera::perspective([0.2, 0.1, 6.0], [0.1, 0.4, 0.0], [0.0, 1.0, 0.0], 60.0, size).expect("sane");
    let distances = vec![11.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size).expect("sane");
    let sun = [0.3, -1.0, -0.2];
    let light = Light::directional(sun, [1.0; 3]).expect("sane");
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).expect("sane");
    for side in [64, 256] {
        let map = MapProjection::orthographic([0.0, 8.0, 0.0], sun, [0.1, 0.0, 1.0], [4.0; 2], [side; 2])
            .expect("sane");
        // Twenty segments in every texel of the middle.
        let (mut offsets, mut segments) = (vec![0], Vec::new());
        for texel_index in 0..side * side {
            let [x, y] = [texel_index % side, texel_index / side].map(|at| (4 * at / side) % 3 > 0);
            if x && y {
                segments.extend_from_slice(&texel(texel_index % 7)[..20]);
            }
            offsets.push(segments.len() as u32);
        }
        let layers = [TranslucentLayer::new(map, &offsets, &segments).expect("sane")];
        let smoke = Translucent::Captured(&layers);
        let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 30.0)
            .expect("sane")
            .with_translucent(&smoke)
            .expect("sane");
        let mut technique = Avsm::new(Options::default());
        let mut image = ScatterImage::new();
        technique.render(&frame, &mut image).expect("supported");
        let lit: f32 = image.inscattered().iter().map(|pixel| pixel[0]).sum();
        assert!(lit > 0.0);
        group.bench_function(BenchmarkId::new("avsm-8", side), |b| {
            b.iter(|| technique.render(black_box(&frame), &mut image));
        });
    }
    group.finish();
}

criterion_group!(stages, curves, frame);
criterion_main!(stages);
