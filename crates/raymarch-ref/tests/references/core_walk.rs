//! The core's walk of a ray through all layers of a light against this crate's: two implementations, one answer.

use glam::{DQuat, DVec3, Vec3Swizzles as _};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    DepthMap, Frame, MapProjection, RayLight, ScatterImage, ShadowLayer, ShadowMap, VolumetricShadow,
    lit_stretches, walked_radiance,
};
use scatter_testing::{MapKind, OwnedFrame, Random, Recipe};

/// Stretches that rounding may add or lose at a border: a ray's parameters are of order 10, their roots good to 1e-12.
const SLIT: f64 = 1e-9;

/// By how much two lists of stretches differ, in length.
fn difference(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let mut ends: Vec<f64> = a.iter().chain(b).flat_map(|&(from, to)| [from, to]).collect();
    ends.sort_by(f64::total_cmp);
    let lit = |list: &[(f64, f64)], t: f64| list.iter().any(|&(from, to)| from <= t && t < to);
    let parts = ends.windows(2).filter(|part| part[1] > part[0]);
    parts
        .map(|part| {
            let middle = if part[1].is_finite() { 0.5 * (part[0] + part[1]) } else { part[0] + 1.0 };
            if lit(a, middle) == lit(b, middle) { 0.0 } else { part[1] - part[0] }
        })
        .sum()
}

/// Compares stretches and radiance of every pixel; returns how many stretches there were.
pub fn compare(frame: &Frame<'_>, what: &str) -> usize {
    let [width, height] = frame.size();
    let mut truth = ScatterImage::new();
    ShadowMapWalk::plain().render(frame, &mut truth).unwrap();
    let mut count = 0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let (eye, ray) = (frame.camera().eye(), frame.camera().pixel_ray(x, y));
        let end = frame.ray_end(x, y);
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        let maps = (frame.shadow(), frame.setup().maps());
        lit_stretches(maps, eye, &ray, [0.0, end], |a, b| ours.push((a, b)));
        ShadowMapWalk::lit_stretches(frame, x, y, |a, b| theirs.push((a, b)));
        let off = difference(&ours, &theirs);
        assert!(off <= SLIT, "{what} ({x}, {y}): {off:e}, {ours:?} {theirs:?}");
        count += ours.len();

        // One ulp of f32 for the pixel, and what the slits and the subtraction of shadows leave of the whole light.
        let whole = RayLight::new(frame.light(), frame.medium(), eye, &ray).interval(0.0, end);
        let walked = walked_radiance(frame, x, y);
        for channel in 0..3 {
            let exact = f64::from(truth.at(x, y)[channel]);
            let allowed =
                1.2e-7 * exact + 1e-8 * whole[channel] * if frame.texture().is_some() { 2.0 } else { 1.0 };
            assert!(
                (walked[channel] - exact).abs() <= allowed + 1e-37,
                "{what} ({x}, {y}): {walked} {exact}"
            );
        }
    }
    count
}

#[test]
fn every_kind_of_map_has_the_lit_stretches_of_the_reference() {
    for kind in MapKind::ALL {
        let mut count = 0;
        for seed in 0..60 {
            let recipe = Recipe { size: [7, 5], textured: seed % 3 == 0, ..Recipe::of(kind) };
            let scene = OwnedFrame::random(seed, recipe);
            scene.with(|frame| count += compare(frame, &format!("{kind:?} seed {seed}")));
        }
        assert!(count > 60 * 35 / 4, "{kind:?}: {count} stretches are too few to test anything");
    }
}

/// Six faces that are turned as a whole and each about its own axis, some wider than a right angle.
fn faces(random: &mut Random, lamp: DVec3) -> Vec<MapProjection> {
    let turn = DQuat::from_axis_angle(random.direction(), random.range(0.0, 6.0));
    let side = 1 + random.below(9);
    [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
        .into_iter()
        .map(|axis| {
            let up = [axis.yzx(), -axis.yzx(), axis.zxy()][random.below(3) as usize];
            let tan_half = [1.0, 1.0, 1.3][random.below(3) as usize];
            let (forward, up) = ((turn * axis).to_array(), (turn * up).to_array());
            MapProjection::perspective(lamp.to_array(), forward, up, tan_half, side).unwrap()
        })
        .collect()
}

#[test]
fn six_faces_of_any_orientation_have_the_lit_stretches_of_the_reference() {
    let mut count = 0;
    for seed in 0..100 {
        let mut random = Random(1000 + seed);
        let scene = OwnedFrame::random(seed, Recipe { size: [7, 5], ..Recipe::of(MapKind::Point) });
        let faces = faces(&mut random, scene.light.position().unwrap());
        let area = faces[0].size()[0].pow(2) as usize;
        let draw = |random: &mut Random| {
            if random.below(4) == 0 { f32::INFINITY } else { random.range(0.05, 4.0) as f32 }
        };
        let texels: Vec<f32> = (0..6 * area).map(|_| draw(&mut random)).collect();
        let layers: Vec<_> = (0..6)
            .map(|face| ShadowLayer::new(faces[face], &texels[face * area..][..area]).unwrap())
            .collect();
        let shadow = ShadowMap::Faces(layers.as_array().unwrap());
        let depth = DepthMap::new(&scene.depth, scene.camera.size()).unwrap();
        let frame =
            Frame::new(&scene.camera, depth, &scene.light, &shadow, &scene.medium, scene.max_distance)
                .unwrap();
        count += compare(&frame, &format!("faces seed {seed}"));
    }
    assert!(count > 2000, "{count} stretches are too few to test anything");
}
