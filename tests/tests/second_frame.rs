//! All buffers live in the technique: the second frame of a size allocates nothing, though the camera moves.
//!
//! The rule of the house asks this of every technique by its defaults, on its small scenes. Here are those that have
//! more to hold: larger pictures, and options that are rarely set.

use raymarch_ref::ShadowMapWalk;
use scatter::{TECHNIQUES, Target};
use scatter_core::{Frame, Quality, ScatterImage, SceneFacts, VolumetricShadow};
use scatter_testing::{Filling, MapKind, OwnedFrame, coloured_medium};
use scatter_validate::checks::counting_allocator::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Presets measure their spacing from a diagonal of 480 pixels on: one below that, and one beyond it that is not high.
const SIZES: [[u32; 2]; 2] = [[67, 45], [481, 35]];

/// Every technique's options that need buffers of their own, by its id.
const OPTIONS: [(&str, &[(&str, &str)]); 26] = [
    ("raymarch", &[("steps", "33"), ("jitter", "1")]),
    ("epipolar", &[("cells", "box"), ("rank", "8")]),
    ("epipolar", &[("integrator", "tree"), ("around", "ring")]),
    ("epipolar", &[("integrator", "cursor"), ("cells", "modes")]),
    ("epipolar", &[("integrator", "sweep"), ("resampling", "rectified")]),
    ("filtered-prefix", &[("basis", "fourier"), ("storage", "f16")]),
    ("filtered-prefix", &[("filter", "always")]),
    ("filtered-prefix", &[("certified", "off"), ("coefficients", "4")]),
    (
        "filtered-prefix",
        &[("rectification", "projective"), ("map_columns", "64"), ("map_rows", "48"), ("splits", "3")],
    ),
    (
        "filtered-prefix",
        &[("fetch", "bilinear"), ("basis", "fourier"), ("map_columns", "64"), ("map_rows", "48")],
    ),
    (
        "filtered-prefix",
        &[("fetch", "nearest"), ("storage", "f16"), ("map_columns", "64"), ("map_rows", "48")],
    ),
    ("froxel", &[("grid", "11x7x33"), ("frames", "3")]),
    ("froxel", &[("grid", "160x90x64"), ("lookup", "radiance")]),
    ("froxel", &[("grid", "4096x4096x8"), ("near", "0.5"), ("far", "3")]),
    ("light-volume", &[("accumulate", "shares"), ("tessellation", "static")]),
    ("light-volume", &[("accumulate", "signed"), ("threshold", "0.01")]),
    ("light-volume", &[("accumulate", "signed-f32")]),
    ("light-volume", &[("surface", "interpolated"), ("threshold", "0.003")]),
    ("light-volume", &[("surface", "interpolated"), ("tessellation", "static")]),
    ("minmax-mipmap", &[("mode", "sampling"), ("edges", "row")]),
    ("minmax-mipmap", &[("mode", "sampling"), ("downscale", "2"), ("tree", "chen")]),
    ("minmax-mipmap", &[("mode", "sampling"), ("refinement", "0.001"), ("slices", "100")]),
    ("minmax-mipmap", &[("mode", "slices"), ("slices", "200")]),
    ("avsm", &[("opaque", "curve"), ("curves", "64")]),
    ("avsm", &[("opaque", "curve"), ("curve", "deep"), ("curves", "33")]),
    ("avsm", &[("opaque", "curve"), ("curve", "moments"), ("curves", "9")]),
];

/// What renders a picture: the exact walk and every technique in each of its ways, with names; a wide picture
/// only by what techniques choose themselves for the coarsest level, of which a froxel preset has the fewest slices.
fn instances(facts: &SceneFacts, is_wide: bool) -> Vec<(String, Box<dyn VolumetricShadow>)> {
    let preset = Target::Quality(Quality::Game);
    let mut instances: Vec<(String, Box<dyn VolumetricShadow>)> = Vec::new();
    if !is_wide {
        instances.push(("truth-shadow-map".into(), Box::new(ShadowMapWalk::new())));
    }
    for technique in TECHNIQUES {
        let id = technique.info().id;
        let mut ways = vec![(Target::Quality(Quality::Preview), &[][..])];
        if !is_wide {
            ways.extend([(preset, &[][..]), (Target::Error(0.02), &[])]);
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
    let mut tried = Vec::new();
    for (kind, textured) in MapKind::ALL.into_iter().flat_map(|kind| [(kind, false), (kind, true)]) {
        let stock = OwnedFrame::stock(kind, size, 64, Filling::Random { seed: 1, far: 9.0 });
        let mut first = if textured { stock.with_glass() } else { stock };
        first.medium = coloured_medium();
        // A twentieth of a pixel: a pixel of an image twenty times as wide.
        let second = OwnedFrame { camera: first.camera.shifted(0.05, 0.025), ..first.clone() };
        first.with(|first| {
            second.with(|second| {
                for (name, mut instance) in instances(&SceneFacts::of(first), size == SIZES[1]) {
                    if instance.supports(first).is_err() {
                        continue;
                    }
                    let [one, two] = allocated(instance.as_mut(), [first, second]);
                    assert_eq!(two, 0, "{name}, {size:?}, {kind:?}, glass {textured}: {one} before");
                    // A walk through a map has nothing to keep; an instance that has was new.
                    assert!(one > 0 || !name.starts_with("epipolar"), "{name}: nothing is counted");
                    tried.push(name);
                }
            });
        });
    }
    tried
}
