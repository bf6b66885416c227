//! Images of the technique, and their error against the exact walk.

use epipolar::{Epipolar, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, RenderStats, ScatterImage, VolumetricShadow};
use scatter_testing::{OwnedFrame, Random, Recipe};

/// Slices of one distance and as many terms as there are: what is left is the distance of slices.
pub fn uniform(spacing: f64) -> Options {
    let mut options = Options {
        spacing,
        fewest_slices: 1.0,
        target: None,
        rank: Some(8),
        uncut_columns: 0.0,
        ..Options::default()
    };
    options.refinement.halvings = 0;
    options
}

/// A scene of that kind whose camera is no orthographic one.
pub fn scene(seed: u64, recipe: Recipe) -> OwnedFrame {
    let mut scene = OwnedFrame::random(seed, recipe);
    let mut random = Random(!seed);
    let eye = recipe.centre + random.direction() * random.range(1.5, 3.0);
    let target = recipe.centre + random.direction() * 0.4;
    scene.camera = Camera::perspective(
        eye.into(),
        target.into(),
        [0.1, 0.9, 0.3],
        random.range(40.0, 100.0),
        recipe.size,
    )
    .unwrap();
    scene
}

/// The scene's image by the technique.
pub fn render(scene: &OwnedFrame, options: Options) -> (ScatterImage, RenderStats) {
    scene.with(|frame| {
        let mut image = ScatterImage::new();
        let stats = Epipolar::new(options).render(frame, &mut image).unwrap();
        (image, stats)
    })
}

/// What the exact walk says.
pub fn truth(scene: &OwnedFrame) -> ScatterImage {
    scene.render(&mut ShadowMapWalk::new())
}
