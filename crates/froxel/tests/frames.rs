//! Random frames of every light, map, medium and camera against the exact walk; determinism; extremes.

use froxel::{Froxel, Lookup, Options};
use proptest::prelude::*;
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, HeightFalloff, Medium, Phase, ScatterImage};
use scatter_testing::{
    Filling, MapKind, OwnedFrame, Random, Recipe, coloured_medium, exceeding, rel_rmse, values,
};

fn render(frame: &OwnedFrame, options: Options) -> ScatterImage {
    frame.render(&mut Froxel::new(options))
}

fn kinds() -> impl Strategy<Value = MapKind> {
    prop::sample::select(MapKind::ALL.to_vec())
}

fn in_fog(frame: &mut OwnedFrame, seed: u64) {
    let mut random = Random(seed);
    let up = random.direction().into();
    let falloff = HeightFalloff::new(up, random.range(-1.0, 1.0), random.range(0.2, 5.0)).unwrap();
    frame.medium = frame.medium.clone().with_height_falloff(falloff);
}

fn finite(image: &ScatterImage) -> bool {
    let values = image.inscattered().iter().chain(image.transmittance());
    values.flatten().all(|value| value.is_finite() && *value >= 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any grid stays between darkness and the unoccluded value, is finite, and a fine one is near the exact walk.
    #[test]
    fn random_frames_stay_in_bounds_and_fine_grids_are_near(kind in kinds(), seed in 0u64..1 << 40, fog in any::<bool>()) {
        let mut frame = OwnedFrame::random(seed, Recipe { size: [9, 5], ..Recipe::of(kind) });
        if fog {
            in_fog(&mut frame, seed);
        }
        frame.texture = None;
        let bound = values(&frame.unoccluded().render(&mut ShadowMapWalk::new()));
        let scale = values(&frame.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
        let mut random = Random(seed);
        let side = |random: &mut Random, most: u32| 1 + random.below(most);
        let grid = [side(&mut random, 12), side(&mut random, 12), side(&mut random, 40)];
        let any = Options { grid, frames: side(&mut random, 5), ..Options::default() };
        let image = render(&frame, any);
        prop_assert!(finite(&image));
        // Core's closed forms in f32, twice in fog; and an ulp of the mean of the passes.
        let bright = exceeding(&image, &bound, &scale, 4e-5);
        prop_assert!(bright.is_close(), "{kind:?} {any:?}: {bright}");
        let engines = Options { lookup: Lookup::Radiance, ..any };
        prop_assert!(finite(&render(&frame, engines)));

        let fine = Options { grid: [9, 5, 1024], ..Options::default() };
        let exact = values(&frame.render(&mut ShadowMapWalk::new()));
        let found = values(&render(&frame, fine));
        let mean = |scale: &[[f64; 3]]| scale.iter().flatten().sum::<f64>() / (3 * scale.len()) as f64;
        let off = found.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let rms = (off / (3 * found.len()) as f64).sqrt();
        // Of 1024 slices, on rays that cross a dozen texels: a hundredth of what there could be.
        prop_assert!(rms <= 0.01 * mean(&scale), "{kind:?}: {rms:e} of {:e}", mean(&scale));
    }

    /// The same bits for one thread and for three, however often, after another frame as well.
    #[test]
    fn bits_do_not_depend_on_threads_nor_on_the_frame_before(kind in kinds(), seed in 0u64..1 << 40, frames in 1u32..4) {
        let frame = OwnedFrame::random(seed, Recipe { size: [21, 37], ..Recipe::of(kind) });
        let other = OwnedFrame::random(seed + 1, Recipe { size: [33, 18], ..Recipe::of(kind) });
        let options = Options { grid: [19, 23, 33], frames, ..Options::default() };
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let alone = pool(1).install(|| render(&frame, options));
        let again = pool(3).install(|| {
            let mut technique = Froxel::new(options);
            other.render(&mut technique);
            frame.render(&mut technique)
        });
        prop_assert_eq!(alone, again);
    }
}

/// Glass, RGB extinction and phase sums: the fine grid against the exact walk.
#[test]
fn coloured_glass_in_coloured_media_is_what_the_exact_walk_says() {
    for kind in [MapKind::Orthographic, MapKind::Cascades, MapKind::Spot, MapKind::SpotCube, MapKind::Point] {
        for fog in [false, true] {
            let size = [17, 13];
            let mut frame =
                OwnedFrame::stock(kind, size, 24, Filling::Random { seed: 8, far: 9.0 }).with_glass();
            frame.medium = coloured_medium();
            if fog {
                let falloff = HeightFalloff::new([0.1, 1.0, 0.0], 0.0, 3.0).unwrap();
                frame.medium = frame.medium.clone().with_height_falloff(falloff);
            }
            let exact = frame.render(&mut ShadowMapWalk::new());
            let found = render(&frame, Options { grid: [17, 13, 2048], frames: 4, ..Options::default() });
            let error = rel_rmse(&found, &exact);
            let radiance =
                Options { grid: [17, 13, 2048], frames: 4, lookup: Lookup::Radiance, ..Options::default() };
            let engines = rel_rmse(&render(&frame, radiance), &exact);
            println!("{kind:?}, fog {fog}: {error:.1e}, radiance {engines:.1e}");
            assert!(error < 5e-3 && engines < 1e-2, "{kind:?}, fog {fog}: {error} {engines}");
        }
    }
}

/// Rays without end, of no length, eyes far away, needles and fish eyes, from vacuum to soot: finite, and where nothing is
/// scattered, nothing.
#[test]
fn extremes_are_finite() {
    let mut count = 0;
    for kind in MapKind::ALL {
        for sigma in [0.0, 1e-9, 0.1, 1e4] {
            for (fov, far_away) in [(1.0, 0.0), (60.0, 1e5), (170.0, 0.0), (179.9999, 0.0)] {
                let size = [7, 5];
                let mut frame = OwnedFrame::stock(kind, size, 8, Filling::Checkerboard(2.0, f32::INFINITY));
                let eye = [0.1 + far_away, 1.0, 6.0];
                frame.camera = Camera::perspective(eye, [0.0; 3], [0.0, 1.0, 0.0], fov, size).unwrap();
                for (n, depth) in frame.depth.iter_mut().enumerate() {
                    *depth = [0.0, 1e-6, 3.0, 1e6, f32::INFINITY][n % 5];
                }
                let phase = Phase::henyey_greenstein(-0.99).unwrap();
                frame.medium =
                    Medium::homogeneous([sigma, 0.5 * sigma, 0.0], [0.0, sigma, 0.0], phase).unwrap();
                for max_distance in [0.0, 50.0, 1e12, f64::INFINITY] {
                    frame.max_distance = max_distance;
                    for lookup in [Lookup::Share, Lookup::Radiance] {
                        let options = Options { grid: [4, 3, 16], lookup, frames: 2, ..Options::default() };
                        let mut frame = frame.clone();
                        for fog in [false, true] {
                            if fog {
                                in_fog(&mut frame, 7);
                            }
                            let image = render(&frame, options);
                            assert!(finite(&image), "{kind:?} {sigma} {fov} {max_distance} fog {fog}");
                            let nothing = image.inscattered().iter().all(|pixel| pixel[2] == 0.0);
                            assert!(nothing, "the third channel scatters nothing");
                            count += 1;
                        }
                    }
                }
            }
        }
    }
    assert_eq!(count, 7 * 4 * 4 * 4 * 2 * 2);
}

#[test]
fn options_that_are_out_of_range_are_errors_that_say_what_to_give() {
    let message = |key: &str, value: &str| Options::default().set(key, value).unwrap_err().to_string();
    let said = message("grid", "4096x4096x4096");
    assert!(said.contains("give a grid WxHxD") && said.contains("4294967296 cells"), "{said}");
    for grid in ["0x9x9", "160x90", "160x90x64x2", "5000x9x9", "160×90×64", "ax9x9", ""] {
        assert!(message("grid", grid).starts_with("froxel: option grid is"), "{grid}");
    }
    assert!(message("frames", "0").contains("from 1 to 64"));
    assert!(message("near", "0").contains("auto, or a number"));
    let mut options = Options::default();
    options.set("grid", "240x135x128").unwrap();
    options.set("far", "40").unwrap();
    assert_eq!((options.grid, options.far), ([240, 135, 128], Some(40.0)));
}
