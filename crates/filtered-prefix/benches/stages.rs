//! One group a stage: filtered rows, what they answer, and whole frames. Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use filtered_prefix::fourier::harmonics;
use filtered_prefix::moments::{MOST_POWERS, mass_below};
use filtered_prefix::projective::OwnMapSettings;
use filtered_prefix::{Basis, Fetch, Filter, FilteredPrefix, Options, Rectification};
use scatter_core::fearless_simd::f64x8;
use scatter_core::fearless_simd::prelude::*;
use scatter_core::{ScatterImage, VolumetricShadow, at_level, simd_level};
use scatter_testing::{Lighting, meadow};

/// The moments of two layers at −½ (a quarter of the light) and ½.
fn two_layers() -> [f64; MOST_POWERS] {
    std::array::from_fn(|power| 0.25 * (-0.5f64).powi(power as i32) + 0.75 * 0.5f64.powi(power as i32))
}

/// Mass below 0 of eight rows of two layers, a thousand times over.
fn bounds_of<const N: usize>(moments: &[f64; MOST_POWERS], z: f64) -> f64 {
    at_level!(simd_level(), simd => {
        let b = moments.map(|b| f64x8::splat(simd, b));
        let mut sum = f64x8::splat(simd, 0.0);
        for step in 0..1000 {
            let z = f64x8::splat(simd, z + 1e-5 * f64::from(step));
            let bounds = mass_below::<N, _, _>(simd, &b, z, 1e-6);
            sum = sum + bounds.least + bounds.width * 0.5;
        }
        sum.as_slice()[0] / 1000.0
    })
}

/// [`bounds_of`] of some number of moments.
type Bounds = fn(&[f64; MOST_POWERS], f64) -> f64;

fn answers(c: &mut Criterion) {
    let mut group = c.benchmark_group("eight-thousand-answers");
    let moments = two_layers();
    let ways: [(&str, Bounds); 3] = [("4", bounds_of::<2>), ("6", bounds_of::<3>), ("8", bounds_of::<4>)];
    for (count, bounds) in ways {
        let found = bounds(&moments, 0.0);
        assert!((found - 0.25).abs() < 1e-3, "{count}: {found}");
        group.bench_function(BenchmarkId::new("moments", count), |b| {
            b.iter(|| bounds(black_box(&moments), 0.0))
        });
    }
    group.finish();
}

fn basis(c: &mut Criterion) {
    let mut group = c.benchmark_group("sixteen-depths");
    for terms in [8, 16, 32, 64] {
        let z: [f32; 16] = std::array::from_fn(|lane| lane as f32 / 16.0);
        let sum = |z: &[f32; 16]| {
            let mut sum = 0.0;
            at_level!(simd_level(), harmonics(z, terms, |_, sines, cosines| sum += sines[8] + cosines[8]));
            sum
        };
        // sin((2k−1)·π/2) = ±1 in turn: their sum is 0.
        assert!(sum(&z).abs() < 1e-3);
        group.bench_function(BenchmarkId::new("harmonics", terms), |b| b.iter(|| sum(black_box(&z))));
    }
    group.finish();
}

fn frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame");
    let even = Options { target: None, spacing: 2.0, shared_columns: 0, ..Options::default() };
    let ways = [
        ("certified", even),
        ("certified, all filtered", Options { filter: Filter::Always, ..even }),
        ("6 moments", Options { certified: false, ..even }),
        ("4 moments", Options { certified: false, coefficients: 4, ..even }),
        ("fourier 32", Options { certified: false, basis: Basis::Fourier, coefficients: 32, ..even }),
    ];
    // Sources are not timed: the given map is resampled.
    let own = |fetch, coefficients, basis| Options {
        certified: false,
        rectification: Some(Rectification::Projective),
        own_map: OwnMapSettings { columns: 512, rows: 512, splits: 8 },
        fetch,
        coefficients,
        basis,
        ..even
    };
    let ways = ways.into_iter().chain([
        ("projective rows", Options { certified: true, ..own(Fetch::Exact, 6, Basis::Moments) }),
        ("one fetch, 6 moments", own(Fetch::Bilinear, 6, Basis::Moments)),
        ("one fetch, fourier 32", own(Fetch::Bilinear, 32, Basis::Fourier)),
    ]);
    let ways: Vec<_> = ways.collect();
    for lighting in [Lighting::Sun, Lighting::Point] {
        let scene = meadow(lighting, [320, 240], 512);
        scene.with(|frame| {
            for &(name, options) in &ways {
                let mut technique = FilteredPrefix::new(options);
                let mut image = ScatterImage::new();
                technique.render(frame, &mut image).expect("a frame that is supported");
                assert!(image.inscattered().iter().flatten().all(|value| value.is_finite()));
                group.bench_function(BenchmarkId::new(name, format!("{lighting:?}")), |b| {
                    b.iter(|| technique.render(black_box(frame), &mut image).map(|_| ()));
                });
            }
        });
    }
    group.finish();
}

criterion_group!(benches, answers, basis, frames);
criterion_main!(benches);
