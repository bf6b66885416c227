//! Rungs 3 to 5 of the ladder for epipolar slices: images against the exact walk.

use raymarch_ref::ShadowMapWalk;
use scatter_core::Camera;
use scatter_gpu::harness::GpuTechnique;
use scatter_gpu::{EpipolarSettings, Technique};
use scatter_testing::{Filling, MapKind, OwnedFrame, boards, coloured_medium, rel_rmse};

fn settings(spacing: f64) -> EpipolarSettings {
    EpipolarSettings { spacing, fewest_slices: 1.0, factor_error: 1e-3, ..EpipolarSettings::default() }
}

#[track_caller]
fn error(name: &str, frame: &OwnedFrame, spacing: f64) -> f64 {
    let image = frame.render(&mut GpuTechnique::new(Technique::Epipolar(settings(spacing))));
    let truth = frame.render(&mut ShadowMapWalk::new());
    let error = rel_rmse(&image, &truth);
    println!("{name}, {spacing} px: rel_rmse {error:.1e} against truth");
    error
}

#[test]
fn slices_converge() {
    if crate::support::skipped() {
        return;
    }
    for spacing in [1.0, 0.25, 1.0 / 16.0] {
        error("boards", &boards([63, 65]), spacing);
        for kind in [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades] {
            for filling in [Filling::Random { seed: 3, far: 12.0 }, Filling::Constant(7.0)] {
                let mut frame = OwnedFrame::stock(kind, [37, 21], 64, filling);
                error(&format!("{kind:?} {filling:?}"), &frame, spacing);
                frame.medium = coloured_medium();
                error(&format!("{kind:?} {filling:?} coloured"), &frame, spacing);
            }
        }
    }
    let _ = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [1, 1]);
}
