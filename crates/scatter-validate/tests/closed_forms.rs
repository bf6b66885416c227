//! scatter-core's physics against closed forms that share nothing with it, over a wide grid: the guard against a fault
//! that all techniques would inherit. Prints the worst relative difference of each kind of light.

use glam::DVec3;
use scatter_core::{HeightFalloff, Light, Medium, Phase, RayLight, Scattering, ViewRay};
use scatter_validate::closed_form::{
    Channel, Cone, Fog, Lamp, PhaseFunction, fog_lamp_radiance, fog_sun_radiance, lamp_radiance, sun_radiance,
};

/// Media as both sides write them: particles, and absorption.
fn media() -> Vec<(Vec<(f64, PhaseFunction)>, f64)> {
    use PhaseFunction::{HenyeyGreenstein, Isotropic, Rayleigh};
    vec![
        (vec![(1.0, Isotropic)], 0.0),
        (vec![(1.0, Rayleigh)], 0.3),
        (vec![(0.7, HenyeyGreenstein(0.8))], 0.0),
        (vec![(0.7, HenyeyGreenstein(-0.95))], 0.1),
        (vec![(0.4, Rayleigh), (0.2, HenyeyGreenstein(0.76))], 0.05),
    ]
}

fn medium(components: &[(f64, PhaseFunction)], sigma_a: f64, scale: f64) -> Medium {
    let components = components
        .iter()
        .map(|&(sigma_s, phase)| Scattering {
            sigma_s: [sigma_s * scale; 3],
            phase: match phase {
                PhaseFunction::Isotropic => Phase::Isotropic,
                PhaseFunction::Rayleigh => Phase::Rayleigh,
                PhaseFunction::HenyeyGreenstein(g) => Phase::HenyeyGreenstein { g },
            },
        })
        .collect();
    Medium::new(components, [sigma_a * scale; 3]).unwrap()
}

/// The worst relative difference between the core and `closed` over media, extinctions, rays and intervals.
fn worst_difference(
    light: &Light,
    closed: impl Fn(&Channel<'_>, DVec3, f64, f64) -> f64,
    intervals: &[(f64, f64)],
) -> f64 {
    let mut worst: f64 = 0.0;
    for (components, sigma_a) in media() {
        for scale in [1e-9, 1e-3, 0.1, 1.0, 20.0] {
            let model = medium(&components, sigma_a, scale);
            let scaled: Vec<_> = components.iter().map(|&(s, phase)| (s * scale, phase)).collect();
            let channel = Channel { components: &scaled, sigma_t: model.sigma_t()[0] };
            for view in views() {
                let ray = ViewRay { origin: DVec3::ZERO, direction: view };
                let core = RayLight::new(light, &model, DVec3::ZERO, &ray);
                for &(a, b) in intervals {
                    let (ours, theirs) = (closed(&channel, view, a, b), core.interval(a, b).x);
                    // Below 1e-290 a product of five factors is made of denormals.
                    if ours > 1e-290 || theirs > 1e-290 {
                        let difference = (theirs / ours - 1.0).abs();
                        assert!(
                            difference < TOLERANCE,
                            "{components:?} × {scale}, {view}, [{a}, {b}]: core {theirs}, closed form {ours}"
                        );
                        worst = worst.max(difference);
                    }
                }
            }
        }
    }
    worst
}

/// Both sides promise 1e-12; g = −0.95 costs 2g/(1−g)² = 760 ulp of the cosine (the closed forms take it as it is),
/// and an exponent of 700 costs 700 ulp.
const TOLERANCE: f64 = 2e-12;

fn views() -> Vec<DVec3> {
    [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.3, 1.0, 0.2], [-0.5, -0.1, -0.7], [0.1, -0.02, -1.0]]
        .map(|v| DVec3::from(v).normalize())
        .to_vec()
}

const INTERVALS: [(f64, f64); 8] =
    [(0.0, 1e-6), (0.0, 1.0), (0.0, 30.0), (3.0, 3.01), (6.9, 7.1), (2.0, 50.0), (20.0, 1e4), (0.0, 1e6)];

#[test]
fn the_sun_is_the_closed_form() {
    let travel = DVec3::new(0.2, -1.0, 0.3);
    let light = Light::directional(travel.to_array(), [2.5; 3]).unwrap();
    let travel = travel.normalize();
    let closed = |channel: &Channel<'_>, view, a, b| sun_radiance(2.5, travel, channel, view, a, b);
    let worst = worst_difference(&light, closed, &INTERVALS);
    println!("sun: worst relative difference {worst:.1e}");
}

#[test]
fn an_endless_ray_under_the_sun_is_the_closed_form() {
    let light = Light::directional([0.2, -1.0, 0.3], [2.5; 3]).unwrap();
    let travel = DVec3::new(0.2, -1.0, 0.3).normalize();
    let closed = |channel: &Channel<'_>, view, a, b| sun_radiance(2.5, travel, channel, view, a, b);
    let worst = worst_difference(&light, closed, &[(0.0, f64::INFINITY), (5.0, f64::INFINITY)]);
    println!("sun, endless: worst relative difference {worst:.1e}");
}

#[test]
fn a_point_light_is_the_closed_form() {
    for position in [[1.0, 2.0, -7.0], [0.0, 1e-3, -7.0], [0.0, -4.0, 1e-2], [300.0, 1.0, 40.0]] {
        let light = Light::point(position, [3.0; 3], 0.0).unwrap();
        let lamp = Lamp { position: position.into(), intensity: 3.0, cone: None };
        let closed = |channel: &Channel<'_>, view, a, b| lamp_radiance(&lamp, channel, view, a, b);
        let worst = worst_difference(&light, closed, &INTERVALS);
        println!("point light at {position:?}: worst relative difference {worst:.1e}");
    }
}

#[test]
fn a_spot_is_the_closed_form() {
    let position = [1.0, 2.0, -7.0];
    for (axis, inner, outer) in [
        ([0.0, -1.0, 0.0], 20.0, 35.0),
        ([-0.3, -0.5, 0.9], 5.0, 60.0),
        ([0.4, -1.0, -0.3], 30.0, 30.0),
        ([0.0, 0.0, 1.0], 0.0, 90.0),
    ] {
        let light = Light::spot(position, axis, [3.0; 3], inner, outer, 0.0).unwrap();
        let cone = Cone {
            axis: DVec3::from(axis).normalize(),
            inner: f64::to_radians(inner),
            outer: f64::to_radians(outer),
        };
        let lamp = Lamp { position: position.into(), intensity: 3.0, cone: Some(cone) };
        let closed = |channel: &Channel<'_>, view, a, b| lamp_radiance(&lamp, channel, view, a, b);
        let worst = worst_difference(&light, closed, &INTERVALS);
        println!("spot {inner}°/{outer}°: worst relative difference {worst:.1e}");
    }
}

/// Fogs as both sides write them: up, height of the eye above the base, scale height.
fn fogs() -> [(DVec3, f64, f64); 6] {
    let tilted = DVec3::new(0.3, 0.9, -0.2);
    [
        (DVec3::Y, 1.5, 1e9),
        (DVec3::Y, 1.5, 0.7),
        (DVec3::Y, 40.0, 1.0),
        (tilted, -3.0, 2.0),
        (tilted, 1.0, 8.0),
        (DVec3::NEG_Z, 0.5, 3.0),
    ]
}

/// The worst relative difference between the core and `closed` over media, extinctions, fogs, rays and intervals.
fn worst_difference_in_fog(
    (eye, unit): (DVec3, f64),
    light_of: impl Fn(DVec3) -> Light,
    closed: impl Fn(&Channel<'_>, &Fog, (DVec3, f64, f64)) -> f64,
    intervals: &[(f64, f64)],
    scales: &[f64],
) -> f64 {
    let mut worst: f64 = 0.0;
    for (components, sigma_a) in media().into_iter().step_by(2) {
        for &scale in scales {
            let scaled: Vec<_> = components.iter().map(|&(s, phase)| (s * scale, phase)).collect();
            for (up, start_height, scale_height) in fogs() {
                let base = up.normalize().dot(eye) - start_height;
                let falloff = HeightFalloff::new(up.to_array(), base, scale_height).unwrap();
                let model = medium(&components, sigma_a, scale).with_height_falloff(falloff);
                let channel = Channel { components: &scaled, sigma_t: model.sigma_t()[0] };
                let fog = Fog { up: up.normalize(), start_height, scale: scale_height };
                for view in views() {
                    let ray = ViewRay { origin: DVec3::ZERO, direction: view };
                    let light = light_of(eye);
                    let core = RayLight::new(&light, &model, eye, &ray);
                    for &(a, b) in intervals {
                        let (ours, theirs) = (closed(&channel, &fog, (view, a, b)), core.interval(a, b).x);
                        if ours > 1e-290 || theirs > 1e-290 {
                            // An optical depth of τ multiplies the relative error of a density.
                            let difference = (theirs / ours - 1.0).abs() / (1.0 + ours.ln().abs());
                            assert!(
                                difference < unit,
                                "{components:?} × {scale}, {fog:?}, {view}, [{a}, {b}]: core {theirs:e}, closed {ours:e}"
                            );
                            worst = worst.max(difference);
                        }
                    }
                }
            }
        }
    }
    worst
}

/// Eyes, and how well a density is known there: the base height of an eye 1e5 units from the origin is good to 3e-11 units,
/// and scale heights go down to 0.7.
const EYES: [(DVec3, f64); 2] = [(DVec3::ZERO, 2e-12), (DVec3::new(1e5, -2e5, 7.0), 1e-10)];

#[test]
fn the_sun_in_height_fog_is_the_closed_form() {
    let travel = DVec3::new(0.2, -1.0, 0.3);
    let closed = |channel: &Channel<'_>, fog: &Fog, stretch| {
        fog_sun_radiance(2.5, travel.normalize(), channel, fog, stretch)
    };
    let light = |_| Light::directional(travel.to_array(), [2.5; 3]).unwrap();
    let intervals = [(0.0, 1e-6), (0.0, 1.0), (0.0, 30.0), (3.0, 3.01), (2.0, 50.0), (20.0, 80.0)];
    for eye in EYES {
        let worst = worst_difference_in_fog(eye, light, closed, &intervals, &[1e-9, 1e-3, 0.1, 1.0, 20.0]);
        println!("sun in height fog, eye at {}: worst relative difference {worst:.1e} a unit of ln L", eye.0);
    }
}

#[test]
fn lamps_in_height_fog_are_the_quadrature() {
    let cone = Cone { axis: DVec3::NEG_Y, inner: 20f64.to_radians(), outer: 50f64.to_radians() };
    for (position, cone, eye) in [
        ([1.0, 2.0, -7.0], None, EYES[1]),
        ([0.0, 0.05, -4.0], None, EYES[0]),
        ([0.5, 3.0, -5.0], Some(cone), EYES[0]),
    ] {
        let lamp = Lamp { position: position.into(), intensity: 3.0, cone };
        let closed =
            |channel: &Channel<'_>, fog: &Fog, stretch| fog_lamp_radiance(&lamp, channel, fog, stretch);
        let light = |eye: DVec3| {
            let place = (eye + DVec3::from(position)).to_array();
            match cone {
                None => Light::point(place, [3.0; 3], 0.0).unwrap(),
                Some(_) => Light::spot(place, [0.0, -1.0, 0.0], [3.0; 3], 20.0, 50.0, 0.0).unwrap(),
            }
        };
        let intervals = [(0.0, 30.0), (3.0, 3.5), (6.0, 12.0)];
        let worst = worst_difference_in_fog(eye, light, closed, &intervals, &[1e-9, 0.1, 3.0]);
        println!("lamp at {position:?} in height fog: worst relative difference {worst:.1e} a unit of ln L");
    }
}
