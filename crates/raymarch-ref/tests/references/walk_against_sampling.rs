//! The exact walk against dense sampling of the map, and against itself without the tree.

use glam::DVec3;
use proptest::prelude::*;
use raymarch_ref::ShadowMapWalk;
use scatter_testing::{MapKind, OwnedFrame, Recipe, dense};

/// Samples a ray. The midpoint rule's own error is (1/n)² of the integral: 1e-9.
const SAMPLES: u32 = 40_000;
/// What the midpoint rule leaves besides the edges: g = 0.9 lobes and cone borders, relative to the unshadowed.
const SMOOTH_TOLERANCE: f64 = 1e-5;

fn assert_walk_is_sampled(seed: u64, recipe: Recipe) {
    let scene = OwnedFrame::random(seed, recipe);
    let image = scene.render(&mut ShadowMapWalk::new());
    let unshadowed = scene.unoccluded().render(&mut ShadowMapWalk::new());
    scene.with(|frame| {
        let [width, height] = frame.size();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let sampled = dense(frame, x, y, SAMPLES);
            let walked = DVec3::from(image.at(x, y).map(f64::from));
            let whole = f64::from(unshadowed.at(x, y).into_iter().fold(0.0, f32::max));
            let error = (walked - sampled.radiance).abs().max_element();
            let tolerance = 2.0 * sampled.uncertainty + SMOOTH_TOLERANCE * whole;
            assert!(
                error <= tolerance,
                "seed {seed} {recipe:?} ({x}, {y}): walked {walked}, sampled {}, error {error:e} > {tolerance:e}",
                sampled.radiance
            );
        }
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn the_walk_is_what_dense_sampling_converges_to(seed: u64, kind in 0..6usize, textured: bool) {
        assert_walk_is_sampled(seed, Recipe { textured, ..Recipe::of(MapKind::ALL[kind]) });
    }

    #[test]
    fn far_from_the_origin_nothing_changes(seed: u64, kind in 0..6usize) {
        let centre = DVec3::new(7e4, -5e4, 4e4);
        assert_walk_is_sampled(seed, Recipe { centre, ..Recipe::of(MapKind::ALL[kind]) });
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn skipping_blocks_changes_no_bit(seed: u64, kind in 1..6usize, textured: bool, large: bool) {
        let map_side = if large { 300 } else { 20 };
        let mut scene =
            OwnedFrame::random(seed, Recipe { textured, map_side, size: [7, 4], ..Recipe::of(MapKind::ALL[kind]) });
        // Blocks of equal depth, so that there is something to skip.
        for (projection, texels) in scene.projections.iter().zip(&mut scene.texels) {
            let width = projection.size()[0] as usize;
            let blocks: Vec<f32> = (0..texels.len())
                .map(|k| texels[(k / width / 16 * 16) * width + (k % width) / 16 * 16])
                .collect();
            *texels = blocks;
        }
        let skipping = scene.render(&mut ShadowMapWalk::new());
        let plain = scene.render(&mut ShadowMapWalk::plain());
        prop_assert_eq!(skipping, plain);
    }
}
