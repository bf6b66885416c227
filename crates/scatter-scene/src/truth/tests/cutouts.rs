//! Cut-outs: closed forms by hand, the second way, and masks that change nothing.

use glam::DVec2;

use super::*;
use crate::cutout::{AlphaMask, Cutout, Wrap};

/// A horizontal card over x in [0, 8] and z in [−1, 1], one unit above the ray of [`radiance`], whose texture runs along
/// x from `from` to `to`.
fn card(mask: AlphaMask, from: f64, to: f64) -> Scene {
    let at = |x: f64, z: f64| DVec3::new(x, 1.0, z);
    let uv = |x: f64, v: f64| DVec2::new(from + (to - from) * x / 8.0, v);
    Scene {
        positions: vec![at(0.0, -1.0), at(8.0, -1.0), at(8.0, 1.0), at(0.0, 1.0)],
        triangles: vec![[0, 1, 2], [2, 3, 0]],
        cutouts: vec![
            Cutout { triangle: 0, mask: 0, uv: [uv(0.0, 0.0), uv(8.0, 0.0), uv(8.0, 1.0)] },
            Cutout { triangle: 1, mask: 0, uv: [uv(8.0, 1.0), uv(0.0, 1.0), uv(0.0, 0.0)] },
        ],
        masks: vec![mask],
        ..Scene::default()
    }
}

/// Radiance of the ray from (−1, 0, ¼) along x, ten units long, under light of irradiance 1: σs = σt = 0.1, isotropic.
fn radiance(scene: &Scene, light: &Light) -> f64 {
    let camera =
        Camera::orthographic([-1.0, 0.0, 0.25], [0.0, 0.0, 0.25], [0.0, 1.0, 0.0], 1.0, [1, 1]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let depth = DepthMap::new(&[f32::INFINITY], [1, 1]).unwrap();
    let frame = Frame::new(&camera, depth, light, &ShadowMap::Unshadowed, &medium, 10.0).unwrap();
    let caster = SceneCaster::new(scene).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
    image.at(0, 0)[0].into()
}

/// The radiance where the ray is dark within `dark` alone, by the closed form of each lit rest; x as in the world.
fn lit_but(dark: &[(f64, f64)]) -> f64 {
    let whole = |a: f64, b: f64| (-0.1 * (a + 1.0)).exp() - (-0.1 * (b + 1.0)).exp();
    let dark: f64 = dark.iter().map(|&(a, b)| whole(a, b)).sum();
    (whole(-1.0, 9.0) - dark) * scatter_core::INV_4PI
}

#[track_caller]
fn assert_radiance(found: f64, expected: f64) {
    // One rounding of the image to f32.
    assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
}

fn sun(direction: [f64; 3]) -> Light {
    Light::directional(direction, [1.0; 3]).unwrap()
}

#[test]
fn a_card_with_half_of_its_texels_gone_lets_half_of_the_light_through() {
    // Every other column of eight is there: a unit each.
    let mask = AlphaMask::new([8, 2], [Wrap::Repeat; 2], |column, _| column % 2 == 0);
    let scene = card(mask, 0.0, 1.0);
    let dark = [(0.0, 1.0), (2.0, 3.0), (4.0, 5.0), (6.0, 7.0)];
    assert_radiance(radiance(&scene, &sun([0.0, -1.0, 0.0])), lit_but(&dark));
    // A slanted sun moves the shadows by half a unit along x.
    let moved = dark.map(|(a, b)| (a + 0.5, b + 0.5));
    assert_radiance(radiance(&scene, &sun([0.5, -1.0, 0.0])), lit_but(&moved));
    // The upper row of texels alone, v < ½, is z < 0: the ray at z = ¼ lies under the lower one.
    let rows = |shown: u32| card(AlphaMask::new([1, 2], [Wrap::Repeat; 2], |_, row| row == shown), 0.0, 1.0);
    assert_radiance(radiance(&rows(0), &sun([0.0, -1.0, 0.0])), lit_but(&[]));
    assert_radiance(radiance(&rows(1), &sun([0.0, -1.0, 0.0])), lit_but(&[(0.0, 8.0)]));
}

#[test]
fn textures_repeat_mirror_and_end_as_the_sampler_says() {
    // Two columns, the first one there, over u from −1 to 3: eight texels, a unit each.
    let of = |wrap: Wrap| card(AlphaMask::new([2, 1], [wrap; 2], |column, _| column == 0), -1.0, 3.0);
    let down = sun([0.0, -1.0, 0.0]);
    let repeated = [(0.0, 1.0), (2.0, 3.0), (4.0, 5.0), (6.0, 7.0)];
    assert_radiance(radiance(&of(Wrap::Repeat), &down), lit_but(&repeated));
    // u in [−1, 0) and [1, 2) runs backwards: gone, there | there, gone | gone, there | there, gone.
    assert_radiance(radiance(&of(Wrap::MirroredRepeat), &down), lit_but(&[(1.0, 3.0), (5.0, 7.0)]));
    // All before the texture is its first column, all behind it its last one.
    assert_radiance(radiance(&of(Wrap::ClampToEdge), &down), lit_but(&[(0.0, 3.0)]));
}

#[test]
fn a_lamp_casts_texels_in_perspective() {
    let mask = AlphaMask::new([8, 1], [Wrap::Repeat; 2], |column, _| column % 2 == 0);
    // The lamp two units above the ray: shadows of the card, half way, are twice as long about its foot, x = 4.
    let lamp = Light::point([4.0, 2.0, 0.25], [1.0; 3], 0.0).unwrap();
    let scene = card(mask, 0.0, 1.0);
    let caster = SceneCaster::new(&scene).unwrap();
    let ray = ViewRay { origin: DVec3::ZERO, direction: DVec3::X };
    let LightOnRay::Plane(shadow) = LightOnRay::new(&lamp, DVec3::new(-10.0, 0.0, 0.25), &ray) else {
        panic!()
    };
    let mut walk = ShadowWalk::default();
    walk.collect(&caster, &shadow, 30.0);
    let lit: Vec<_> = walk.spans.lit().collect();
    // x = 4 + 2(k − 4), as distances from −10.
    let expected = [(0.0, 6.0), (8.0, 10.0), (12.0, 14.0), (16.0, 18.0), (20.0, 30.0)];
    assert_eq!(lit.len(), expected.len(), "{lit:?}");
    for (found, expected) in lit.iter().zip(expected) {
        assert!((found.0 - expected.0).abs() < 1e-13 && (found.1 - expected.1).abs() < 1e-13, "{lit:?}");
    }
}

#[test]
fn a_card_seen_edge_on_neither_shades_nor_stops() {
    let mask = AlphaMask::new([8, 8], [Wrap::Repeat; 2], |column, row| (column + row) % 2 == 0);
    let scene = card(mask, 0.0, 1.0);
    // Light within the card's plane: a line of the ray at the most.
    assert_radiance(radiance(&scene, &sun([0.0, 0.0, 1.0])), lit_but(&[]));
    // A ray within the card's plane, to which the light comes from above: it sees the card edge on.
    let mut scene = scene;
    for p in &mut scene.positions {
        p.y = 0.0;
    }
    let found = radiance(&scene, &sun([0.0, -1.0, 0.0]));
    assert!((0.0..=lit_but(&[]) * 1.000_001).contains(&found), "{found}");
}

#[test]
fn a_fence_of_a_million_slats_takes_a_moment_and_lets_half_through() {
    let mask = AlphaMask::new([2, 1], [Wrap::Repeat; 2], |column, _| column == 0);
    let found = radiance(&card(mask, 0.0, 1e6), &sun([0.0, -1.0, 0.0]));
    // Each slat's gap takes half of its light, but for the attenuation within a slat: a millionth.
    let expected = lit_but(&[(0.0, 8.0)]) + 0.5 * (lit_but(&[]) - lit_but(&[(0.0, 8.0)]));
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
}

#[test]
fn a_fence_of_ten_million_slats_is_refused_before_any_work() {
    let mask = |wrap: Wrap| AlphaMask::new([2, 1], [wrap; 2], |column, _| column == 0);
    let supports = |scene: &Scene| {
        let camera = perspective(DVec3::ONE, DVec3::ZERO);
        let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let texels = [f32::INFINITY; 15];
        let depth = DepthMap::new(&texels, [5, 3]).unwrap();
        let light = sun([0.0, -1.0, 0.0]);
        let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 10.0).unwrap();
        let caster = SceneCaster::new(scene).unwrap();
        let mut truth = RaycastTruth::new(&caster);
        let supported = truth.supports(&frame);
        assert_eq!(truth.render(&frame, &mut ScatterImage::new()).is_ok(), supported.is_ok());
        supported
    };
    let refused = supports(&card(mask(Wrap::Repeat), 0.0, 1e7)).unwrap_err();
    assert!(refused.reason.contains("four million texels"), "{refused}");
    assert!(supports(&card(mask(Wrap::MirroredRepeat), 0.0, f64::from(u32::MAX))).is_err());
    // Clamped, it has two texels, however far it goes; and a few repeats anywhere are a few.
    assert_eq!(supports(&card(mask(Wrap::ClampToEdge), -1e300, 1e300)), Ok(()));
    assert_eq!(supports(&card(mask(Wrap::Repeat), 1e12, 1e12 + 8.0)), Ok(()));
}

/// Masks for two thirds of the triangles: coarse and fine ones, with all wraps, over up to a few textures.
pub(super) fn cut_out(random: &mut Random, scene: &mut Scene) {
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    for _ in 0..4 {
        let size = [random.range(1.0, 12.0) as u32, random.range(1.0, 12.0) as u32];
        let seed = random.range(0.0, 1e6) as u32;
        let wrap = [random.pick(&wraps), random.pick(&wraps)];
        scene.masks.push(AlphaMask::new(size, wrap, |column, row| {
            (column.wrapping_mul(0x9e37_79b9) ^ row.wrapping_mul(0x85eb_ca6b) ^ seed)
                .wrapping_mul(0xc2b2_ae35)
                >> 31
                == 0
        }));
    }
    for triangle in 0..scene.triangles.len() as u32 {
        if random.range(0.0, 1.0) < 0.67 {
            let spread = random.pick(&[0.3, 1.0, 3.0]);
            let uv = [0; 3].map(|_| DVec2::new(random.range(-spread, spread), random.range(-spread, spread)));
            let mask = random.range(0.0, 4.0) as u32;
            scene.cutouts.push(Cutout { triangle, mask, uv });
        }
    }
}

#[test]
fn cutouts_agree_with_the_second_way_under_every_light() {
    let mut random = Random(21);
    for round in 0..60 {
        let mut setting = random_setting(&mut random, DVec3::ZERO, |r| match round % 3 {
            0 => PlainLight::Sun { travel: r.direction() },
            1 => PlainLight::Lamp { position: r.in_cube(6.0) },
            _ => {
                let position = r.in_cube(6.0);
                let axis = (r.in_cube(2.0) - position).normalize();
                PlainLight::Spot { position, axis, inner_degrees: 20.0, outer_degrees: r.range(25.0, 80.0) }
            }
        });
        // Fewer, so that many rays are lit in pieces.
        setting.scene.triangles.truncate(40);
        cut_out(&mut random, &mut setting.scene);
        setting.check(10.0 * TOLERANCE);
    }
}

#[test]
fn rays_towards_a_sun_see_it_through_the_holes() {
    let mut random = Random(22);
    for _ in 0..40 {
        let mut setting = random_setting(&mut random, DVec3::ZERO, |_| PlainLight::Sun { travel: DVec3::X });
        setting.light = PlainLight::Sun { travel: -setting.camera.pixel_ray(2, 1).direction };
        setting.scene.triangles.truncate(12);
        cut_out(&mut random, &mut setting.scene);
        setting.check(TOLERANCE);
    }
}

/// All pixels of a view into the scene, under a sun and a lamp.
fn pictures(random: u64, scene: &Scene) -> Vec<[f32; 3]> {
    let mut random = Random(random);
    let camera = perspective(random.in_cube(6.0), random.in_cube(1.0)).with_size([32, 24]).unwrap();
    let lights = [sun(random.direction().to_array()), Light::point([1.0, 2.0, 3.0], [1.0; 3], 0.0).unwrap()];
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let texels = vec![f32::INFINITY; 32 * 24];
    let depth = DepthMap::new(&texels, [32, 24]).unwrap();
    let caster = SceneCaster::new(scene).unwrap();
    let picture = |light: &Light| {
        let frame = Frame::new(&camera, depth, light, &ShadowMap::Unshadowed, &medium, 30.0).unwrap();
        let mut image = ScatterImage::new();
        RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
        [image.inscattered(), image.transmittance()].concat()
    };
    lights.iter().flat_map(picture).collect()
}

#[test]
fn a_mask_that_is_all_there_changes_no_bit_and_one_that_is_all_gone_leaves_nothing() {
    let mut random = Random(23);
    for round in 0..6 {
        let opaque = soup(&mut random, 60, DVec3::ZERO);
        let with = |is_there: bool, random: &mut Random| {
            let mut scene = opaque.clone();
            cut_out(random, &mut scene);
            scene.masks.fill(AlphaMask::new([9, 9], [Wrap::MirroredRepeat, Wrap::Repeat], |_, _| is_there));
            scene
        };
        assert_eq!(pictures(round, &with(true, &mut random)), pictures(round, &opaque));
        let mut gone = with(false, &mut random);
        let pictured = pictures(round, &gone);
        let is_card = |index: &u32| gone.cutouts.iter().any(|cutout| cutout.triangle == *index);
        gone.triangles =
            (0..60).filter(|index| !is_card(index)).map(|n| gone.triangles[n as usize]).collect();
        gone.cutouts.clear();
        assert_eq!(pictured, pictures(round, &gone));
    }
}
