//! What a grid of froxels must give by mathematics alone: full light, no light, half-spaces, and how it converges.

use froxel::{Froxel, Lookup, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, HeightFalloff, Level, Light, MapProjection, Medium, Phase, ScatterImage};
use scatter_testing::{Filling, MapKind, OwnedFrame, coloured_medium, differing, rel_rmse, values};

/// A picture of odd sides, and a grid that fits it nowhere.
const SIZE: [u32; 2] = [37, 23];
const GRID: [u32; 3] = [11, 7, 16];

fn render(frame: &OwnedFrame, options: Options) -> ScatterImage {
    frame.render(&mut Froxel::new(options))
}

fn walk(frame: &OwnedFrame) -> ScatterImage {
    frame.render(&mut ShadowMapWalk::new())
}

fn truth(frame: &OwnedFrame) -> Vec<[f64; 3]> {
    values(&walk(frame))
}

fn media() -> [Medium; 4] {
    let fog = |medium: Medium, scale| {
        medium.with_height_falloff(HeightFalloff::new([0.1, 1.0, -0.2], 0.5, scale).unwrap())
    };
    [
        Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Isotropic).unwrap(),
        coloured_medium(),
        fog(Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Rayleigh).unwrap(), 1.3),
        fog(coloured_medium(), 0.4),
    ]
}

/// The share of light that is lit is a quotient of two equal sums, so that any grid gives the pixel's own closed form: in f32
/// right to 1e-5 for suns and 1.2e-5 for lamps (core), twice that in height fog, whose depths add 4e-6 for each of τ ≤ 5.
#[test]
fn full_light_is_the_closed_form_whatever_the_grid() {
    const MOST: f64 = 4e-5;
    let mut worst = 0.0f64;
    for kind in MapKind::ALL {
        for medium in media() {
            // Surfaces that are there, behind everything.
            let mut frame = OwnedFrame::stock(kind, SIZE, 9, Filling::Constant(1e3));
            frame.medium = medium;
            let expected = truth(&frame.unoccluded());
            let scale = values(&frame.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
            for frames in [1, 3] {
                let image = render(&frame, Options { grid: GRID, frames, ..Options::default() });
                let found = differing(&image, &expected, &scale, MOST);
                assert!(found.is_close(), "{kind:?}, {frames} frames: {found}");
                worst = worst.max(found.largest());
            }
        }
    }
    println!("full light: off by {worst:.1e} at the most, {MOST:.0e} are allowed");
}

/// Radiance between two slices is linear in their number u where the light is `L = s·(1 − e^{−σt})`, s the source over σ: a chord
/// is off by `max |L″(u)|/8`, and with `t′ = g·(near + t)`, g the growth a slice, `L″ = s·e^{−σt}·(σt″ − σ²t′²)`.
#[test]
fn radiance_between_two_slices_is_a_chord_of_the_closed_form() {
    let mut frame = OwnedFrame::stock(MapKind::Orthographic, SIZE, 9, Filling::Constant(1e3));
    let sigma = 0.3;
    frame.medium = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).unwrap();
    // Every distance from the eye to beyond the last slice's begin.
    frame.depth =
        (0..SIZE[0] * SIZE[1]).map(|n| 12.0 * (n + 1) as f32 / (SIZE[0] * SIZE[1]) as f32).collect();
    let expected = truth(&frame.unoccluded());
    for (near, slices) in [(1e6, 16), (1e6, 64), (0.75, 16), (0.75, 64)] {
        let options = Options {
            grid: [11, 7, slices],
            near: Some(near),
            lookup: Lookup::Radiance,
            ..Options::default()
        };
        let found = values(&render(&frame, options));
        let growth = (12.0f64 / near).ln_1p() / f64::from(slices);
        let curvature = |t: f64| {
            let (first, second) = (growth * (near + t), growth * growth * (near + t));
            (-sigma * t).exp() * (sigma * second - (sigma * first).powi(2)).abs()
        };
        let largest = (0..=1200).map(|n| curvature(0.01 * f64::from(n))).fold(0.0, f64::max);
        let most = largest / 8.0 / (4.0 * std::f64::consts::PI);
        let worst =
            found.iter().zip(&expected).map(|(found, exact)| (found[0] - exact[0]).abs()).fold(0.0, f64::max);
        println!("near {near}, {slices} slices: off by {worst:.2e}, {most:.2e} are allowed");
        // f32 of values up to 0.08: 1e-7. A bound that is nowhere near would prove nothing.
        assert!(worst <= most + 1e-7 && worst > 0.2 * most);
    }
}

#[test]
fn no_light_is_nothing() {
    for kind in MapKind::ALL.into_iter().filter(|kind| *kind != MapKind::Unshadowed) {
        for medium in media() {
            let mut frame = OwnedFrame::stock(kind, SIZE, 9, Filling::Constant(0.0));
            frame.medium = medium;
            // Rays stay within the sun's map.
            frame.depth.fill(3.0);
            for lookup in [Lookup::Share, Lookup::Radiance] {
                let image = render(&frame, Options { grid: GRID, lookup, ..Options::default() });
                assert!(image.inscattered().iter().flatten().all(|&value| value == 0.0), "{kind:?}");
            }
        }
    }
}

/// A half-space of shadow whose border crosses every ray at one distance. A slice's share of a ray is known, so that the error
/// of one sample in its middle is bounded by that of the slice in which the border lies: all of it if the sample is on the
/// wrong side.
#[test]
fn a_shadow_is_off_by_no_more_than_the_slice_in_which_it_begins() {
    let down = [0.0, 0.0, -1.0];
    // A sun from behind, over a map at the eye: depth along the light is depth along the view.
    let projection = MapProjection::orthographic([0.0; 3], down, [0.0, 1.0, 0.0], [50.0; 2], [1, 1]).unwrap();
    for border in [0.4f32, 3.0, 7.7] {
        let size = [5, 3];
        let camera = Camera::orthographic([0.0; 3], down, [0.0, 1.0, 0.0], 2.0, size).unwrap();
        let mut frame = OwnedFrame::stock(MapKind::Orthographic, size, 1, Filling::Constant(border));
        frame.camera = camera;
        frame.depth.fill(10.0);
        frame.light = Light::directional(down, [1.0; 3]).unwrap();
        frame.projections = vec![projection];
        let expected = truth(&frame)[0][0];
        let whole = truth(&frame.unoccluded())[0][0];
        for slices in [1u32, 8, 63, 512] {
            let options = Options { grid: [5, 3, slices], near: Some(1e6), ..Options::default() };
            let found = values(&render(&frame, options))[0][0];
            // Light only falls along the ray: no slice weighs more than its length by the source without extinction.
            let slice = 0.08 * 10.0 / f64::from(slices) / (4.0 * std::f64::consts::PI);
            assert!(
                (found - expected).abs() <= 0.5 * slice * 1.0001 + 1e-7 * whole,
                "{border}, {slices}: {found} {expected}"
            );
        }
    }
}

/// With a column a pixel, samples lie on the pixels' rays: a border is off by half a slice at the most, so that the error falls in
/// proportion to the slices' length.
#[test]
fn a_column_a_pixel_converges_to_the_exact_walk() {
    for kind in [MapKind::Orthographic, MapKind::Cascades, MapKind::Spot, MapKind::Point, MapKind::Faces] {
        for fog in [false, true] {
            let mut frame = OwnedFrame::stock(kind, SIZE, 24, Filling::Random { seed: 5, far: 9.0 });
            if fog {
                frame.medium = media()[2].clone();
            }
            let exact = walk(&frame);
            let error = |slices: u32| {
                let options = Options { grid: [SIZE[0], SIZE[1], slices], ..Options::default() };
                rel_rmse(&render(&frame, options), &exact)
            };
            let errors = [32, 256, 1024].map(error);
            let order = (errors[0] / errors[2]).ln() / 32f64.ln();
            println!("{kind:?}{}: {errors:?}, order {order:.2}", if fog { " in fog" } else { "" });
            // First order; 32 times as many slices show it to a tenth on a picture of 851 rays. Around a point light the error is
            // that of the few rays that pass it closest, whose borders lie in the slice beside it or do not.
            let least = if kind.is_lamp() { 0.6 } else { 0.9 };
            assert!(order > least && errors[2] < 2e-2, "{kind:?}: {errors:?}");
        }
    }
}

/// Columns that do not fit pixels: shadows blur over columns, which finer grids shrink.
#[test]
fn finer_columns_are_nearer_to_the_exact_walk() {
    let size = [96, 64];
    let frame = scatter_testing::boards(size);
    let exact = walk(&frame);
    let errors = [8u32, 4, 2, 1].map(|pixels| {
        let options = Options { grid: [size[0] / pixels, size[1] / pixels, 256], ..Options::default() };
        rel_rmse(&render(&frame, options), &exact)
    });
    println!("8, 4, 2, 1 pixels a column: {errors:?}");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
}

/// Passes fill the froxel along its depth, too: of k passes and n slices shadows along one ray are as good as of k·n slices.
#[test]
fn passes_are_slices_within_slices() {
    let size = [5, 3];
    let down = [0.0, 0.0, -1.0];
    let mut frame = OwnedFrame::stock(MapKind::Orthographic, size, 1, Filling::Constant(3.3));
    frame.camera = Camera::orthographic([0.0; 3], down, [0.0, 1.0, 0.0], 2.0, size).unwrap();
    frame.depth.fill(10.0);
    frame.light = Light::directional(down, [1.0; 3]).unwrap();
    frame.projections =
        vec![MapProjection::orthographic([0.0; 3], down, [0.0, 1.0, 0.0], [50.0; 2], [1, 1]).unwrap()];
    let exact = truth(&frame)[0][0];
    let error = |slices, frames| {
        let options = Options { grid: [5, 3, slices], frames, near: Some(1e6), ..Options::default() };
        (values(&render(&frame, options))[0][0] - exact).abs() / exact
    };
    // The border lies 3/10 into slice 3 of 10: one sample misses by 0.3 slices, ten by less than a twentieth of one.
    let (one, ten) = (error(10, 1), error(10, 10));
    println!("one sample off by {one:.1e}, ten by {ten:.1e}");
    assert!(one > 0.05 && ten < 0.1 * one, "{one} {ten}");
}

#[test]
fn portable_and_wide_registers_agree_to_rounding() {
    for kind in MapKind::ALL {
        for medium in media() {
            let mut frame =
                OwnedFrame::stock(kind, SIZE, 16, Filling::Random { seed: 2, far: 9.0 }).with_glass();
            frame.medium = medium;
            let options = Options { grid: GRID, frames: 2, ..Options::default() };
            let [wide, portable] = [Level::new(), Level::baseline()]
                .map(|simd| values(&frame.render(&mut Froxel::with_simd(options, simd))));
            let scale = truth(&frame.unoccluded());
            for ((wide, portable), scale) in wide.iter().zip(&portable).zip(&scale) {
                for channel in 0..3 {
                    // Glass doubles one channel.
                    assert!((wide[channel] - portable[channel]).abs() <= 1e-5 * scale[channel] + 1e-12);
                }
            }
        }
    }
}
