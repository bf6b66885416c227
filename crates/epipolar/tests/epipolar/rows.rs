//! A row is the walk through the map: a view ray that lies in a slice sees the lit parts that the exact walk finds.
//!
//! Backward error: a row computed in f32 may be that of an eye moved a little. For each pixel the walk is done from
//! the eye and from six eyes moved by ±δ along the axes; where those seven agree with each other, the row must agree
//! with them. No conditioning comes in: where a view ray grazes a surface, the moved walks differ over a long stretch.

use epipolar::baran::Cells;
use epipolar::baran::sums::problem::{Problem, Queries, Runs, SumScratch};
use epipolar::baran::sums::{SumAlgorithm, sum_lit_runs};
use glam::DVec3;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, Frame};
use scatter_testing::{MapKind, SliceCase, slice_cases};

use crate::intervals::{Intervals, outside_of_all};
use crate::row_of_pixel::{RowOfPixel, axis};

/// f32 rounds positions of a scene of size 16 by up to 1e-6: twice, on the map and along the light.
const MOST_BACKWARD: f64 = 2e-6;
/// The smallest one that is tried.
const LEAST_BACKWARD: f64 = 1e-8;

/// The lit light rays of a pixel as the walk finds them from an eye moved by `shift`.
fn walked(frame: &Frame<'_>, pixel: [u32; 2], shift: DVec3, of: &RowOfPixel) -> Intervals {
    let camera = frame.camera();
    let eye = camera.eye() + shift;
    let moved = Camera::perspective(
        eye.into(),
        (eye + camera.forward()).into(),
        camera.up().into(),
        2.0 * camera.window().top.atan().to_degrees(),
        camera.size(),
    )
    .unwrap();
    let frame = Frame::new(
        &moved,
        frame.depth(),
        frame.light(),
        frame.shadow(),
        frame.medium(),
        frame.max_distance(),
    )
    .unwrap();
    let mut lit = Intervals::default();
    ShadowMapWalk::lit_stretches(&frame, pixel[0], pixel[1], |from, to| {
        lit.push(of.gamma_of(from), of.gamma_of(to));
    });
    lit
}

/// The seven walks of a backward error δ.
fn walks(frame: &Frame<'_>, pixel: [u32; 2], delta: f64, of: &RowOfPixel) -> Vec<Intervals> {
    let shifts = (0..3).flat_map(|index| [-delta, delta].map(|by| axis(index) * by));
    [DVec3::ZERO].into_iter().chain(shifts).map(|shift| walked(frame, pixel, shift, of)).collect()
}

/// The smallest tried δ with which a row agrees with the walks; and how much it is off with the last one.
fn backward_error(frame: &Frame<'_>, pixel: [u32; 2], row: &RowOfPixel) -> (f64, f64) {
    let lit = row.lit();
    let mut delta = LEAST_BACKWARD;
    loop {
        let off = outside_of_all(&lit, &walks(frame, pixel, delta, row));
        // γ itself is f32, a border each: half an ulp of the largest one.
        let borders = row.row.len() as f64 + 1.0;
        let rounding = borders * row.gamma_end.max(1.0) * f64::from(f32::EPSILON);
        if off <= rounding || delta >= MOST_BACKWARD {
            return (delta, (off - rounding).max(0.0));
        }
        delta *= 10f64.sqrt();
    }
}

/// Sum over lit stretches of a sun's light: `∫ e^{−σγ/sin β} dγ`.
fn sun_sum(lit: &Intervals, per_gamma: f64) -> f64 {
    lit.0.iter().map(|&(a, b)| ((-per_gamma * a).exp() - (-per_gamma * b).exp()) / per_gamma).sum()
}

/// The share of the pixel's light that the five algorithms find in its row, with the integrand of its own view ray:
/// a factorisation without error, of one term.
fn integrated(row: &RowOfPixel, per_gamma: f64) -> [f64; 5] {
    let up_to = |gamma: f64| [((1.0 - (-per_gamma * gamma).exp()) / per_gamma) as f32];
    let starts = row.row.starts();
    let last = starts.partition_point(|&start| f64::from(start) <= row.gamma_end) - 1;
    let prefix: Vec<[f32; 1]> = starts.iter().map(|&start| up_to(f64::from(start))).collect();
    let (ranks, runs, ends) = ([row.rank], [last as u32], [up_to(row.gamma_end)]);
    let problem = Problem {
        runs: Runs {
            lit: &row.row.lit()[..=last],
            prefix: &prefix[..last + 2],
            colour: None,
            columns: [row.rank, row.rank + 1],
        },
        queries: Queries { ranks: &ranks, runs: &runs },
        ends: &ends,
        ascending: true,
    };
    SumAlgorithm::ALL.map(|algorithm| {
        let mut scratch = SumScratch::default();
        scratch.reserve(starts.len(), row.column_count as usize, 1, 1);
        let mut out = [[f32::NAN]];
        sum_lit_runs(algorithm, &problem, &mut scratch, &mut out);
        f64::from(out[0][0] / ends[0][0])
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_view_ray_in_its_slice_sees_what_the_walk_sees(case in slice_cases()) {
        let scene = case.frame();
        scene.with(|frame| {
            for pixel in (0..77).map(|n| [n % 11, n / 11]) {
                let Some(row) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                let (delta, off) = backward_error(frame, pixel, &row);
                prop_assert!(off == 0.0, "pixel {pixel:?}: {off:e} of {} with δ = {delta:e}\n{:?}\n{:?}",
                    row.gamma_end, row.lit(), walked(frame, pixel, DVec3::ZERO, &row));
            }
            Ok(())
        })?;
    }

    #[test]
    fn a_suns_share_in_a_row_is_that_of_the_walk(case in slice_cases(), sigma in 0.001..3.0f64) {
        let scene = SliceCase { kind: MapKind::Orthographic, ..case }.frame();
        scene.with(|frame| {
            for pixel in (0..77).step_by(3).map(|n| [n % 11, n / 11]) {
                let Some(row) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                let per_gamma = sigma / row.sine;
                let whole = (1.0 - (-per_gamma * row.gamma_end).exp()) / per_gamma;
                if !(row.gamma_end > 0.0) {
                    continue;
                }
                let shares: Vec<f64> = walks(frame, pixel, MOST_BACKWARD, &row)
                    .iter()
                    .map(|lit| sun_sum(lit, per_gamma) / whole)
                    .collect();
                let [low, high] =
                    shares.iter().fold([1.0f64, 0.0], |[low, high], &share| [low.min(share), high.max(share)]);
                // Sums of as many f32 terms as there are runs, each with three roundings at most.
                let rounding = 4.0 * (row.row.len() as f64 + 4.0) * f64::from(f32::EPSILON);
                // Several transitions may move apart in one row and together in each walk.
                let slack = rounding + 7.0 * (high - low);
                for share in integrated(&row, per_gamma) {
                    prop_assert!(share >= low - slack && share <= high + slack, "{pixel:?}: {share} {low} {high}");
                }
            }
            Ok(())
        })?;
    }
}

#[test]
fn rows_are_the_walk_of_an_eye_moved_by_little() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut worst, mut pixels, mut beyond) = (0.0f64, 0, [0; 3]);
    for _ in 0..400 {
        let case = slice_cases().new_tree(&mut runner).unwrap().current();
        case.frame().with(|frame| {
            for pixel in (0..77).step_by(2).map(|n| [n % 11, n / 11]) {
                let Some(row) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                let (delta, off) = backward_error(frame, pixel, &row);
                assert_eq!(off, 0.0, "{case:?} {pixel:?}");
                worst = worst.max(delta);
                pixels += 1;
                for (count, limit) in beyond.iter_mut().zip([1e-7, 3e-7, 1e-6]) {
                    *count += usize::from(delta > limit);
                }
            }
        });
    }
    println!(
        "largest backward error of {pixels} rows: {worst:.1e} (allowed {MOST_BACKWARD:.0e}); beyond 1e-7, 3e-7, 1e-6: {beyond:?}"
    );
    assert!(pixels > 10_000);
}
