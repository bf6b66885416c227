//! The marcher under cascades: its samples one by one, in f64, by [`scatter_core::ShadowMap::is_lit`].

use raymarch_ref::{Distribution, Options, RayMarch};
use scatter_core::{Light, MapProjection};
use scatter_testing::{MapKind, OwnedFrame, Random, Recipe, grey_medium};

const STEPS: u32 = 83;

/// A random view of 1 to 16 cascades: each of its own size and extent, turned by any angle, near the centre or far aside,
/// so that rays leave maps and come back into them, and maps are nested, disjoint or in each other's way.
fn scene(seed: u64) -> OwnedFrame {
    let mut scene = OwnedFrame::random(seed, Recipe { size: [13, 7], ..Recipe::of(MapKind::Cascades) });
    let mut random = Random(900 + seed);
    let Light::Directional(sun) = &scene.light else { panic!("cascades are a sun's") };
    let forward = sun.direction();
    // At depth 0, some four units before the centre.
    let first = scene.projections[0];
    let [width, height] = first.size().map(f64::from);
    let middle = first.light_ray(0.5 * width, 0.5 * height).unwrap().0;
    let count = 1 + random.below(16);
    scene.projections = (0..count)
        .map(|_| {
            let origin = middle + random.direction() * random.range(0.0, 4.0);
            let extent = [random.range(0.1, 2.0), random.range(0.1, 2.0)];
            let size = [1 + random.below(40), 1 + random.below(40)];
            let up = random.direction();
            MapProjection::orthographic(origin.into(), forward.into(), up.into(), extent, size).unwrap()
        })
        .collect();
    scene.texels = scene
        .projections
        .iter()
        .map(|map| {
            let [width, height] = map.size();
            (0..width * height).map(|_| random.range(0.0, 8.0) as f32).collect()
        })
        .collect();
    scene.medium = grey_medium();
    for depth in &mut scene.depth {
        *depth = depth.min(9.0);
    }
    scene
}

#[test]
fn every_sample_is_decided_by_the_first_cascade_that_holds_it() {
    let (mut pixels, mut others, mut worst) = (0, 0, 0.0f64);
    let mut partly = 0;
    for seed in 0..80 {
        let scene = scene(seed);
        let options = Options { steps: STEPS, jitter: None, distribution: Distribution::EquiAngular };
        let image = scene.render(&mut RayMarch::new(options).unwrap());
        let whole = scene.unoccluded().render(&mut RayMarch::new(options).unwrap());
        scene.with(|frame| {
            let [width, height] = frame.size();
            let sigma = frame.medium().sigma_t()[0];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let (ray, end) = (frame.camera().pixel_ray(x, y), frame.ray_end(x, y));
                // The march ends at an optical depth of 17; these rays do before.
                assert!(sigma * end < 17.0);
                let step = end / f64::from(STEPS);
                let (mut lit, mut all) = (0.0, 0.0);
                for index in 0..STEPS {
                    let t = (f64::from(index) + 0.5) * step;
                    let weight = (-sigma * t).exp();
                    all += weight;
                    if frame.shadow().is_lit(frame.camera().eye() + ray.origin + ray.direction * t) {
                        lit += weight;
                    }
                }
                let index = (y * width + x) as usize;
                let [found, whole] = [&image, &whole].map(|image| f64::from(image.inscattered()[index][0]));
                let error = if whole > 0.0 { (found / whole - lit / all).abs() } else { 0.0 };
                pixels += 1;
                partly += usize::from(lit > 0.0 && lit < all);
                // Rounding of 83 f32 terms and of a block's rate: 83·2⁻²⁴ + 64·2⁻²⁵ = 7e-6.
                if error > 7e-6 {
                    others += 1;
                    worst = worst.max(error);
                }
            }
        });
    }
    println!("{others} of {pixels} pixels have another sample at a border, by {worst:.1e} at most");
    assert!(partly * 3 > pixels, "{partly} of {pixels} are partly lit");
    // f32 texel coordinates are good to 2⁻²² of a map's 40 texels and depths to 2⁻²³ of 8: some 1e-5 of a texel. With
    // 83 samples in two coordinates and a depth, fewer than 83·3·1e-5 = 0.25 % of the pixels have a sample that near.
    assert!(others * 400 <= pixels, "{others} of {pixels}");
    assert!(worst < 3.0 / f64::from(STEPS), "{worst}");
}
