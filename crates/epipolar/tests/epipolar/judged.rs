//! Images of the technique, and their error against the exact walk.

use epipolar::{Epipolar, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Camera, Light, MapProjection, Medium, Phase, RenderStats, ScatterImage, VolumetricShadow,
};

use crate::random_scene::{MapKind, Random, Recipe, Scene};

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
pub fn scene(seed: u64, recipe: Recipe) -> Scene {
    let mut scene = Scene::random(seed, recipe);
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

/// Open air with three boards in it under a sun: few edges, as in a picture.
pub fn boards(size: [u32; 2]) -> Scene {
    let recipe = Recipe { size, ..Recipe::of(MapKind::Orthographic) };
    let mut scene = Scene::random(1, recipe);
    let down = [0.3, -1.0, -0.2];
    scene.light = Light::directional(down, [1.0, 0.9, 0.8]).unwrap();
    scene.camera =
        Camera::perspective([0.2, 0.1, 6.0], [0.1, 0.4, 0.0], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let projection =
        MapProjection::orthographic([0.0, 6.0, 0.0], down, [0.1, 0.0, 1.0], [5.0, 4.0], [80, 64]).unwrap();
    let mut texels = vec![f32::INFINITY; 80 * 64];
    for (i, j, depth) in [(18..31, 10..50, 3.0), (44..47, 5..60, 4.2), (60..72, 21..33, 3.6)] {
        for row in j {
            texels[row * 80..][i.clone()].fill(depth);
        }
    }
    scene.projections = vec![projection];
    scene.texels = vec![texels];
    scene.depth = (0..size[0] * size[1]).map(|n| 9.0 + (n % size[0]) as f32 / size[0] as f32).collect();
    scene.medium = Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Isotropic).unwrap();
    scene.max_distance = 20.0;
    scene
}

/// The scene's image by the technique.
pub fn render(scene: &Scene, options: Options) -> (ScatterImage, RenderStats) {
    scene.with(|frame| {
        let mut image = ScatterImage::new();
        let stats = Epipolar::new(options).render(frame, &mut image).unwrap();
        (image, stats)
    })
}

/// What the exact walk says.
pub fn truth(scene: &Scene) -> ScatterImage {
    scene.render(&mut ShadowMapWalk::new())
}

/// Relative RMSE as MODEL.md has it; 0 for two black images.
pub fn rel_rmse(image: &ScatterImage, truth: &ScatterImage) -> f64 {
    let values = |image: &ScatterImage| -> Vec<f64> {
        image.inscattered().iter().flatten().map(|&value| f64::from(value)).collect()
    };
    let (image, truth) = (values(image), values(truth));
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let square = image.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / truth.len() as f64;
    if square == 0.0 { 0.0 } else { square.sqrt() / mean }
}
