//! Frames of a timed loop are those that their cameras see.

use scatter_scene::{BuiltinShot, export, load_shot};
use scatter_validate::StagedShot;
use scatter_validate::staged_shot::resized;

/// Not square, and narrower than two moves.
const SIZE: [u32; 2] = [31, 23];

#[test]
fn depth_moves_with_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let paths = export(folder.path(), &[BuiltinShot::find("nave").unwrap()]).unwrap();
    let mut shot = load_shot(&paths[0]).unwrap();
    shot.camera = resized(&shot.camera, SIZE).unwrap();
    let staged = StagedShot::new(shot, 32).unwrap();
    for (frame, columns) in [(0, 0.0), (1, 1.0), (5, 5.0), (16, 16.0), (17, 1.0)] {
        let camera = staged.camera().shifted(columns, 0.0);
        let mut seen = Vec::new();
        staged.caster().depth_map(&camera, &mut seen);
        let ends = staged
            .with_timed_frame(0, frame, |frame| {
                assert!(
                    (frame.camera().pixel_ray(3, 4).direction - camera.pixel_ray(3, 4).direction).length()
                        < 1e-12
                );
                frame.depth().texels().to_vec()
            })
            .unwrap();
        // The same rays to rounding: at a leaf's very edge one may pass it by.
        let differ =
            seen.iter().zip(&ends).filter(|(a, b)| a != b && (*a - *b).abs() > 1e-5 * a.abs()).count();
        println!("frame {frame}: {differ} of {} rays end elsewhere", ends.len());
        assert!(differ <= 2, "frame {frame}: {differ}");
    }
}
