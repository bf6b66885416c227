//! Both references against closed forms that are written out here: half-plane, slab, slit, checkerboard.
//!
//! The sun travels along −y and the map looks down from y = 10 on x, z ∈ [−8, 8]; the eye looks along +x, so texels
//! follow each other along the ray and depths are heights.

use raymarch_ref::{Options, RayMarch, ShadowMapWalk};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer, ShadowMap,
    VolumetricShadow,
};

/// What f32 leaves of an f64 sum: the image is f32.
const F32_ROUNDING: f64 = 1.2e-7;
const SIGMA: f64 = 0.07;

/// The radiance of the one pixel that looks along +x from x = −8, for depths `[row][column]` on 16 units of x.
fn radiance(technique: &mut dyn VolumetricShadow, size: [u32; 2], texels: &[f32], end: f64) -> f64 {
    let camera =
        Camera::perspective([-8.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 1.0, 0.0], 1e-3, [1, 1]).unwrap();
    let sun = Light::directional([0.0, -1.0, 0.0], [4.0 * std::f64::consts::PI; 3]).unwrap();
    let projection =
        MapProjection::orthographic([0.0, 10.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [8.0; 2], size)
            .unwrap();
    // The map's u runs along −x: looking down with +z up, right is −x.
    let flipped: Vec<f32> =
        texels.chunks_exact(size[0] as usize).flat_map(|row| row.iter().rev().copied()).collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &flipped).unwrap());
    assert!(projection.texel_from_world([-7.0, 0.0, 0.0].into()).x > 0.5 * f64::from(size[0]));
    let medium = Medium::homogeneous([SIGMA; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let depth = DepthMap::new(&[f32::INFINITY], [1, 1]).unwrap();
    let frame = Frame::new(&camera, depth, &sun, &shadow, &medium, end).unwrap();
    let mut image = ScatterImage::new();
    technique.render(&frame, &mut image).unwrap();
    f64::from(image.at(0, 0)[0])
}

/// `E·σ/4π·∫ₐᵇ e^{−σt} dt` with E = 4π.
fn lit(a: f64, b: f64) -> f64 {
    (-SIGMA * a).exp() - (-SIGMA * b).exp()
}

/// The walk to rounding, the march to a step an edge.
#[track_caller]
fn assert_radiance(size: [u32; 2], texels: &[f32], end: f64, expected: f64, edges: u32) {
    const STEPS: u32 = 8192;
    let walked = radiance(&mut ShadowMapWalk::new(), size, texels, end);
    assert!((walked - expected).abs() <= F32_ROUNDING * expected, "walked {walked}, expected {expected}");
    let marched = radiance(
        &mut RayMarch::new(Options { steps: STEPS, ..Options::default() }).unwrap(),
        size,
        texels,
        end,
    );
    // The reach of the march is the ray's end or optical depth 17, whichever is nearer.
    let step = end.min(17.0 / SIGMA) / f64::from(STEPS);
    let tolerance = SIGMA * step * f64::from(edges) + 1e-6 * expected;
    assert!((marched - expected).abs() <= tolerance, "marched {marched}, expected {expected}");
}

/// Above the eye's height: the ray (depth 10) lies in shadow.
const DARK: f32 = 9.0;
const LIT: f32 = f32::INFINITY;

#[test]
fn a_half_plane_leaves_the_part_before_its_edge() {
    let texels: Vec<f32> = (0..32).map(|i| if i < 13 { LIT } else { DARK }).collect();
    // 32 columns of ½ unit: the edge lies at 6.5.
    assert_radiance([32, 1], &texels, 12.0, lit(0.0, 6.5), 1);
}

#[test]
fn behind_the_map_the_ray_is_lit_again_and_for_ever() {
    let texels: Vec<f32> = (0..32).map(|i| if i < 13 { LIT } else { DARK }).collect();
    let expected = lit(0.0, 6.5) + lit(16.0, f64::INFINITY);
    assert_radiance([32, 1], &texels, f64::INFINITY, expected, 2);
}

#[test]
fn a_slab_takes_out_its_own_stretch() {
    let texels: Vec<f32> = (0..7 * 3).map(|i| if i % 7 == 2 || i % 7 == 3 { DARK } else { LIT }).collect();
    let (from, to) = (2.0 * 16.0 / 7.0, 4.0 * 16.0 / 7.0);
    assert_radiance([7, 3], &texels, 15.0, lit(0.0, from) + lit(to, 15.0), 2);
}

#[test]
fn a_slit_lets_its_own_stretch_through() {
    let texels: Vec<f32> = (0..101).map(|i| if i == 40 { LIT } else { DARK }).collect();
    let (from, to) = (40.0 * 16.0 / 101.0, 41.0 * 16.0 / 101.0);
    assert_radiance([101, 1], &texels, 15.0, lit(from, to), 2);
}

#[test]
fn a_checkerboard_leaves_every_other_texel() {
    let size = [64u32, 5];
    let texels: Vec<f32> =
        (0..5).flat_map(|j| (0..64).map(move |i| if (i + j) % 2 == 0 { DARK } else { LIT })).collect();
    // z = ½ lies in row 2 of 5 (z from 1.6 to −1.6), so odd columns are lit.
    let expected = (0..32).map(|k| lit(0.25 * f64::from(2 * k + 1), 0.25 * f64::from(2 * k + 2))).sum();
    assert_radiance(size, &texels, 16.0, expected, 64);
}

#[test]
fn a_rising_ray_enters_the_light_where_it_crosses_the_depth() {
    // One texel over everything at height 3; the ray rises by 1 in 4 and leaves the shadow at x = −8 + 12.
    let camera =
        Camera::perspective([-8.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 1e-3, [1, 1]).unwrap();
    let sun = Light::directional([0.0, -1.0, 0.0], [4.0 * std::f64::consts::PI; 3]).unwrap();
    let projection =
        MapProjection::orthographic([0.0, 10.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [50.0; 2], [1, 1])
            .unwrap();
    let texel = [7.0f32];
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texel).unwrap());
    let medium = Medium::homogeneous([SIGMA; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let depth = DepthMap::new(&[20.0], [1, 1]).unwrap();
    let frame = Frame::new(&camera, depth, &sun, &shadow, &medium, 100.0).unwrap();
    let mut image = ScatterImage::new();
    ShadowMapWalk::new().render(&frame, &mut image).unwrap();
    let crossing = 12.0 * 17f64.sqrt() / 4.0;
    let expected = lit(crossing, 20.0);
    assert!((f64::from(image.at(0, 0)[0]) - expected).abs() < F32_ROUNDING * expected);
}
