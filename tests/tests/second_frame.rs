//! All buffers live in the technique: the second frame of a size allocates nothing, though the camera moves.
//!
//! The rule of the house asks this of every technique by its defaults, on its small scenes. Here are those that have
//! more to hold: larger pictures, and options that are rarely set.

use raymarch_ref::ShadowMapWalk;
use scatter::{TECHNIQUES, Target};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, Phase, Quality,
    ScatterImage, Scattering, SceneFacts, ShadowLayer, ShadowMap, VolumetricShadow,
};
use scatter_validate::checks::counting_allocator::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Presets measure their spacing from a diagonal of 480 pixels on: one below that, and one beyond it that is not high.
const SIZES: [[u32; 2]; 2] = [[67, 45], [481, 35]];

/// Every technique's options that need buffers of their own, by its id.
const OPTIONS: [(&str, &[(&str, &str)]); 5] = [
    ("raymarch", &[("steps", "33"), ("jitter", "1")]),
    ("epipolar", &[("cells", "box"), ("rank", "8")]),
    ("epipolar", &[("integrator", "tree"), ("around", "ring")]),
    ("epipolar", &[("integrator", "cursor"), ("cells", "modes")]),
    ("epipolar", &[("integrator", "sweep"), ("resampling", "rectified")]),
];

/// What renders a picture: the exact walk and every technique in each of its ways, with names; a wide picture
/// only by what techniques choose themselves for a game.
fn instances(facts: &SceneFacts, is_wide: bool) -> Vec<(String, Box<dyn VolumetricShadow>)> {
    let preset = Target::Quality(Quality::Game);
    let mut instances: Vec<(String, Box<dyn VolumetricShadow>)> = Vec::new();
    if !is_wide {
        instances.push(("truth-shadow-map".into(), Box::new(ShadowMapWalk::new())));
    }
    for technique in TECHNIQUES {
        let id = technique.info().id;
        let mut ways = vec![(preset, &[][..])];
        if !is_wide {
            ways.extend([(Target::Quality(Quality::Preview), &[][..]), (Target::Error(0.02), &[])]);
            ways.extend(OPTIONS.iter().filter(|(of, _)| *of == id).map(|&(_, options)| (preset, options)));
        }
        for (target, options) in ways {
            let name = format!("{id}, {target:?} {options:?}");
            match (target, technique.configure(target, options, facts)) {
                (_, Ok(instance)) => instances.push((name, instance)),
                // Not every error can be promised for every light.
                (Target::Error(_), Err(_)) => {}
                (Target::Quality(_), Err(error)) => panic!("{name}: {error}"),
            }
        }
    }
    instances
}

/// Allocations of the first and of the second frame.
fn allocated(instance: &mut dyn VolumetricShadow, frames: [&Frame<'_>; 2]) -> [u64; 2] {
    let mut image = ScatterImage::new();
    frames.map(|frame| {
        let before = allocations_of_this_thread().unwrap_or(0);
        instance.render(frame, &mut image).unwrap();
        allocations_of_this_thread().expect("this program counts its allocations") - before
    })
}

#[test]
fn the_second_frame_allocates_nothing_though_the_camera_moves() {
    // In one thread: what rayon's queues do when several threads share a frame is not ours to count.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let tried = pool.install(|| SIZES.map(try_every_light).into_iter().flatten().collect::<Vec<_>>());
    // Nobody is excused: with a sun, at each size, glass or none.
    for technique in TECHNIQUES {
        let id = technique.info().id;
        let count = tried.iter().filter(|name| name.starts_with(id)).count();
        println!("{id}: {count} pairs of frames");
        assert!(count >= 3 * 2 * SIZES.len(), "{id}: {count}");
    }
}

/// Renders pairs of frames under every kind of light and map; returns the names of what rendered them.
fn try_every_light(size: [u32; 2]) -> Vec<String> {
    let camera = Camera::perspective([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, size).unwrap();
    let distances: Vec<f32> = (0..size[0] * size[1]).map(|i| 4.0 + (i % 9) as f32).collect();
    let depth = DepthMap::new(&distances, size).unwrap();
    let texels: Vec<f32> =
        (0..6 * 64 * 64).map(|i| if i % 7 < 3 { f32::INFINITY } else { 2.0 + (i % 5) as f32 }).collect();
    let component = |phase| Scattering { sigma_s: [0.1, 0.2, 0.3], phase };
    let medium = Medium::new(
        vec![component(Phase::Rayleigh), component(Phase::HenyeyGreenstein { g: 0.5 })],
        [0.0; 3],
    )
    .unwrap();
    let (down, up) = ([0.1, -1.0, 0.2], [0.0, 0.0, 1.0]);
    let parallel = |half: f64| {
        let projection = MapProjection::orthographic([0.0, 8.0, 0.0], down, up, [half; 2], [64, 48]).unwrap();
        ShadowLayer::new(projection, &texels[..64 * 48]).unwrap()
    };
    let cone = MapProjection::perspective([0.0, 8.0, 0.0], down, up, 0.5, 64).unwrap();
    let sun = Light::directional(down, [1.0; 3]).unwrap();
    let spot = Light::spot([0.0, 8.0, 0.0], down, [5.0; 3], 10.0, 26.0, 0.0).unwrap();
    let wide = Light::spot([0.0, 3.0, 0.0], down, [5.0; 3], 40.0, 88.0, 0.0).unwrap();
    let point = Light::point([0.0, 3.0, 0.0], [5.0; 3], 0.0).unwrap();
    let cube = || ShadowMap::Cube(CubeShadow::new([0.0, 3.0, 0.0], 64, &texels).unwrap());
    let cascades = [parallel(2.0), parallel(5.0)];
    let shadows = [
        (&sun, ShadowMap::Orthographic(parallel(5.0))),
        (&sun, ShadowMap::Cascades(&cascades)),
        (&spot, ShadowMap::Perspective(ShadowLayer::new(cone, &texels[..64 * 64]).unwrap())),
        (&wide, cube()),
        (&point, cube()),
        (&sun, ShadowMap::Unshadowed),
    ];
    let colours = vec![[0.5, 1.0, 2.0]; 16 * 16];
    let glass = MapProjection::orthographic([0.0, 8.0, 0.0], down, up, [2.0; 2], [16, 16]).unwrap();
    let texture = LightTexture::new(glass, &colours).unwrap();
    // A twentieth of a pixel: a pixel of an image twenty times as wide.
    let moved = camera.shifted(0.05, 0.025);
    let mut tried = Vec::new();
    for (light, shadow) in &shadows {
        for textured in [false, true] {
            let [first, second] = [&camera, &moved].map(|camera| {
                let frame = Frame::new(camera, depth, light, shadow, &medium, 20.0).unwrap();
                if textured { frame.with_texture(&texture).unwrap() } else { frame }
            });
            for (name, mut instance) in instances(&SceneFacts::of(&first), size == SIZES[1]) {
                if instance.supports(&first).is_err() {
                    continue;
                }
                let [one, two] = allocated(instance.as_mut(), [&first, &second]);
                let shadow = shadow.layers().count();
                assert_eq!(
                    two, 0,
                    "{name}, {size:?}, {:?}, {shadow} layers, glass {textured}: {one} before",
                    light
                );
                // A walk through a map has nothing to keep; an instance that has was new.
                assert!(one > 0 || !name.starts_with("epipolar"), "{name}: nothing is counted");
                tried.push(name);
            }
        }
    }
    tried
}
