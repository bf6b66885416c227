//! Smoke and hair on view rays: the exact cuts against thousands of samples of the second way.

use super::*;
use crate::translucent::second_way::{FarOrNear, random_occluders, transmittance};

/// In-scattered radiance of a light of strength 1 by the midpoint rule, for a lamp in its own variable as well.
fn sampled(second: &SecondWay<'_>, end: f64, samples: usize) -> f64 {
    let PlainMedium { sigma_s, sigma_a, g } = second.medium;
    let phase =
        |cos: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5) / (4.0 * std::f64::consts::PI);
    let step = end / samples as f64;
    let mut sum = 0.0;
    for index in 0..samples {
        let t = (index as f64 + 0.5) * step;
        let p = second.start + second.along * t;
        if !second.is_lit(t) {
            continue;
        }
        let (light, cos, incoming) = match second.light {
            PlainLight::Sun { travel } => (FarOrNear::Sun { travel }, -travel.dot(second.along), 1.0),
            PlainLight::Lamp { position } | PlainLight::Spot { position, .. } => {
                let way = p - (position - second.eye);
                let distance = way.length();
                let cos = -way.dot(second.along) / distance;
                let incoming = (-(sigma_s + sigma_a) * distance).exp() / (distance * distance);
                (FarOrNear::Lamp { position }, cos, incoming * second.cone(t))
            }
        };
        let left = transmittance(second.scene, light, p + second.eye);
        sum += sigma_s * phase(cos) * incoming * left * (-(sigma_s + sigma_a) * t).exp() * step;
    }
    sum
}

/// Samples of a ray.
const SAMPLES: usize = 4000;

fn check(random: &mut Random, light: PlainLight, scene: &Scene, tolerance: f64) -> f64 {
    let medium = PlainMedium { sigma_s: 0.08, sigma_a: 0.02, g: 0.4 };
    let model = Medium::homogeneous([0.08; 3], [0.02; 3], Phase::henyey_greenstein(0.4).unwrap()).unwrap();
    let lamp = light_of(light);
    let eye = random.in_cube(5.0);
    let camera = perspective(eye, random.in_cube(1.0)).with_size([4, 3]).unwrap();
    let texels = vec![f32::INFINITY; 12];
    let depth = DepthMap::new(&texels, [4, 3]).unwrap();
    let frame = Frame::new(&camera, depth, &lamp, &ShadowMap::Unshadowed, &model, 11.0).unwrap();
    let caster = SceneCaster::new(scene).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
    let mut worst = 0.0f64;
    for index in 0..12u32 {
        let ray = camera.pixel_ray(index % 4, index / 4);
        let second = SecondWay { scene, light, medium, eye, start: ray.origin, along: ray.direction };
        let end = second.ray_end(11.0);
        let expected = sampled(&second, end, SAMPLES);
        let unoccluded = second.radiance(0.0, end);
        let found = f64::from(image.inscattered()[index as usize][0]);
        // Beside a spot's cone.
        if unoccluded == 0.0 {
            assert_eq!(found, 0.0);
            continue;
        }
        let error = (found - expected).abs() / unoccluded;
        worst = worst.max(error);
        assert!(error < tolerance, "pixel {index}: error {error:e}, {expected} of {unoccluded}");
    }
    worst
}

fn lights(random: &mut Random) -> [PlainLight; 3] {
    let position = random.direction() * 7.0;
    [
        PlainLight::Sun { travel: random.direction() },
        PlainLight::Lamp { position },
        PlainLight::Spot { position, axis: -position.normalize(), inner_degrees: 20.0, outer_degrees: 35.0 },
    ]
}

#[test]
fn smoke_is_what_thousands_of_samples_see() {
    let mut random = Random(31);
    let mut worst = 0.0f64;
    for _ in 0..3 {
        for light in lights(&mut random) {
            let scene = random_occluders(&mut random, 8, 0);
            // The square roots at the edges of spheres cost the midpoint rule h^(3/2) a sphere, and a cone
            // that is passed aslant as much.
            worst = worst.max(check(&mut random, light, &scene, 2e-5));
        }
    }
    println!("largest difference {worst:.1e}");
}

#[test]
fn hair_smoke_and_walls_are_what_thousands_of_samples_see() {
    let mut random = Random(32);
    let mut worst = 0.0f64;
    for _ in 0..4 {
        for light in lights(&mut random) {
            let mut scene = soup(&mut random, 3, DVec3::ZERO);
            let others = random_occluders(&mut random, 4, 12);
            (scene.particles, scene.strands) = (others.particles, others.strands);
            // Every jump costs the midpoint rule up to half a step: 20 jumps of 1/8000, if they all fell one way.
            worst = worst.max(check(&mut random, light, &scene, 2.5e-3));
        }
    }
    println!("largest difference {worst:.1e}");
}

#[test]
fn a_light_on_the_rays_own_line_is_dimmed_along_it() {
    // A ray straight into the sun through one sphere and past one strand: closed form by hand.
    let mut scene = Scene::default();
    scene.particles.push(crate::translucent::Particle {
        centre: DVec3::new(0.0, 0.0, -5.0),
        radius: 1.0,
        density: 0.7,
    });
    let vertex = |x: f64| crate::translucent::StrandVertex {
        position: DVec3::new(x, 0.05, -8.0),
        radius: 0.1,
        opacity: 0.25,
    };
    scene.strands.push([vertex(-1.0), vertex(1.0)]);
    let caster = SceneCaster::new(&scene).unwrap();
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 40.0, [1, 1]).unwrap();
    let sigma = 0.1f64;
    let medium = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let texels = [f32::INFINITY];
    let depth = DepthMap::new(&texels, [1, 1]).unwrap();
    let image = |light: &Light, end: f64| {
        let frame = Frame::new(&camera, depth, light, &ShadowMap::Unshadowed, &medium, end).unwrap();
        let mut image = ScatterImage::new();
        RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
        f64::from(image.inscattered()[0][0]) * 4.0 * std::f64::consts::PI
    };
    let part = |a: f64, b: f64, rate: f64, at_a: f64| {
        // ∫σ e^{−σt} e^{−rate(t − a)} dt with the transmittance `at_a` at a.
        let x = (sigma + rate) * (b - a);
        at_a * sigma * (-sigma * a).exp() * (b - a) * if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
    };
    // Towards the sun the chord ahead of the point shrinks.
    let through = (-1.4f64).exp();
    let towards = 0.75
        * (part(0.0, 4.0, 0.0, through) + part(4.0, 6.0, -0.7, through) + part(6.0, 8.0, 0.0, 1.0))
        + part(8.0, 12.0, 0.0, 1.0);
    let sun = Light::directional([0.0, 0.0, 1.0], [1.0; 3]).unwrap();
    assert!((image(&sun, 12.0) - towards).abs() < 1e-6, "{} {towards}", image(&sun, 12.0));
    // With the sun behind the eye it grows.
    let away = part(0.0, 4.0, 0.0, 1.0)
        + part(4.0, 6.0, 0.7, 1.0)
        + part(6.0, 8.0, 0.0, through)
        + 0.75 * part(8.0, 12.0, 0.0, through);
    let sun = Light::directional([0.0, 0.0, -1.0], [1.0; 3]).unwrap();
    assert!((image(&sun, 12.0) - away).abs() < 1e-6, "{} {away}", image(&sun, 12.0));
}
