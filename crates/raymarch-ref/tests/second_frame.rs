//! All buffers live in the technique: the second frame of the same size allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use raymarch_ref::{Options, RayMarch, ShadowMapWalk};
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

#[test]
fn the_second_frame_allocates_nothing() {
    let size = [67, 45];
    let camera = Camera::perspective([0.0, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, size).unwrap();
    let distances: Vec<f32> = (0..67 * 45).map(|i| 4.0 + (i % 9) as f32).collect();
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
    let sun = Light::directional(down, [1.0; 3]).unwrap();
    let point = Light::point([0.0, 3.0, 0.0], [5.0; 3], 0.0).unwrap();
    let shadows = [
        (&sun, ShadowMap::Orthographic(parallel(5.0))),
        (&sun, ShadowMap::Cascades(vec![parallel(2.0), parallel(5.0)])),
        (&point, ShadowMap::Cube(CubeShadow::new([0.0, 3.0, 0.0], 64, &texels).unwrap())),
    ];
    let colours = vec![[0.5, 1.0, 2.0]; 16 * 16];
    let glass = MapProjection::orthographic([0.0, 8.0, 0.0], down, up, [2.0; 2], [16, 16]).unwrap();
    let texture = LightTexture::new(glass, &colours).unwrap();

    let techniques: [Box<dyn VolumetricShadow>; 2] = [
        Box::new(ShadowMapWalk::new()),
        Box::new(RayMarch::new(Options { steps: 33, jitter: Some(1), ..Options::default() }).unwrap()),
    ];
    // In one thread: what rayon's queues do when several threads share a frame is not ours to count.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for mut technique in techniques {
            for (light, shadow) in &shadows {
                let frame =
                    Frame::new(&camera, depth, light, shadow, &medium, 20.0).unwrap().with_texture(&texture);
                let mut image = ScatterImage::new();
                technique.render(&frame, &mut image).unwrap();
                let before = ALLOCATIONS.load(Ordering::Relaxed);
                technique.render(&frame, &mut image).unwrap();
                let allocated = ALLOCATIONS.load(Ordering::Relaxed) - before;
                assert_eq!(allocated, 0, "{}", technique.id());
            }
        }
    });
}
