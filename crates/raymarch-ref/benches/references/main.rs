//! The march in ns a sample (criterion's time over its elements), the walk with and without its tree.
//!
//! Each answer is checked once before it is timed. `SCATTER_SIMD=baseline` measures the portable path; the thread
//! count is rayon's (`RAYON_NUM_THREADS`).

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use raymarch_ref::{Distribution, Options, RayMarch, ShadowMapWalk};
use scatter_core::{ScatterImage, VolumetricShadow};
use scatter_testing::{Lighting, OwnedFrame, meadow, rel_rmse};

/// Pixels of a benched image: enough that its rays fan out over the whole map.
const SIZE: [u32; 2] = [640, 480];

fn options(steps: u32, distribution: Distribution) -> Options {
    Options { steps, jitter: None, distribution }
}

/// Times a march of known accuracy.
fn bench_march(
    c: &mut Criterion,
    group: &str,
    name: BenchmarkId,
    meadow: &OwnedFrame,
    march: Options,
    most: f64,
) {
    let mut group = c.benchmark_group(group);
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1]) * u64::from(march.steps)));
    let mut technique = RayMarch::new(march).unwrap();
    let error = rel_rmse(&meadow.render(&mut technique), &meadow.render(&mut ShadowMapWalk::new()));
    assert!(error < most, "{march:?}: relative RMSE {error}");
    let mut image = ScatterImage::new();
    group.bench_function(name, |b| {
        meadow.with(|frame| b.iter(|| technique.render(frame, &mut image).unwrap()));
    });
    group.finish();
}

fn march(c: &mut Criterion) {
    for side in [1024, 4096] {
        let meadow = meadow(Lighting::Sun, SIZE, side);
        for steps in [128, 512, 2048] {
            let name = BenchmarkId::new(format!("{side}"), steps);
            bench_march(c, "march-sun", name, &meadow, options(steps, Distribution::Uniform), 0.1);
        }
    }
}

fn lamps(c: &mut Criterion) {
    for (name, lighting) in [("point", Lighting::Point), ("spot", Lighting::Spot)] {
        let meadow = meadow(lighting, SIZE, 1024);
        for distribution in [Distribution::EquiAngular, Distribution::Uniform] {
            let id = BenchmarkId::new(name, distribution);
            // Uniform steps miss what is near the lamp: their error is many times that of equal angles.
            let most = if distribution == Distribution::Uniform { 1.0 } else { 0.1 };
            bench_march(c, "march-lamp-512", id, &meadow, options(512, distribution), most);
        }
    }
}

fn walk(c: &mut Criterion) {
    let mut group = c.benchmark_group("walk");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(5));
    group.throughput(Throughput::Elements(160 * 120));
    for lighting in [Lighting::Sun, Lighting::Point, Lighting::Spot] {
        let meadow = meadow(lighting, [160, 120], 1024);
        let (mut plain, mut tree) = (ShadowMapWalk::plain(), ShadowMapWalk::new());
        assert_eq!(meadow.render(&mut plain), meadow.render(&mut tree));
        let mut image = ScatterImage::new();
        for (name, technique) in [("plain", &mut plain), ("tree", &mut tree)] {
            group.bench_function(BenchmarkId::new(name, format!("{lighting:?}")), |b| {
                meadow.with(|frame| b.iter(|| technique.render(frame, &mut image).unwrap()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, march, lamps, walk);
criterion_main!(benches);
