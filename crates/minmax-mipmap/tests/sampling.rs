//! The modes on slices against the exact walk, and what they promise: a source for every pixel, the same bits for any number of
//! threads and any tree, refusals before any work.

use minmax_mipmap::slices::TreeKind;
use minmax_mipmap::{Downscale, Edges, MinMaxMipmap, Mode, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Camera, HeightFalloff, Level, Light, MapProjection, Medium, Phase, Projection, RenderStats, ScatterImage,
    VolumetricShadow,
};
use scatter_testing::{
    Filling, MapKind, OwnedFrame, Recipe, boards, coloured_medium, differing, rel_rmse, values,
};

const SAMPLING: Options = Options {
    mode: Mode::Sampling,
    tree: TreeKind::Yusov,
    slices: 512,
    samples: 256,
    initial: 16,
    density: 2,
    refinement: 0.03,
    edges: Edges::Row,
    halvings: 0,
    contrast: 0.06,
    downscale: Downscale::One,
    correction: true,
};

fn rendered(frame: &OwnedFrame, options: Options) -> (ScatterImage, RenderStats) {
    let mut image = ScatterImage::new();
    let mut technique = MinMaxMipmap::new(options);
    let stats = frame.with(|frame| technique.render(frame, &mut image)).expect("a frame that is supported");
    (image, stats)
}

fn exact(frame: &OwnedFrame) -> ScatterImage {
    frame.render(&mut ShadowMapWalk::new())
}

/// Where every depth differs from its neighbours', none serves the pixels between those of a lattice of one in four: all are marched
/// by their own rays, along rows of their own, which are the map itself.
///
/// Borders of texels are f32 along a row of 13 texels, 2⁻²⁰ of it, and a lamp's closed form is good to 2.3e-5; where the medium is
/// dense or a surface nearly parallel to the ray, an edge moves by a thousand times as much of its light.
#[test]
fn corrected_pixels_are_exact_in_every_frame() {
    let options = Options { refinement: 0.001, downscale: Downscale::Four, ..SAMPLING };
    let (mut worst, mut corrected, mut pixels) = (0.0f64, 0, 0);
    for kind in MapKind::ALL {
        for seed in 0..60 {
            let recipe = Recipe { size: [9, 5], textured: seed % 4 == 3, ..Recipe::of(kind) };
            let mut frame = OwnedFrame::random(seed, recipe);
            if frame.camera.projection() == Projection::Orthographic {
                continue;
            }
            // Steps of 1.7 %, in no order.
            frame.depth = (0..45).map(|n| 2.0 + 0.12 * ((n * 22) % 45) as f32).collect();
            frame.max_distance = 50.0;
            let (image, stats) = rendered(&frame, options);
            let (truth, whole) = (values(&exact(&frame)), values(&exact(&frame.unoccluded())));
            assert_eq!(stats.counts.get("pixels without a source"), Some(0), "{kind:?} {seed}");
            corrected += stats.counts.get("corrected pixels").unwrap_or(0);
            pixels += 45;
            // What a lamp without its cone would give, about: rims of cones are dark.
            let most = whole.iter().flatten().fold(0.0f64, |a, &b| a.max(b));
            let found = values(&image);
            for pixel in (0..45).filter(|pixel| pixel % 9 % 4 != 2 || pixel / 9 % 4 != 2) {
                for channel in 0..3 {
                    let error = (found[pixel][channel] - truth[pixel][channel]).abs();
                    let scale = whole[pixel][channel].max(1e-3 * most);
                    assert!(error <= 2e-3 * scale, "{kind:?} {seed} {pixel}: {error:.1e} of {scale:.1e}");
                    worst = worst.max(error / scale.max(f64::MIN_POSITIVE));
                }
            }
        }
    }
    println!("worst {worst:.1e}, {corrected} of {pixels} corrected");
    // Without a map nothing is sampled.
    assert!(corrected > pixels / 2);
}

/// Every sample is marched, slices are a quarter of a pixel apart: what is left is interpolation over an eighth of a pixel.
#[test]
fn the_finest_settings_come_near_the_exact_walk_and_so_do_slices() {
    let finest = Options { mode: Mode::Sampling, ..Options::finest() };
    let slices = Options { mode: Mode::Slices, ..finest };
    for (frame, name) in [
        (boards([161, 119]), "boards"),
        (OwnedFrame { medium: coloured_medium(), ..boards([97, 61]) }, "boards in colour"),
        (OwnedFrame { medium: fog(), ..boards([97, 61]) }, "boards in fog"),
    ] {
        let truth = exact(&frame);
        let [coarse, fine, sliced] =
            [SAMPLING, finest, slices].map(|o| rel_rmse(&rendered(&frame, o).0, &truth));
        println!("{name}: paper's defaults {coarse:.1e}, finest {fine:.1e}, slices {sliced:.1e}");
        // Edges of shadows lie anywhere in a gap of a quarter of a pixel: far below a hundredth of a picture's light.
        assert!(fine < 3e-3 && sliced < 3e-3 && coarse < 3e-2, "{name}");
    }
}

fn fog() -> Medium {
    let falloff = HeightFalloff::new([0.1, 1.0, 0.0], 0.5, 1.5).unwrap();
    coloured_medium().with_height_falloff(falloff)
}

#[test]
fn unoccluded_and_dark_frames_are_exact_at_any_setting() {
    for kind in MapKind::ALL {
        for mode in [Mode::Sampling, Mode::Slices] {
            let options = Options { mode, slices: 40, ..SAMPLING };
            let lit = OwnedFrame::stock(kind, [33, 17], 40, Filling::Constant(f32::INFINITY));
            let truth = values(&exact(&lit));
            // The rim of a spot's cone is where its factor is a small difference: f32 is good to a share of the lamp without it.
            let mean = truth.iter().map(|pixel| pixel[0]).sum::<f64>() / truth.len() as f64;
            let scale: Vec<[f64; 3]> = truth.iter().map(|pixel| pixel.map(|value| value.max(mean))).collect();
            let found = differing(&rendered(&lit, options).0, &truth, &scale, 4e-5);
            assert!(found.is_close(), "{kind:?} {mode:?}: {found}");
            let glass = lit.with_glass();
            let found = rel_rmse(&rendered(&glass, options).0, &exact(&glass));
            println!("{kind:?} {mode:?}: glass {found:.1e}");
            // Borders of panes between slices that are three pixels apart.
            assert!(found < 0.1, "{kind:?} {mode:?}: {found}");
        }
    }
}

#[test]
fn no_pixel_is_without_a_source_and_threads_and_trees_change_no_bit() {
    let pools = [1, 2].map(|count| rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap());
    let mut served = 0;
    for kind in MapKind::ALL {
        for (size, slices) in [([67, 45], 60), ([1, 23], 24), ([41, 1], 200), ([1, 1], 24)] {
            let frame = OwnedFrame::stock(kind, size, 50, Filling::Random { seed: 2, far: 9.0 });
            for downscale in [Downscale::One, Downscale::Two, Downscale::Four] {
                for correction in [true, false] {
                    let options = Options { slices, downscale, correction, initial: 3, ..SAMPLING };
                    let [one, two] = pools.each_ref().map(|pool| pool.install(|| rendered(&frame, options)));
                    assert_eq!(one.0.inscattered(), two.0.inscattered(), "{kind:?} {size:?} {options:?}");
                    assert_eq!(one.1.counts.get("pixels without a source"), Some(0), "{kind:?} {size:?}");
                    if !correction {
                        assert_eq!(one.1.counts.get("corrected pixels").unwrap_or(0), 0, "{kind:?} {size:?}");
                    }
                    served += size[0] * size[1];
                }
            }
            for mode in [Mode::Sampling, Mode::Slices] {
                let options = Options { mode, slices, ..SAMPLING };
                let [none, yusov, chen] = [TreeKind::None, TreeKind::Yusov, TreeKind::Chen]
                    .map(|tree| rendered(&frame, Options { tree, ..options }).0);
                assert_eq!(none.inscattered(), yusov.inscattered(), "{kind:?} {size:?} {mode:?}");
                assert_eq!(none.inscattered(), chen.inscattered(), "{kind:?} {size:?} {mode:?}");
            }
        }
    }
    println!("{served} pixels served");
}

#[test]
fn instruction_sets_agree_and_what_needs_an_eye_is_refused() {
    let frame = boards([61, 43]);
    let images = [Level::new(), Level::baseline()].map(|simd| {
        let mut image = ScatterImage::new();
        let mut technique = MinMaxMipmap::with_simd(SAMPLING, simd);
        frame.with(|frame| technique.render(frame, &mut image)).unwrap();
        image
    });
    // Products are fused in one and not in the other.
    assert!(rel_rmse(&images[0], &images[1]) < 1e-5);

    let camera = Camera::orthographic([0.0, 0.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 4.0, [61, 43]);
    let orthographic = OwnedFrame { camera: camera.unwrap(), ..frame };
    let lamp =
        OwnedFrame { medium: fog(), ..OwnedFrame::stock(MapKind::Point, [9, 5], 8, Filling::Constant(3.0)) };
    for mode in [Mode::Sampling, Mode::Slices] {
        for refused in [&orthographic, &lamp] {
            let technique = MinMaxMipmap::new(Options { mode, ..SAMPLING });
            refused.with(|frame| assert!(technique.supports(frame).is_err(), "{mode:?}"));
        }
    }
    let exact = MinMaxMipmap::new(Options::default());
    orthographic.with(|frame| assert!(exact.supports(frame).is_ok()));
}

/// A spot beside the eye, dark all along, whose cone most of the view's corners miss; a ground at y = 0.
fn dark_cone(size: [u32; 2]) -> OwnedFrame {
    let (eye, position) = ([0.37, 1.63, 5.1], [1.5, 4.1, 2.2]);
    let direction = [-1.45, -3.8, -2.1];
    let camera = Camera::perspective(eye, [0.1, 1.1, 0.0], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let tan_half = 35.0f64.to_radians().tan();
    let projection = MapProjection::perspective(position, direction, [0.0, 1.0, 0.0], tan_half, 17).unwrap();
    let depth = (0..size[0] * size[1]).map(|pixel| {
        let down = -camera.pixel_ray(pixel % size[0], pixel / size[0]).direction.y;
        if down > 0.0 { (eye[1] / down) as f32 } else { f32::INFINITY }
    });
    OwnedFrame {
        depth: depth.collect(),
        light: Light::spot(position, direction, [40.0; 3], 20.0, 35.0, 0.0).unwrap(),
        kind: MapKind::Spot,
        projections: vec![projection],
        texels: vec![vec![0.0; 17 * 17]],
        medium: Medium::homogeneous([0.05; 3], [0.01; 3], Phase::henyey_greenstein(0.3).unwrap()).unwrap(),
        texture: None,
        max_distance: 30.0,
        camera,
    }
}

/// In a spot's cone that is dark all along, nothing is lit: rays that miss the cone have no share of any light, and say nothing of rays
/// that meet it.
#[test]
fn rays_beside_a_cone_light_nothing_in_it() {
    for size in [[13, 9], [37, 23], [64, 48]] {
        let dark = dark_cone(size);
        let whole = values(&exact(&dark.unoccluded()));
        let most = whole.iter().flatten().fold(0.0f64, |a, &b| a.max(b));
        let unlit = whole.iter().filter(|pixel| pixel[0] == 0.0).count();
        assert!(unlit > 0 && unlit < whole.len(), "{size:?}: {unlit} rays miss the cone");
        for downscale in [Downscale::One, Downscale::Two, Downscale::Four] {
            for (slices, samples, edges) in [(24, 64, Edges::Depth), (200, 9, Edges::Row)] {
                for correction in [true, false] {
                    let options = Options { downscale, slices, samples, edges, correction, ..SAMPLING };
                    let found = values(&rendered(&dark, options).0);
                    // What rounding leaves at the rim: the closed form of a lamp in f32 is good to 2.3e-5.
                    let worst = found.iter().flatten().fold(0.0f64, |a, &b| a.max(b)) / most;
                    println!("{size:?} {downscale:?} {slices} {correction}: {worst:.1e}");
                    assert!(worst <= 2.3e-5, "{size:?} {options:?}: {worst:.1e}");
                }
            }
        }
    }
}
