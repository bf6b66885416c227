//! One group a stage: filling the grid, by its size, by the light and by the passes; and the look-up, by the picture's size.
//!
//! Every benchmark asserts its answer once before it is timed.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use froxel::{Froxel, Lookup, Options};
use scatter_core::{HeightFalloff, ScatterImage, VolumetricShadow, walked_radiance};
use scatter_testing::{Filling, MapKind, OwnedFrame};

/// A view of a map of boards, one every eighth texel.
fn frame(kind: MapKind, size: [u32; 2]) -> OwnedFrame {
    let mut frame = OwnedFrame::stock(kind, size, 256, Filling::Constant(4.0));
    for texels in &mut frame.texels {
        texels.iter_mut().enumerate().filter(|(n, _)| n % 64 < 40).for_each(|(_, depth)| *depth = 9.5);
    }
    frame
}

/// Times a frame; the mean of all pixels must be that of the exact walk's, within a tenth.
fn bench(group: &mut Group<'_>, id: BenchmarkId, frame: &OwnedFrame, options: Options) {
    frame.with(|frame| {
        let mut technique = Froxel::new(options);
        let mut image = ScatterImage::new();
        technique.render(frame, &mut image).expect("supported");
        let [width, height] = frame.size();
        let (mut found, mut exact) = (0.0, 0.0);
        for (x, y) in (0..height).step_by(7).flat_map(|y| (0..width).step_by(7).map(move |x| (x, y))) {
            found += f64::from(image.at(x, y)[0]);
            exact += walked_radiance(frame, x, y).x;
        }
        assert!((found / exact - 1.0).abs() < 0.1, "{found} {exact}");
        group.bench_function(id, |b| {
            b.iter(|| technique.render(black_box(frame), &mut image).expect("supported"))
        });
    });
}

type Group<'a> = criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>;

/// On a picture of as many pixels as columns, so that look-ups are few.
fn grid(c: &mut Criterion) {
    let mut group = c.benchmark_group("grid");
    group.sample_size(10);
    for grid in [[160, 90, 64], [240, 135, 64], [240, 135, 128], [240, 135, 512]] {
        let [columns, rows, slices] = grid;
        let id = BenchmarkId::new("size", format!("{columns}x{rows}x{slices}"));
        let frame = frame(MapKind::Orthographic, [columns, rows]);
        bench(&mut group, id, &frame, Options { grid, ..Options::default() });
    }
    for frames in [1, 8] {
        let options = Options { frames, ..Options::default() };
        let frame = frame(MapKind::Orthographic, [160, 90]);
        bench(&mut group, BenchmarkId::new("frames", frames), &frame, options);
    }
    group.finish();
}

fn light(c: &mut Criterion) {
    let mut group = c.benchmark_group("light");
    group.sample_size(10);
    for kind in [MapKind::Orthographic, MapKind::Cascades, MapKind::Spot, MapKind::Point, MapKind::Faces] {
        let mut frame = frame(kind, [160, 90]);
        bench(&mut group, BenchmarkId::new("uniform", format!("{kind:?}")), &frame, Options::default());
        let falloff = HeightFalloff::new([0.0, 1.0, 0.0], 0.0, 3.0).expect("sane");
        frame.medium = frame.medium.with_height_falloff(falloff);
        bench(&mut group, BenchmarkId::new("height fog", format!("{kind:?}")), &frame, Options::default());
    }
    group.finish();
}

/// A grid of few cells, so that look-ups are most of it.
fn look_up(c: &mut Criterion) {
    let mut group = c.benchmark_group("look-up");
    group.sample_size(10);
    for (name, lookup) in [("share", Lookup::Share), ("radiance", Lookup::Radiance)] {
        for kind in [MapKind::Orthographic, MapKind::Point] {
            let frame = frame(kind, [640, 480]);
            let options = Options { grid: [80, 45, 32], lookup, ..Options::default() };
            bench(&mut group, BenchmarkId::new(name, format!("{kind:?}")), &frame, options);
        }
    }
    group.finish();
}

criterion_group!(benches, grid, light, look_up);
criterion_main!(benches);
