//! Captured segments against the second way, and what a tile may not change.

use glam::DVec3;
use scatter_core::{MapProjection, TranslucentCapture, TranslucentSegment, TranslucentSource};
use scatter_testing::Random;

use super::second_way::{FarOrNear, random_occluders, transmittance};
use super::*;
use crate::scene::Scene;

const LAMP: DVec3 = DVec3::new(1.0, 4.5, 0.5);

/// Maps of a sun, a spot and a face, each with its light.
fn maps() -> Vec<(MapProjection, FarOrNear)> {
    let travel = DVec3::new(0.3, -0.8, 0.1).normalize();
    let sun = MapProjection::orthographic(
        (-9.0 * travel).to_array(),
        travel.to_array(),
        [0.0, 0.0, 1.0],
        [4.0, 3.0],
        [23, 17],
    );
    let spot = MapProjection::perspective(LAMP.to_array(), [-0.2, -1.0, 0.0], [0.0, 0.0, 1.0], 0.9, 19);
    let face = MapProjection::cube_face(LAMP.to_array(), 3, 16);
    let lamp = FarOrNear::Lamp { position: LAMP };
    vec![(sun.unwrap(), FarOrNear::Sun { travel }), (spot.unwrap(), lamp), (face.unwrap(), lamp)]
}

#[test]
fn captured_texels_hold_what_the_second_way_sees_on_their_light_rays() {
    let mut random = Random(5);
    let (mut worst, mut dimmed, mut asked) = (0.0f64, 0, 0);
    for _ in 0..12 {
        let scene = random_occluders(&mut random, 6, 10);
        let occluders = Occluders::new(&scene).unwrap().unwrap();
        for (map, light) in maps() {
            let mut capture = TranslucentCapture::new();
            let layer = capture.capture(&occluders, &map, TranslucentCapture::DEFAULT_LIMIT).unwrap();
            let [width, height] = map.size();
            for (column, row) in (0..height).flat_map(|row| (0..width).map(move |column| (column, row))) {
                let (origin, step) = map.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5).unwrap();
                let depth = random.range(0.1, 16.0);
                let p = origin + step * depth;
                // Where depth is within f32's rounding of a strand's, either side is right.
                let depths = layer.at(column, row).iter().flat_map(|segment| [segment.entry, segment.exit]);
                if depths.into_iter().any(|d| (f64::from(d) - depth).abs() < 1e-5) {
                    continue;
                }
                let found: f64 =
                    layer.at(column, row).iter().map(|segment| segment.optical_depth_before(depth)).sum();
                let exact = transmittance(&scene, light, p);
                let error = ((-found).exp() - exact).abs();
                worst = worst.max(error);
                // Depths and optical depths are f32: some 1e-7 of a depth of 16, times a density of 2.
                assert!(error < 1e-5, "({column}, {row}) at {depth}: {} {exact}", (-found).exp());
                dimmed += u32::from(exact < 0.999);
                asked += 1;
            }
        }
    }
    println!("{dimmed} of {asked} dimmed, largest error {worst:.1e}");
    assert!(dimmed > asked / 10);
}

#[test]
fn tiles_of_any_size_hold_the_same_segments_in_the_same_order() {
    let scene = random_occluders(&mut Random(8), 9, 20);
    let occluders = Occluders::new(&scene).unwrap().unwrap();
    for (map, _) in maps() {
        let [width, height] = map.size();
        let segments = |side: u32| {
            let mut texels: Vec<Vec<TranslucentSegment>> = vec![Vec::new(); (width * height) as usize];
            for (x0, y0) in (0..height)
                .step_by(side as usize)
                .flat_map(|y| (0..width).step_by(side as usize).map(move |x| (x, y)))
            {
                let tile = [x0, y0, (x0 + side).min(width), (y0 + side).min(height)];
                let sink = &mut |texel: u32, segment: TranslucentSegment| {
                    assert!(segment.is_sane());
                    let across = tile[2] - tile[0];
                    texels[((y0 + texel / across) * width + x0 + texel % across) as usize].push(segment);
                };
                occluders.capture(&map, tile, sink).unwrap();
            }
            texels
        };
        let whole = segments(64);
        assert!(whole.iter().any(|texel| texel.len() > 2));
        for side in [1, 4, 7] {
            assert_eq!(segments(side), whole, "tiles of {side}");
        }
    }
}

/// A strand along these places.
fn strand(places: &[[f64; 3]], radius: f64) -> Scene {
    let mut scene = Scene::default();
    let vertex = |&place: &[f64; 3]| StrandVertex { position: place.into(), radius, opacity: 0.5 };
    scene.strands.push(places.iter().map(vertex));
    scene
}

/// What the middle texel of a map that looks down sees of a scene.
fn seen(scene: &Scene) -> Vec<TranslucentSegment> {
    let map =
        MapProjection::orthographic([0.0, 10.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.5; 2], [1, 1])
            .unwrap();
    let mut found = Vec::new();
    let occluders = Occluders::new(scene).unwrap().unwrap();
    occluders.capture(&map, [0, 0, 1, 1], &mut |_, segment| found.push(segment)).unwrap();
    found
}

#[test]
fn a_strand_counts_once_a_pass_and_not_once_a_segment() {
    let depths = |scene: &Scene| seen(scene).iter().map(|segment| segment.entry).collect::<Vec<_>>();
    // Through the ray with a joint on it; along the ray; there and back at another height; a kink within two radii.
    assert_eq!(depths(&strand(&[[-1.0, 4.0, 0.0], [0.0, 4.0, 0.0], [1.0, 4.0, 0.0]], 0.1)), [6.0]);
    assert_eq!(depths(&strand(&[[0.0, 8.0, 0.0], [0.0, 6.0, 0.0], [0.0, 2.0, 0.0]], 0.1)), [2.0]);
    let hairpin = |gap: f64| {
        strand(&[[-1.0, 4.0, 0.0], [1.0, 4.0, 0.0], [1.0, 4.0 - gap, 0.0], [-1.0, 4.0 - gap, 0.0]], 0.1)
    };
    assert_eq!(depths(&hairpin(1.0)), [6.0, 7.0]);
    assert_eq!(depths(&hairpin(0.15)), [6.0]);
    // Beside the ray by more than the radius.
    assert_eq!(depths(&strand(&[[-1.0, 4.0, 0.11], [1.0, 4.0, 0.11]], 0.1)), [0.0; 0]);
}

#[test]
fn spheres_are_chords_that_end_at_the_lamp_and_at_the_near_plane() {
    let ball = |centre: [f64; 3], radius: f64| {
        let mut scene = Scene::default();
        scene.particles.push(Particle { centre: centre.into(), radius, density: 0.5 });
        scene
    };
    let [segment] = seen(&ball([0.0, 4.0, 0.3], 0.5))[..] else { panic!("one segment") };
    // Half a chord of √(0.5² − 0.3²) = 0.4 around the depth 6.
    assert!((segment.entry - 5.6).abs() < 1e-6 && (segment.exit - 6.4).abs() < 1e-6);
    assert!((segment.optical_depth - 0.4).abs() < 1e-6);
    // Before the near plane at y = 10 as a whole, and half of it.
    let [before] = seen(&ball([0.0, 12.0, 0.0], 0.5))[..] else { panic!("one segment") };
    assert_eq!(before, TranslucentSegment { entry: 0.0, exit: 0.0, optical_depth: 0.5 });
    let both = seen(&ball([0.0, 10.0, 0.0], 1.0));
    assert_eq!(both.iter().map(|segment| segment.optical_depth).sum::<f32>(), 1.0);
    assert_eq!((both[0].exit, both[1].entry, both[1].exit), (0.0, 0.0, 1.0));
    // A lamp inside of a sphere shines through what lies before it.
    let lamp =
        MapProjection::perspective([0.0, 10.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], 0.5, 1).unwrap();
    let scene = ball([0.0, 10.0, 0.0], 1.0);
    let occluders = Occluders::new(&scene).unwrap().unwrap();
    let mut found = Vec::new();
    occluders.capture(&lamp, [0, 0, 1, 1], &mut |_, segment| found.push(segment)).unwrap();
    assert_eq!(found, [TranslucentSegment { entry: 0.0, exit: 1.0, optical_depth: 0.5 }]);
}

#[test]
fn nonsense_in_a_scene_is_an_error_that_names_it() {
    let mut scene = strand(&[[0.0; 3], [1.0; 3]], 0.1);
    scene.particles.push(Particle { centre: DVec3::ZERO, radius: 1.0, density: -1.0 });
    let said = |scene: &Scene| Occluders::new(scene).unwrap_err().to_string();
    assert_eq!(said(&scene), "particle 0 has a density of -1; give a finite number ≥ 0");
    scene.particles[0] = Particle { centre: DVec3::new(0.0, f64::NAN, 0.0), radius: 1.0, density: 1.0 };
    assert!(said(&scene).starts_with("particle 0 has a coordinate of NaN"));
    let bad = strand(&[[0.0; 3], [1.0; 3]], f64::INFINITY);
    assert!(said(&bad).starts_with("strand vertex 0 has a radius of inf"));
    assert!(Occluders::new(&Scene::default()).unwrap().is_none());
    let clear = strand(&[[0.0; 3], [1.0; 3]], 0.0);
    assert!(Occluders::new(&clear).unwrap().is_none(), "what dims nothing is no occluder");
}
