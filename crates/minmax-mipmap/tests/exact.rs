//! Exact mode against the exact walk through the map: every kind of light, map, camera and medium, on random frames.

use minmax_mipmap::{MinMaxMipmap, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{HeightFalloff, Level, VolumetricShadow, walked_radiance};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, Recipe, differing, values};

/// Largest difference, as a share of a pixel's unoccluded radiance (a spot's: without its cone).
///
/// A lit interval's ends are crossings in f32: 2⁻²³ of the stretch of ray inside of the map each, and where the medium is
/// thick, a ray's radiance comes from 1/(σD) of its length; random media have σD ≤ 14. An interval's integral is a sun's to
/// 1e-5 or a lamp's to 1.2e-5, and an unoccluded lamp's the same. Few intervals a ray: maps of 13 texels.
const MOST: f64 = 4e-5;

#[track_caller]
fn assert_exact(frame: &OwnedFrame, what: &str) -> f64 {
    let truth = values(&frame.render(&mut ShadowMapWalk::new()));
    let scale = values(&frame.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
    // Glass of the tests is at most twice as bright as air.
    let factor = if frame.texture.is_some() { 2.0 } else { 1.0 };
    let scale: Vec<[f64; 3]> = scale.iter().map(|pixel| pixel.map(|value| value * factor)).collect();
    let mut worst = 0.0f64;
    for simd in [Level::new(), Level::baseline()] {
        let image = frame.render(&mut MinMaxMipmap::with_simd(Options::default(), simd));
        let found = differing(&image, &truth, &scale, MOST);
        assert!(found.is_close(), "{what}, {simd:?}: {found}");
        worst = worst.max(found.largest());
    }
    worst
}

#[test]
fn random_frames_are_what_the_exact_walk_says() {
    let mut worst = 0.0f64;
    for kind in MapKind::ALL {
        for seed in 0..120 {
            let recipe = Recipe { size: [9, 5], textured: seed % 4 == 3, ..Recipe::of(kind) };
            worst = worst.max(assert_exact(&OwnedFrame::random(seed, recipe), &format!("{kind:?} {seed}")));
        }
    }
    println!("worst {worst:.1e} of {MOST:.1e}");
}

#[test]
fn maps_of_many_texels_are_what_the_exact_walk_says() {
    let mut worst = 0.0f64;
    for kind in MapKind::ALL {
        for (side, size) in [(257, [33, 17]), (600, [16, 8])] {
            let mut frame = OwnedFrame::stock(kind, size, side, Filling::Random { seed: 3, far: 9.0 });
            worst = worst.max(assert_exact(&frame, &format!("{kind:?} {side}")));
            frame.fill(Filling::Constant(4.0));
            worst = worst.max(assert_exact(&frame, &format!("{kind:?} {side}, all alike")));
        }
    }
    println!("worst {worst:.1e} of {MOST:.1e}");
}

/// In height fog against core's walk of one pixel: a sun's lit interval is a difference of transmittances.
#[test]
fn suns_in_height_fog_are_what_the_exact_walk_says() {
    let mut worst = 0.0f64;
    for kind in [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades] {
        for seed in 0..60 {
            let recipe = Recipe { size: [9, 5], textured: seed % 4 == 3, ..Recipe::of(kind) };
            let mut frame = OwnedFrame::random(seed, recipe);
            let mut random = Random(seed);
            let up = random.direction().into();
            let falloff = HeightFalloff::new(up, random.range(-1.0, 1.0), random.range(0.2, 5.0)).unwrap();
            frame.medium = frame.medium.clone().with_height_falloff(falloff);
            let walked = |frame: &OwnedFrame| -> Vec<[f64; 3]> {
                frame.with(|frame| {
                    let pixels = (0..5).flat_map(|y| (0..9).map(move |x| [x, y]));
                    pixels.map(|[x, y]| walked_radiance(frame, x, y).to_array()).collect()
                })
            };
            let factor = if frame.texture.is_some() { 2.0 } else { 1.0 };
            let scale: Vec<_> =
                walked(&frame.unoccluded()).iter().map(|pixel| pixel.map(|value| value * factor)).collect();
            for simd in [Level::new(), Level::baseline()] {
                let image = frame.render(&mut MinMaxMipmap::with_simd(Options::default(), simd));
                let found = differing(&image, &walked(&frame), &scale, MOST);
                assert!(found.is_close(), "{kind:?} {seed}, {simd:?}: {found}");
                worst = worst.max(found.largest());
            }
        }
    }
    println!("worst {worst:.1e} of {MOST:.1e}");
}

/// A lamp in height fog is refused before any work, with what to give instead.
#[test]
fn lamps_in_height_fog_are_refused() {
    let mut frame = OwnedFrame::stock(MapKind::Point, [4, 3], 8, Filling::Constant(2.0));
    let falloff = HeightFalloff::new([0.0, 1.0, 0.0], 0.0, 3.0).unwrap();
    frame.medium = frame.medium.clone().with_height_falloff(falloff);
    let refusal = frame.with(|frame| MinMaxMipmap::new(Options::default()).supports(frame).unwrap_err());
    let reason = refusal.to_string();
    assert!(reason.contains("height fog") && reason.contains("a directional light"), "{reason}");
}
