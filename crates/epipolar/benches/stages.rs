//! One group a stage of epipolar integration, by size: slices, rectification, summation, factors, a whole frame.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use epipolar::baran::sums::problem::{Problem, Queries, Runs, SumScratch, Terms};
use epipolar::baran::sums::{SumAlgorithm, sum_lit_runs};
use epipolar::baran::{Factorisation, Factors, LampBands, LampMedium};
use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::{ColumnOrder, Epipole, Major, Slice, SliceSet};
use epipolar::rows::{MinMaxTiles, Row};
use epipolar::{Epipolar, Options, SampledCells};
use glam::{DVec2, DVec3};
use scatter_core::{
    Camera, DepthMap, Frame, Level, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer,
    ShadowMap, VolumetricShadow, simd_level,
};
use scatter_testing::Random;

const SUN: [f64; 3] = [0.3, -1.0, -0.2];

fn slices(c: &mut Criterion) {
    let mut group = c.benchmark_group("slices");
    for size in [[320, 240], [1280, 960]] {
        let middle = DVec3::new(0.5 * f64::from(size[0]), 0.5 * f64::from(size[1]), 1.0);
        let epipole = Epipole { image: middle, to_light: DVec3::Z, outward: true, too_near: 0.03 };
        let mut set = SliceSet::default();
        set.distribute(&epipole, size, 1.0);
        // 13.3 % fewer than pixels of the perimeter, and two a fan.
        let formula = 0.867 * 2.0 * f64::from(size[0] + size[1]);
        assert!((set.slices.len() as f64 - formula).abs() < 20.0);
        group.bench_function(BenchmarkId::from_parameter(size[0]), |b| {
            b.iter(|| set.distribute(black_box(&epipole), size, 1.0));
        });
    }
    group.finish();
}

fn camera(size: [u32; 2]) -> Camera {
    Camera::perspective([0.2, 0.1, 6.0], [0.1, 0.4, 0.0], [0.0, 1.0, 0.0], 60.0, size).expect("sane")
}

fn map(side: u32) -> (MapProjection, Vec<f32>) {
    let projection = MapProjection::orthographic([0.0, 8.0, 0.0], SUN, [0.1, 0.0, 1.0], [9.0; 2], [side; 2])
        .expect("sane");
    // Smooth hills with boards over them.
    let texels = (0..side * side)
        .map(|n| {
            let (i, j) = (f64::from(n % side) / f64::from(side), f64::from(n / side) / f64::from(side));
            let hill = 9.0 + (9.0 * i).sin() + (7.0 * j).cos();
            (if (i * 11.0).fract() < 0.2 { hill - 4.0 } else { hill }) as f32
        })
        .collect();
    (projection, texels)
}

fn rectify(c: &mut Criterion) {
    let mut group = c.benchmark_group("rectify");
    let size = [1280, 960];
    let camera = camera(size);
    let light = Light::directional(SUN, [1.0; 3]).expect("sane");
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).expect("sane");
    let distances = vec![11.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size).expect("sane");
    let epipole = Epipole::new(&camera, &light);
    let exit = DVec2::new(700.3, 960.0);
    let line = Slice::through(&epipole, Major::Y, exit);
    let order =
        ColumnOrder { columns: [0, 960], ascending: epipole.outward == (epipole.towards(exit).y > 0.0) };
    for side in [512, 1024, 2048] {
        let (projection, texels) = map(side);
        let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).expect("sane"));
        let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 30.0).expect("sane");
        let mut tiles = MinMaxTiles::default();
        tiles.rebuild(simd_level(), &shadow);
        for (name, cells) in [
            ("exact", None),
            ("uniform", Some(SampledCells::Uniform)),
            ("modes", Some(SampledCells::Modes)),
            ("box", Some(SampledCells::Box)),
        ] {
            let mut row = Row::default();
            row.clear(8 * side as usize + 8 * 960);
            let mut fill = |simd: Level| {
                let mut angles = SliceAngles::default();
                let scene = SliceScene { frame: &frame, epipole, tiles: &tiles, simd };
                let slice = SliceView::new(scene, black_box(line), Major::Y, order, &mut angles).up_to(1e3);
                match cells {
                    None => slice.rectify(0.0, &mut row),
                    Some(cells) => cells.rectify(&slice, &mut row),
                };
                row.len()
            };
            // Hills and boards are told apart, and the instruction set changes nothing.
            let runs = fill(simd_level());
            assert!(runs > 20 && runs == fill(Level::baseline()), "{name}: {runs} runs");
            group.bench_function(BenchmarkId::new(name, side), |b| b.iter(|| fill(simd_level())));
        }
    }
    group.finish();
}

/// Lit columns of `d` light rays before `r` view rays, by what stands in the light.
fn lit(kind: &str, r: u32, d: usize) -> Vec<u32> {
    let mut random = Random(7);
    (0..d)
        .map(|ray| match kind {
            "smooth" => (0.5 + 0.4 * (ray as f64 * 9.0 / d as f64).sin()) * f64::from(r),
            "bars" => f64::from(r) * if (ray * 24 / d).is_multiple_of(2) { 1.0 } else { 0.3 },
            _ => f64::from(random.below(r + 1)),
        } as u32)
        .collect()
}

fn sums<const N: usize>(c: &mut Criterion, kind: &str, r: u32, d: usize) {
    let mut group = c.benchmark_group(format!("integrate/{kind}/rank {N}"));
    // Neighbouring light rays that end alike are one run, as rows have them.
    let (mut runs, mut prefix) = (Vec::new(), Vec::<Terms<N>>::new());
    for (ray, lit) in lit(kind, r, d).into_iter().enumerate() {
        if runs.last() != Some(&lit) {
            runs.push(lit);
            prefix.push(std::array::from_fn(|term| (ray as f32 / d as f32).powi(term as i32 + 1)));
        }
    }
    prefix.push([1.0; N]);
    let ranks: Vec<u32> = (0..r).collect();
    let mut random = Random(3);
    let ends_in: Vec<u32> = (0..r).map(|_| random.below(runs.len() as u32)).collect();
    let ends: Vec<Terms<N>> = ends_in
        .iter()
        .map(|&run| {
            let (a, b) = (&prefix[run as usize], &prefix[run as usize + 1]);
            std::array::from_fn(|term| 0.5 * (a[term] + b[term]))
        })
        .collect();
    let problem = Problem {
        runs: Runs { lit: &runs, prefix: &prefix, colour: None, columns: [0, r] },
        queries: Queries { ranks: &ranks, runs: &ends_in },
        ends: &ends,
        ascending: true,
    };
    let mut scratch = SumScratch::default();
    scratch.reserve(runs.len(), r as usize, r as usize, N);
    let mut expected = vec![[0.0f32; N]; r as usize];
    sum_lit_runs(SumAlgorithm::Direct, &problem, &mut scratch, &mut expected);
    let mut out = expected.clone();
    for algorithm in SumAlgorithm::ALL {
        sum_lit_runs(algorithm, &problem, &mut scratch, &mut out);
        for (a, b) in out.iter().zip(&expected) {
            // Sums of a few thousand f32 below 1, in another order.
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{algorithm:?}");
        }
        group.bench_function(BenchmarkId::new(format!("{algorithm:?}"), format!("{r}x{d}")), |b| {
            b.iter(|| sum_lit_runs(algorithm, black_box(&problem), &mut scratch, &mut out));
        });
    }
    group.finish();
}

fn integrators(c: &mut Criterion) {
    for kind in ["smooth", "bars", "random"] {
        for (r, d) in [(512, 1024), (640, 2048), (900, 4096)] {
            sums::<1>(c, kind, r, d);
            sums::<4>(c, kind, r, d);
        }
    }
}

fn factor(c: &mut Criterion) {
    let mut group = c.benchmark_group("factor");
    for &kind in Factorisation::ALL {
        let mut factors = Factors::sun(kind, 4, 1.0, 2.0);
        // Four terms leave less than 0.2 % of an octave at an optical depth of 1.
        assert!(factors.rank() == 4 && factors.bound() < 2e-3);
        group.bench_function(format!("sun {kind:?}"), |b| {
            b.iter(|| factors.rebuild(kind, 4, black_box(1.0), 2.0));
        });
    }
    let phase = |haversine: f64| 1.0 + haversine;
    let medium = LampMedium { optical_depth: 0.5, reach: 2.0, phase: &phase };
    let mut bands = LampBands::default();
    bands.rebuild(&medium, 0.1, 1.5, 8, 3e-3);
    assert!(bands.error() <= 3e-3 && !bands.bands().is_empty());
    group.bench_function("lamp", |b| b.iter(|| bands.rebuild(black_box(&medium), 0.1, 1.5, 8, 3e-3)));
    group.finish();
}

fn frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame");
    group.sample_size(10);
    for size in [[160, 120], [640, 480]] {
        let camera = camera(size);
        let (projection, texels) = map(1024);
        let layer = ShadowLayer::new(projection, &texels).expect("sane");
        let shadow = ShadowMap::Orthographic(layer);
        let distances = vec![11.0f32; (size[0] * size[1]) as usize];
        let depth = DepthMap::new(&distances, size).expect("sane");
        let medium = Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Isotropic).expect("sane");
        let light = Light::directional(SUN, [1.0; 3]).expect("sane");
        let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 30.0).expect("sane");
        let mut technique = Epipolar::new(Options::default());
        let mut image = ScatterImage::new();
        technique.render(&frame, &mut image).expect("supported");
        // Between darkness and E·σs/4π·(1 − e^{−σd})/σ, and not everywhere either.
        let whole = (0.08 / (4.0 * std::f64::consts::PI) * (1.0 - (-0.09f64 * 11.0).exp()) / 0.09) as f32;
        let values: Vec<f32> = image.inscattered().iter().map(|pixel| pixel[0]).collect();
        assert!(values.iter().all(|&value| value >= 0.0 && value <= whole * 1.001));
        assert!(values.iter().any(|&value| value < 0.9 * whole));
        group.bench_function(BenchmarkId::from_parameter(size[0]), |b| {
            b.iter(|| technique.render(black_box(&frame), &mut image).expect("supported"));
        });
    }
    group.finish();
}

criterion_group!(benches, slices, rectify, integrators, factor, frame);
criterion_main!(benches);
