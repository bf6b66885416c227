//! All buffers live in the technique: the second frame, of a moved camera, allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use epipolar::{Cells, Epipolar, Options};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, Phase, ScatterImage,
    Scattering, ShadowLayer, ShadowMap, VolumetricShadow,
};

/// The system's allocator, counted.
struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call is handed to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SIZE: [u32; 2] = [67, 45];

#[test]
fn the_second_frame_allocates_nothing_though_the_camera_moves() {
    let camera = Camera::perspective([0.0, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, SIZE).unwrap();
    let distances: Vec<f32> = (0..67 * 45).map(|i| 4.0 + (i % 9) as f32).collect();
    let depth = DepthMap::new(&distances, SIZE).unwrap();
    let texels: Vec<f32> =
        (0..6 * 64 * 64).map(|i| if i % 7 < 3 { f32::INFINITY } else { 2.0 + (i % 5) as f32 }).collect();
    let component = |phase| Scattering { sigma_s: [0.1, 0.2, 0.3], phase };
    let medium = Medium::new(
        vec![component(Phase::Rayleigh), component(Phase::HenyeyGreenstein { g: 0.5 })],
        [0.0; 3],
    )
    .unwrap();
    let (down, up) = ([0.1, -1.0, 0.2], [0.0, 0.0, 1.0]);
    let parallel = MapProjection::orthographic([0.0, 8.0, 0.0], down, up, [5.0; 2], [64, 48]).unwrap();
    let cone = MapProjection::perspective([0.0, 8.0, 0.0], down, up, 0.5, 64).unwrap();
    let sun = Light::directional(down, [1.0; 3]).unwrap();
    let spot = Light::spot([0.0, 8.0, 0.0], down, [5.0; 3], 10.0, 26.0, 0.0).unwrap();
    let point = Light::point([0.0, 3.0, 0.0], [5.0; 3], 0.0).unwrap();
    let shadows = [
        (&sun, ShadowMap::Orthographic(ShadowLayer::new(parallel, &texels[..64 * 48]).unwrap())),
        (&spot, ShadowMap::Perspective(ShadowLayer::new(cone, &texels[..64 * 64]).unwrap())),
        (&point, ShadowMap::Cube(CubeShadow::new([0.0, 3.0, 0.0], 64, &texels).unwrap())),
        (&sun, ShadowMap::Unshadowed),
    ];
    let colours = vec![[0.5, 1.0, 2.0]; 16 * 16];
    let glass = MapProjection::orthographic([0.0, 8.0, 0.0], down, up, [2.0; 2], [16, 16]).unwrap();
    let texture = LightTexture::new(glass, &colours).unwrap();
    let defaults = Options::default();
    // In one thread: what rayon's queues do when several threads share a frame is not ours to count.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for options in [defaults, Options { cells: Cells::Box, rank: Some(8), ..defaults }] {
            for (light, shadow) in &shadows {
                for textured in [false, true] {
                    let mut technique = Epipolar::new(options);
                    let mut image = ScatterImage::new();
                    let mut allocated = [0; 2];
                    // A twentieth of a pixel: a pixel of an image twenty times as wide.
                    for (count, by) in allocated.iter_mut().zip([0.0, 0.05]) {
                        let moved = camera.shifted(by, 0.5 * by);
                        let frame = Frame::new(&moved, depth, light, shadow, &medium, 20.0).unwrap();
                        let frame = if textured { frame.with_texture(&texture) } else { frame };
                        let before = ALLOCATIONS.load(Ordering::Relaxed);
                        technique.render(&frame, &mut image).unwrap();
                        *count = ALLOCATIONS.load(Ordering::Relaxed) - before;
                    }
                    assert!(allocated[0] > 0, "nothing is counted");
                    assert_eq!(allocated[1], 0, "{:?}, glass {textured}", light.position());
                }
            }
        }
    });
}
