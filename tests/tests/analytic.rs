//! Scenes with a known answer: a half-plane, a slab, a slit and a lamp's disc, for both references.
//!
//! Expected values come from geometry worked out here and from `scatter-validate`'s closed forms, which share no physics
//! with the core. The sun shines straight down (−y) on rays that run along −z; a screen at y = 1 over `z₀ > z > z₁`
//! then shadows exactly `−z₀ < t < −z₁` of the ray from the origin.

use glam::DVec3;
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer,
    ShadowMap, VolumetricShadow,
};
use scatter_scene::{RaycastTruth, Scene, SceneCaster};
use scatter_validate::closed_form::{Channel, Lamp, PhaseFunction, lamp_radiance, sun_radiance};

const SIGMA_S: f64 = 0.07;
const SIGMA_A: f64 = 0.01;
const LENGTH: f64 = 20.0;
/// Pixels are f32.
const F32: f64 = 1.2e-7;

fn medium() -> Medium {
    Medium::homogeneous([SIGMA_S; 3], [SIGMA_A; 3], Phase::HenyeyGreenstein { g: 0.6 }).unwrap()
}

/// Horizontal rectangles, `[x₀, x₁, y, z₀, z₁]`, two triangles each.
fn screens(parts: &[[f64; 5]]) -> SceneCaster {
    let mut scene = Scene::default();
    for &[x0, x1, y, z0, z1] in parts {
        let first = scene.positions.len() as u32;
        let corners = [(x0, z0), (x1, z0), (x1, z1), (x0, z1)];
        scene.positions.extend(corners.map(|(x, z)| DVec3::new(x, y, z)));
        scene.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    SceneCaster::new(&scene).unwrap()
}

/// One pixel that looks along −z from the origin.
fn render(technique: &mut dyn VolumetricShadow, light: &Light, shadow: &ShadowMap<'_>) -> f64 {
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, [1, 1]).unwrap();
    let (medium, depth) = (medium(), [f32::INFINITY]);
    let depth = DepthMap::new(&depth, [1, 1]).unwrap();
    let frame = Frame::new(&camera, depth, light, shadow, &medium, LENGTH).unwrap();
    let mut image = ScatterImage::new();
    technique.render(&frame, &mut image).unwrap();
    f64::from(image.at(0, 0)[1])
}

fn lit_sun(parts: &[(f64, f64)]) -> f64 {
    let components = [(SIGMA_S, PhaseFunction::HenyeyGreenstein(0.6))];
    let channel = Channel { components: &components, sigma_t: SIGMA_S + SIGMA_A };
    parts.iter().map(|&(a, b)| sun_radiance(2.0, DVec3::NEG_Y, &channel, DVec3::NEG_Z, a, b)).sum()
}

#[track_caller]
fn check(name: &str, value: f64, exact: f64) {
    let error = (value / exact - 1.0).abs();
    println!("{name}: {value:.9e}, relative error {error:.1e}");
    assert!(error < F32, "{name}: {value} {exact}");
}

/// A name, the screens, and the stretches of the ray that they leave lit.
type SunCase = (&'static str, Vec<[f64; 5]>, Vec<(f64, f64)>);

fn sun_cases() -> [SunCase; 3] {
    [
        ("half-plane", vec![[-9.0, 9.0, 1.0, -7.0, -99.0]], vec![(0.0, 7.0)]),
        ("slab", vec![[-9.0, 9.0, 1.0, -4.0, -9.5]], vec![(0.0, 4.0), (9.5, LENGTH)]),
        ("slit", vec![[-9.0, 9.0, 1.0, 5.0, -6.0], [-9.0, 9.0, 1.0, -6.25, -99.0]], vec![(6.0, 6.25)]),
    ]
}

#[test]
fn the_sun_behind_screens_is_the_sum_of_its_closed_forms_by_triangles() {
    let sun = Light::directional([0.0, -1.0, 0.0], [2.0; 3]).unwrap();
    for (name, parts, lit) in sun_cases() {
        let caster = screens(&parts);
        let value = render(&mut RaycastTruth::new(&caster), &sun, &ShadowMap::Unshadowed);
        check(name, value, lit_sun(&lit));
    }
}

#[test]
fn the_sun_behind_screens_is_the_sum_of_its_closed_forms_by_a_map() {
    let sun = Light::directional([0.0, -1.0, 0.0], [2.0; 3]).unwrap();
    for (name, parts, lit) in sun_cases() {
        // Texels of a quarter, so that all edges (multiples of a quarter) fall on texel borders; z from +16 to −112.
        let projection = MapProjection::orthographic(
            [0.0, 3.0, -48.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.5, 64.0],
            [3, 512],
        );
        let projection = projection.unwrap();
        let mut texels = Vec::new();
        screens(&parts).shadow_map(&projection, &mut texels).unwrap();
        let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).unwrap());
        check(name, render(&mut raymarch_ref::ShadowMapWalk::new(), &sun, &shadow), lit_sun(&lit));
        // The marcher samples the middle of 1/100 units: no edge falls into a step, so it is exact but for f32.
        let options = raymarch_ref::Options { steps: 2000, ..Default::default() };
        let marched = render(&mut raymarch_ref::RayMarch::new(options).unwrap(), &sun, &shadow);
        // 2,000 additions of rounded weights: √2000·2⁻²⁴ = 3e-6 at the worst.
        assert!((marched / lit_sun(&lit) - 1.0).abs() < 3e-6, "{name}: {marched}");
    }
}

#[test]
fn a_lamp_behind_a_screen_lights_what_the_screen_leaves() {
    // The lamp hangs at (0, 2, −8); a screen at y = 1 over −6 < z < −4 shadows the ray twice as far from its foot.
    let position = [0.0, 2.0, -8.0];
    let lamp_light = Light::point(position, [2.0; 3], 0.0).unwrap();
    let caster = screens(&[[-9.0, 9.0, 1.0, -4.0, -6.0]]);
    let lit = [(4.0, LENGTH)];
    // t = 8 − 2·(8 − |z|): z = −6 gives 4, z = −4 gives 0.
    let components = [(SIGMA_S, PhaseFunction::HenyeyGreenstein(0.6))];
    let channel = Channel { components: &components, sigma_t: SIGMA_S + SIGMA_A };
    let lamp = Lamp { position: position.into(), intensity: 2.0, cone: None };
    let exact = lit.iter().map(|&(a, b)| lamp_radiance(&lamp, &channel, DVec3::NEG_Z, a, b)).sum();
    let value = render(&mut RaycastTruth::new(&caster), &lamp_light, &ShadowMap::Unshadowed);
    check("lamp by triangles", value, exact);

    // In the −Y face the screen's edges lie at z − z_lamp over depth = 2/1 and 4/1: beyond the face (±1); in the +Z
    // face, v = (z, y): the screen's rim at depth 2 and 4, heights −1. Only the edge of the shadow at t = 4 matters:
    // direction (0, −2, 4), whose v in the +Z face is −2/4: a texel border for any even side.
    let mut texels = Vec::new();
    caster.cube_map(position, 256, &mut texels).unwrap();
    let shadow = ShadowMap::Cube(CubeShadow::new(position, 256, &texels).unwrap());
    check("lamp by a map", render(&mut raymarch_ref::ShadowMapWalk::new(), &lamp_light, &shadow), exact);
}
