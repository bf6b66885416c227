//! Pixels that share answers: where they end on one surface, and nowhere else; images of odd sizes, all kinds of light.

use epipolar::Options;
use scatter_core::ScatterImage;
use scatter_testing::{Filling, MapKind, OwnedFrame, Recipe};

use crate::judged::{render, scene, truth, uniform};

/// Odd, wider than high and higher than wide, and single rows and columns.
const SIZES: [[u32; 2]; 4] = [[83, 57], [41, 77], [1, 61], [59, 1]];

fn sharing(spacing: f64, columns: u32) -> Options {
    let mut options = Options { shared_columns: Some(columns), ..uniform(spacing) };
    // No gap is halved, so this is how far a ray may end away from a plane: a twentieth of its length at the most.
    options.refinement.tolerance = 1.0;
    options
}

fn asking(options: Options) -> Options {
    Options { shared_columns: Some(0), ..options }
}

fn queries(scene: &OwnedFrame, options: Options) -> (ScatterImage, u64) {
    let (image, stats) = render(scene, options);
    (image, stats.counts.get("queries").unwrap())
}

/// A plane that leans to both sides, seen in perspective: its ends are straight but for a hundredth.
fn plane(scene: &mut OwnedFrame) {
    let [width, height] = scene.camera.size();
    let lean = |at: u32, of: u32| f64::from(at) / f64::from(of.max(2));
    scene.depth = (0..width * height)
        .map(|n| (3.0 / (1.0 - 0.1 * lean(n % width, width) - 0.08 * lean(n / width, height))) as f32)
        .collect();
}

#[test]
fn what_nothing_shadows_is_the_closed_form_whoever_answers() {
    for (seed, kind) in [MapKind::Orthographic, MapKind::Point, MapKind::Spot].into_iter().enumerate() {
        for size in SIZES {
            let mut scene = scene(seed as u64, Recipe { size, ..Recipe::of(kind) });
            scene.fill(Filling::Constant(f32::INFINITY));
            let (image, _) = render(&scene, sharing(4.0, 4));
            let (other, _) = render(&scene, asking(sharing(4.0, 4)));
            assert_eq!(image.inscattered(), other.inscattered(), "{kind:?} {size:?}");
        }
    }
}

#[test]
fn on_a_plane_pixels_share_and_are_off_by_little() {
    for (seed, kind) in [MapKind::Orthographic, MapKind::Point].into_iter().enumerate() {
        for columns in [1, 2, 5] {
            let size = SIZES[seed];
            let mut scene = scene(7 + seed as u64, Recipe { size, ..Recipe::of(kind) });
            plane(&mut scene);
            let (shared, few) = queries(&scene, sharing(4.0, columns));
            let (asked, many) = queries(&scene, asking(sharing(4.0, columns)));
            // At four pixels eight pixels of a column ask beside each slice, where one does now.
            assert!(few * 2 < many, "{kind:?} {columns}: {few} of {many} queries");
            let open = truth(&scene.unoccluded());
            let scale = open.inscattered().iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
            let off = shared.inscattered().iter().zip(asked.inscattered());
            let off: Vec<f32> = off.map(|(a, b)| (a[0] - b[0]).abs() / scale).collect();
            let rms = (off.iter().map(|e| e * e).sum::<f32>() / off.len() as f32).sqrt();
            println!("{kind:?}, {columns} columns: {few} of {many} queries, RMS {rms:.5}");
            // Ends are straight to a hundredth, which is at most a hundredth of the light; and an edge of a shadow that crosses
            // the columns of a random map is blurred over `columns` of them, of which there are dozens.
            assert!(rms < 0.01 + 0.005 * columns as f32, "{kind:?} {columns}: {rms}");
        }
    }
}

#[test]
fn where_depths_break_every_pixel_asks_itself() {
    for (seed, kind) in [MapKind::Orthographic, MapKind::Spot].into_iter().enumerate() {
        for size in SIZES {
            let mut scene = scene(11 + seed as u64, Recipe { size, ..Recipe::of(kind) });
            // No two pixels of a column within a dozen rows end within a third of each other, nor do two that are four columns apart
            // on a slice: nowhere do four view rays see one surface.
            scene.depth = (0..size[0] * size[1])
                .map(|n| 0.15 * 1.3f32.powi(((3 * (n % size[0]) + 5 * (n / size[0])) % 13) as i32))
                .collect();
            let (shared, more) = queries(&scene, sharing(4.0, 4));
            let (asked, many) = queries(&scene, asking(sharing(4.0, 4)));
            // In a single row both slices see the pixel itself.
            assert!(more >= many || size.contains(&1), "{kind:?} {size:?}: {more} of {many}");
            let brightest = asked.inscattered().iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
            let off = shared.inscattered().iter().zip(asked.inscattered());
            let largest = off.map(|(a, b)| (a[0] - b[0]).abs() / brightest).fold(0.0, f32::max);
            println!(
                "{kind:?} {size:?}: {more} queries, {many} without sharing, largest difference {largest:.1e}"
            );
            // The same sums in the order of other queries: a few roundings of f32.
            assert!(largest < 1e-6, "{kind:?} {size:?}: {largest}");
        }
    }
}
