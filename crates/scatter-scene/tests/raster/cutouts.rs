//! Cut-outs by both sources: the raster pass discards where rays pass, and rays decide at the borders of texels.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use scatter_core::{Camera, MapProjection};
use scatter_scene::{AlphaMask, Cutout, RasterScene, Scene, SceneCaster, Wrap};

use super::driver::{assert_valid, device};

/// Numbers in [0, 1), the same every time (Knuth's MMIX generator).
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Cards of all sizes and slants around `centre`, with coarse and fine masks under all wraps, over an opaque floor.
fn cards(seed: u64, centre: DVec3) -> Scene {
    let mut random = random(seed);
    let mut scene = Scene::default();
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    for (number, size) in [[8, 8], [64, 32], [1, 5], [3, 100], [256, 256]].into_iter().enumerate() {
        let patch = 1 + number as u32;
        let is_there = move |column: u32, row: u32| {
            let (i, j) = (column / patch, row / patch);
            (i.wrapping_mul(0x9e37_79b9) ^ j.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 31 == 0
        };
        scene.masks.push(AlphaMask::new(size, [wraps[number % 3], wraps[(number + 1) % 3]], is_there));
    }
    let at = |x: f64, y: f64, z: f64| centre + DVec3::new(x, y, z);
    scene.positions =
        vec![at(-9.0, -5.0, -9.0), at(9.0, -5.0, -9.0), at(9.0, -5.0, 9.0), at(-9.0, -5.0, 9.0)];
    scene.triangles = vec![[0, 1, 2], [2, 3, 0]];
    for _ in 0..120 {
        let mut vector = |half: f64| (DVec3::new(random(), random(), random()) * 2.0 - 1.0) * half;
        let (middle, across, down) = (centre + vector(4.0), vector(1.0), vector(1.0));
        let size = 0.3 + 3.0 * random().powi(2);
        let (across, down) = (across * size, down * size);
        let first = scene.positions.len() as u32;
        scene.positions.extend([
            middle - across - down,
            middle + across - down,
            middle + across + down,
            middle - across + down,
        ]);
        let (from, repeats) = (DVec2::new(random() - 0.5, random() - 0.5), 0.3 + 3.0 * random());
        let corner = |i: f64, j: f64| from + DVec2::new(i, j) * repeats;
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let mask = (random() * 5.0) as u32;
        for [a, b, c] in [[0, 1, 2], [2, 3, 0]] {
            let uv = [corners[a], corners[b], corners[c]];
            scene.cutouts.push(Cutout { triangle: scene.triangles.len() as u32, mask, uv });
            scene.triangles.push([a, b, c].map(|corner| first + corner as u32));
        }
    }
    scene
}

/// Texels that differ by more than `1e-4` of the depths' range.
fn differing(drawn: &[f32], cast: &[f32]) -> usize {
    assert_eq!(drawn.len(), cast.len());
    let finite = || cast.iter().copied().filter(|depth| depth.is_finite());
    let range = finite().fold(0.0, f32::max) - finite().fold(f32::INFINITY, f32::min);
    drawn.iter().zip(cast).filter(|&(a, b)| !(a == b || (a - b).abs() <= 1e-4 * range)).count()
}

#[test]
fn cards_agree_texel_for_texel() {
    let test = "cards_agree_texel_for_texel";
    let Some(device) = device(test) else { return };
    let (mut texels, mut off, mut off_as_drawn) = (0, 0, 0);
    for seed in 1..7u64 {
        let centre = DVec3::new(1e3, -2e2, 3e3) * f64::from(seed % 2 == 0);
        let caster = Arc::new(SceneCaster::new(&cards(seed, centre)).unwrap());
        let raster = RasterScene::new(&device, caster.clone()).unwrap();
        let as_drawn = RasterScene::new(&device, caster.clone()).unwrap().as_drawn();
        let at = |x: f64, y: f64, z: f64| (centre + DVec3::new(x, y, z)).to_array();
        let (eye, up) = (at(2.0, 1.0, 11.0), [0.0, 1.0, 0.0]);
        let (mut drawn, mut plain, mut cast) = (Vec::new(), Vec::new(), Vec::new());
        let mut compare = |drawn: &[f32], plain: &[f32], cast: &[f32]| {
            texels += cast.len();
            off += differing(drawn, cast);
            off_as_drawn += differing(plain, cast);
        };
        for camera in [
            Camera::perspective(eye, at(0.0, 0.0, 0.0), up, 70.0, [401, 300]).unwrap(),
            // Amid the cards, some of which lie across the eye's plane.
            Camera::perspective(at(0.1, 0.2, 0.3), eye, up, 100.0, [401, 300]).unwrap(),
            Camera::orthographic(eye, at(0.0, 0.0, 0.0), up, 12.0, [401, 300]).unwrap(),
        ] {
            raster.depth_map(&camera, &mut drawn).unwrap();
            as_drawn.depth_map(&camera, &mut plain).unwrap();
            caster.depth_map(&camera, &mut cast);
            compare(&drawn, &plain, &cast);
        }
        let light = [0.3, -0.9, 0.2];
        for map in [
            MapProjection::orthographic(at(-6.0, 20.0, -4.0), light, [0.0, 0.0, 1.0], [9.0, 9.0], [512, 500])
                .unwrap(),
            MapProjection::perspective(at(-2.0, 9.0, -1.0), light, [0.0, 0.0, 1.0], 1.1, 512).unwrap(),
        ] {
            raster.shadow_map(&map, &mut drawn).unwrap();
            as_drawn.shadow_map(&map, &mut plain).unwrap();
            caster.shadow_map(&map, &mut cast).unwrap();
            compare(&drawn, &plain, &cast);
        }
        raster.cube_map(at(0.5, 0.4, 0.3), 200, &mut drawn).unwrap();
        as_drawn.cube_map(at(0.5, 0.4, 0.3), 200, &mut plain).unwrap();
        caster.cube_map(at(0.5, 0.4, 0.3), 200, &mut cast).unwrap();
        compare(&drawn, &plain, &cast);
    }
    println!("{test}: {off} of {texels} texels differ, {off_as_drawn} as drawn");
    // As drawn the grid shows at the borders; the rays leave nothing of it.
    assert!(off_as_drawn > 100, "{off_as_drawn}: the test sees nothing");
    assert_eq!(off, 0);
    assert_valid(&device);
}
