//! One group a stage of the modes on slices: a slice's row with its tree, marches through it, and whole frames.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::Epipole;
use epipolar::rows::MinMaxTiles;
use minmax_mipmap::slices::{Looks, SliceRay, SliceRow, TreeKind};
use minmax_mipmap::{Downscale, Edges, MinMaxMipmap, Mode, Options};
use scatter_core::{Frame, ScatterImage, VolumetricShadow, simd_level};
use scatter_testing::{Lighting, OwnedFrame, meadow};

const TREES: [(TreeKind, &str); 3] =
    [(TreeKind::Yusov, "yusov"), (TreeKind::Chen, "chen"), (TreeKind::None, "none")];

/// Calls `with` for a slice through the middle of an image of 640×480 of the meadow, with every column's ray.
fn slice_of(frame: &Frame<'_>, with: impl FnOnce(&SliceView<'_>, &[SliceRay])) {
    let simd = simd_level();
    let mut tiles = MinMaxTiles::default();
    tiles.rebuild(simd, frame.shadow());
    let epipole = Epipole::new(frame.camera(), frame.light());
    let scene = SliceScene { frame, epipole, tiles: &tiles, simd };
    let mut angles = SliceAngles::default();
    let (slice, _) = SliceView::through_pixel(scene, [400, 300], &mut angles).expect("no epipole there");
    let [first, end] = slice.order.columns;
    let rays: Vec<SliceRay> = (first..end).map(|column| SliceRay::new(&slice, column.into(), 60.0)).collect();
    with(&slice, &rays);
}

/// The sum of the lengths of all lit runs, and what was looked at.
fn marched(row: &mut SliceRow, slice: &SliceView<'_>, kind: TreeKind, rays: &[SliceRay]) -> (f64, Looks) {
    let (mut sum, mut looks) = (0.0, Looks::default());
    for ray in rays {
        row.lit_runs(slice, kind, ray, &mut looks, |a, b| sum += b - a);
    }
    (sum, looks)
}

fn rows(c: &mut Criterion) {
    let mut group = c.benchmark_group("row");
    for side in [1024, 4096] {
        meadow(Lighting::Sun, [640, 480], side).with(|frame| {
            slice_of(frame, |slice, _| {
                for (kind, name) in TREES {
                    let mut row = SliceRow::default();
                    row.reserve(frame);
                    group.bench_function(BenchmarkId::new(name, side), |b| b.iter(|| row.lay(slice, kind)));
                }
            });
        });
    }
    group.finish();
}

fn marches(c: &mut Criterion) {
    let mut group = c.benchmark_group("march");
    for side in [1024, 4096] {
        meadow(Lighting::Sun, [640, 480], side).with(|frame| {
            slice_of(frame, |slice, rays| {
                let mut first = None;
                for (kind, name) in TREES {
                    let mut row = SliceRow::default();
                    row.reserve(frame);
                    row.lay(slice, kind);
                    let (sum, looks) = marched(&mut row, slice, kind, rays);
                    assert_eq!(*first.get_or_insert(sum), sum, "{name}");
                    println!("{name} {side}: {looks:?}");
                    group.bench_function(BenchmarkId::new(name, side), |b| {
                        b.iter(|| {
                            row.lay(slice, kind);
                            black_box(marched(&mut row, slice, kind, rays))
                        });
                    });
                }
            });
        });
    }
    group.finish();
}

fn frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame");
    let paper = Options { mode: Mode::Sampling, ..Options::paper() };
    let ways = [
        ("sampling", paper),
        ("edges=row", Options { edges: Edges::Row, ..paper }),
        ("downscale=2", Options { downscale: Downscale::Two, ..paper }),
        ("downscale=4", Options { downscale: Downscale::Four, ..paper }),
        ("slices", Options { mode: Mode::Slices, ..paper }),
    ];
    for lighting in [Lighting::Sun, Lighting::Point] {
        let scene: OwnedFrame = meadow(lighting, [320, 240], 512);
        scene.with(|frame| {
            for (name, options) in ways {
                let mut technique = MinMaxMipmap::new(options);
                let mut image = ScatterImage::new();
                let stats = technique.render(frame, &mut image).expect("a frame that is supported");
                assert!(stats.counts.get("pixels without a source").unwrap_or(0) == 0);
                assert!(image.inscattered().iter().flatten().all(|value| value.is_finite()));
                group.bench_function(BenchmarkId::new(name, format!("{lighting:?}")), |b| {
                    b.iter(|| technique.render(black_box(frame), &mut image).map(|_| ()));
                });
            }
        });
    }
    group.finish();
}

criterion_group!(benches, rows, marches, frames);
criterion_main!(benches);
