//! The epipole and the anti-epipole on screen: bands of factors leave no ring around them.

use epipolar::{NearEpipole, Options};
use scatter_core::{Camera, Light, MapProjection, Medium, Phase, Quality, ScatterImage};
use scatter_testing::{MapKind, OwnedFrame, Recipe};

use crate::judged::{render, truth, uniform};

const SIZE: [u32; 2] = [161, 119];

/// What counts as "around" \[degrees\]: the paper walks rays within two of them, so its seam would lie inside.
const RADIUS: f64 = 3.0;

/// How much larger errors may be around it. Slices are no farther apart there than elsewhere, but a ray that is nearly
/// parallel to the light is lit or dark as a whole, while others cross bars of both: twice the contrast, and so twice
/// what interpolation leaves.
const FACTOR: f64 = 2.0;

/// The least error that is told apart, of the mean radiance: f32 sums of the ray's few hundred runs.
const FLOOR: f64 = 1e-4;

/// The eye under a low sun behind a uniform grille: bars half a unit wide, 1¼ apart, seven units before the eye, and
/// bars across them two units before it. The camera looks along −z; light travels along `travel`.
fn grille(travel: [f64; 3]) -> OwnedFrame {
    const TEXELS: [u32; 2] = [112, 96];
    let mut scene = OwnedFrame::random(3, Recipe { size: SIZE, ..Recipe::of(MapKind::Orthographic) });
    scene.camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, SIZE).unwrap();
    let light = Light::directional(travel, [1.0, 0.9, 0.8]).unwrap();
    let direction = glam::DVec3::from(travel).normalize();
    scene.light = light;
    // Off by parts of a texel, so that the eye's own light ray is no border.
    let origin = -10.0 * direction + glam::DVec3::new(0.03, 0.07, 0.0);
    scene.projections = vec![
        MapProjection::orthographic(origin.into(), travel, [0.0, 1.0, 0.0], [14.0, 12.0], TEXELS).unwrap(),
    ];
    let depth = |index: u32| match (index % TEXELS[0] % 5, index / TEXELS[0] % 5) {
        (0 | 1, _) => 3.0,
        (_, 0 | 1) => 8.0,
        _ => f32::INFINITY,
    };
    scene.texels = vec![(0..TEXELS[0] * TEXELS[1]).map(depth).collect()];
    // A wall that leans: longer rays to the right.
    scene.depth = (0..SIZE[0] * SIZE[1]).map(|n| 9.0 + (n % SIZE[0]) as f32 / SIZE[0] as f32).collect();
    scene.medium = Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Isotropic).unwrap();
    scene.max_distance = 20.0;
    scene
}

/// Whether each pixel lies around the epipole or the anti-epipole.
fn around(scene: &OwnedFrame) -> Vec<bool> {
    let Light::Directional(sun) = &scene.light else { unreachable!("a sun") };
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let angle = |(x, y)| {
        let ray = scene.camera.pixel_ray(x, y).direction;
        ray.cross(sun.direction()).length().atan2(ray.dot(sun.direction()).abs()).to_degrees()
    };
    pixels.map(|pixel| angle(pixel) <= RADIUS).collect()
}

/// RMS error of the pixels around and of the others, over the truth's mean.
fn errors(image: &ScatterImage, truth: &ScatterImage, around: &[bool]) -> [f64; 2] {
    let mean = truth.inscattered().iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / around.len() as f64;
    [true, false].map(|part| {
        let pixels = image.inscattered().iter().zip(truth.inscattered()).zip(around);
        let squares: Vec<f64> = pixels
            .filter(|(_, is_around)| **is_around == part)
            .map(|((a, b), _)| (f64::from(a[0]) - f64::from(b[0])).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / mean
    })
}

fn shows_no_ring([near, rest]: [f64; 2]) -> bool {
    near <= FACTOR * rest + FLOOR
}

#[test]
fn no_ring_is_left_around_the_epipole_and_the_anti_epipole() {
    let options = [
        ("a pixel apart", uniform(1.0)),
        ("a quarter apart", uniform(0.25)),
        ("game", Options::for_quality(Quality::Game, SIZE)),
        ("film", Options::for_quality(Quality::Film, SIZE)),
        ("an error of 1 %", Options::for_error(0.01, SIZE).unwrap()),
    ];
    // The sun 14 degrees above the horizon and low at the side, before the camera and behind it; and exactly before
    // it, in the centre of the middle pixel.
    let travels =
        [[0.1, -0.25, 1.0], [0.1, -0.25, -1.0], [-0.37, -0.05, 1.0], [-0.37, -0.05, -1.0], [0.0, 0.0, 1.0]];
    for travel in travels {
        let scene = grille(travel);
        let (truth, around) = (truth(&scene), around(&scene));
        let count = around.iter().filter(|&&is_around| is_around).count();
        assert!(count > 80, "{count} pixels around it: it is not on screen");
        for (name, options) in options {
            assert_eq!(options.near_epipole, NearEpipole::Bands, "{name}");
            let image = render(&scene, options).0;
            let found = errors(&image, &truth, &around);
            let [near, rest] = found;
            println!("{travel:?}, {name}: {near:.5} around, {rest:.5} elsewhere, ratio {:.2}", near / rest);
            assert!(shows_no_ring(found), "{travel:?}, {name}: {found:?}");
        }
        // Half a percent more within it, of an image that is nearly exact, is seen.
        let mut ring = render(&scene, Options::for_error(0.002, SIZE).unwrap()).0;
        let brighter = ring.pixels_mut().0.iter_mut().zip(&around).filter(|(_, is_around)| **is_around);
        brighter.for_each(|(pixel, _)| *pixel = pixel.map(|value| 1.005 * value));
        let found = errors(&ring, &truth, &around);
        assert!(
            !shows_no_ring(found),
            "{travel:?}: a ring of {:.5} beside {:.5} is not seen",
            found[0],
            found[1]
        );
    }
}
