//! Rows, trees and lit runs of slices: no tree changes a run by a bit, and along a slice a row is the map itself.

use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::Epipole;
use epipolar::rows::MinMaxTiles;
use minmax_mipmap::slices::{Looks, SliceRay, SliceRow, TreeKind};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use scatter_core::{Frame, Level, RayLight, walked_radiance};
use scatter_testing::{Filling, MapKind, OwnedFrame, SliceCase, slice_cases};

const TREES: [TreeKind; 3] = [TreeKind::None, TreeKind::Yusov, TreeKind::Chen];

/// The lit runs of a ray, as bits.
fn runs_of(
    row: &mut SliceRow,
    slice: &SliceView<'_>,
    kind: TreeKind,
    ray: &SliceRay,
) -> (Vec<[f64; 2]>, Looks) {
    let (mut runs, mut looks) = (Vec::new(), Looks::default());
    row.lit_runs(slice, kind, ray, &mut looks, |a, b| runs.push([a, b]));
    (runs, looks)
}

/// What the tests of one frame found.
#[derive(Default)]
struct Found {
    rays: u64,
    runs: u64,
    looks: [Looks; 3],
    /// Largest difference from the exact walk, relative to the pixel's unoccluded radiance.
    worst: f64,
}

/// Every pixel's own slice: all trees find the same runs, to the bit, for its ray and for others of its slice; and the pixel's own
/// runs are those of the exact walk.
fn check(frame: &Frame<'_>, simd: Level, every: usize, found: &mut Found) {
    let epipole = Epipole::new(frame.camera(), frame.light());
    let mut tiles = MinMaxTiles::default();
    tiles.rebuild(simd, frame.shadow());
    let scene = SliceScene { frame, epipole, tiles: &tiles, simd };
    let [width, height] = frame.size();
    for pixel in (0..(width * height) as usize).step_by(every) {
        let [x, y] = [pixel as u32 % width, pixel as u32 / width];
        let mut angles = SliceAngles::default();
        let Some((slice, column)) = SliceView::through_pixel(scene, [x, y], &mut angles) else { continue };
        let end = frame.ray_end(x, y);
        let own = SliceRay::new(&slice, f64::from(column), end);
        let mut rays = vec![own];
        // Between columns, shorter, longer and endless ones.
        for (aside, factor) in [(0.5, 1.0), (-0.25, 0.3), (0.0, 4.0), (0.1, f64::INFINITY)] {
            rays.push(SliceRay::new(&slice, f64::from(column) + aside, end * factor));
        }
        let mut rows = TREES.map(|kind| {
            let mut row = SliceRow::default();
            row.lay(&slice, kind);
            row
        });
        for (index, ray) in rays.iter().enumerate() {
            let mut first = None;
            for (tree, (row, kind)) in rows.iter_mut().zip(TREES).enumerate() {
                let (runs, looks) = runs_of(row, &slice, kind, ray);
                found.looks[tree].nodes += looks.nodes;
                found.looks[tree].columns += looks.columns;
                assert!(runs.iter().all(|[a, b]| 0.0 <= *a && a < b && *b <= ray.end), "{runs:?}");
                assert!(runs.windows(2).all(|pair| pair[0][1] <= pair[1][0]), "{runs:?}");
                match &first {
                    None => first = Some(runs),
                    Some(first) => assert_eq!(&runs, first, "{kind:?}, pixel {x} {y}, ray {index}"),
                }
            }
            let runs = first.unwrap_or_default();
            found.rays += 1;
            found.runs += runs.len() as u64;
            if index == 0 && frame.texture().is_none() {
                let ray = frame.camera().pixel_ray(x, y);
                let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
                let sum = runs.iter().map(|[a, b]| light.interval(*a, *b)).sum::<glam::DVec3>();
                let (exact, whole) = (walked_radiance(frame, x, y), light.interval(0.0, end));
                for channel in 0..3 {
                    if whole[channel] > 0.0 {
                        let error = (sum[channel] - exact[channel]).abs() / whole[channel];
                        found.worst = found.worst.max(error);
                    }
                }
            }
        }
    }
}

/// Largest difference of a pixel's runs from the exact walk's.
///
/// Borders of texels are f32 along the row, of fewer than 64 texels: 2⁻¹⁹ of a texel. A crossing with a texel's surface is where
/// two lines meet in f64. Where a surface is nearly parallel to the view ray, or the medium so dense that all of its
/// light comes from a hundredth of the ray, that is a hundred times as much of the radiance.
const MOST: f64 = 2e-4;

#[test]
fn no_tree_changes_a_run_by_a_bit_and_rows_are_the_map_itself() {
    let mut runner = TestRunner::new(Config { cases: 300, failure_persistence: None, ..Config::default() });
    let found = std::cell::RefCell::new(Found::default());
    let maps = prop_oneof![Just(None), Just(Some([61, 35])), Just(Some([1, 1])), Just(Some([33, 64]))];
    runner
        .run(&(slice_cases(), maps, any::<bool>()), |(case, map, portable): (SliceCase, _, bool)| {
            let frame = case.frame_of([11, 7], map);
            let simd = if portable { Level::baseline() } else { Level::new() };
            frame.with(|frame| check(frame, simd, 3, &mut found.borrow_mut()));
            Ok(())
        })
        .unwrap();
    let found = found.into_inner();
    println!(
        "{} rays, {} runs, worst {:.1e} of {MOST:.0e}; {:?}",
        found.rays, found.runs, found.worst, found.looks
    );
    assert!(found.rays > 10_000 && found.runs > 10_000);
    assert!(found.worst < MOST);
}

#[test]
fn a_tree_looks_at_less_where_there_is_little_to_see() {
    for (filling, share) in [
        (Filling::Constant(4.0), 0.3),
        (Filling::Constant(f32::INFINITY), 0.1),
        (Filling::Random { seed: 5, far: 9.0 }, 3.0),
    ] {
        for kind in MapKind::ALL.into_iter().filter(|kind| *kind != MapKind::Unshadowed) {
            let frame = OwnedFrame::stock(kind, [21, 13], 300, filling);
            let mut found = Found::default();
            frame.with(|frame| check(frame, Level::new(), 5, &mut found));
            let [none, yusov, chen] = found.looks.map(|looks| looks.nodes + looks.columns);
            println!("{kind:?} {filling:?}: {yusov} and {chen} of {none} looks, worst {:.1e}", found.worst);
            assert!((yusov.max(chen) as f64) < share * none as f64, "{kind:?} {filling:?}");
            assert!(found.worst < MOST);
        }
    }
}
