//! The same frame is the same image: on any number of threads, with any instruction set, on a used instance.

use epipolar::{Epipolar, Options};
use scatter_core::{Level, ScatterImage, simd_level};
use scatter_testing::{MapKind, OwnedFrame, Recipe};

use crate::judged::scene;

const KINDS: [MapKind; 5] =
    [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Spot, MapKind::SpotCube, MapKind::Point];

fn some_scene(seed: u64, size: [u32; 2], textured: bool) -> OwnedFrame {
    let kind = KINDS[seed as usize % KINDS.len()];
    scene(seed, Recipe { size, textured, map_side: 40, ..Recipe::of(kind) })
}

fn image(scene: &OwnedFrame) -> ScatterImage {
    scene.render(&mut Epipolar::new(Options::default()))
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    for seed in 0..10 {
        let scene = some_scene(seed, [67, 45], seed >= 5);
        let images = [1, 2, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| image(&scene))
        });
        assert_eq!(images[0], images[1], "{:?}", scene.kind);
        assert_eq!(images[0], images[2], "{:?}", scene.kind);
    }
}

#[test]
fn a_used_instance_renders_like_a_new_one() {
    let mut used = Epipolar::new(Options::default());
    let sizes = [[31, 17], [67, 45], [1, 1], [9, 40], [67, 1]];
    for round in 0..40u64 {
        // Size, light, map, glass and medium change from frame to frame, up and down.
        let scene = some_scene(round * 7 % 40, sizes[round as usize % 5], round % 3 == 0);
        assert_eq!(scene.render(&mut used), image(&scene), "round {round}, {:?}", scene.kind);
    }
}

/// The bits of a few images, as one number.
fn fingerprint() -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325u64;
    for seed in 0..5 {
        for value in image(&some_scene(seed, [43, 29], false)).inscattered().iter().flatten() {
            hash = (hash ^ u64::from(value.to_bits())).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }
    hash
}

#[test]
fn the_portable_path_gives_the_same_bits() {
    // No operation is fused and no sum reordered, so that wider registers change nothing.
    let found = format!("fingerprint {:016x}", fingerprint());
    println!("{found} {:?}", simd_level());
    if std::env::var_os("SCATTER_SIMD").is_some() {
        assert_eq!(format!("{:?}", simd_level()), format!("{:?}", Level::baseline()));
        return;
    }
    let output = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "instances::the_portable_path_gives_the_same_bits", "--nocapture"])
        .env("SCATTER_SIMD", "baseline")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains(&found), "{found} became {text}");
}
