//! What the four ways to accumulate lose, in thin, thick and far media: intervals lose nothing, and the table says what the others do.

use light_volume::{Accumulate, LightVolume, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Medium, Phase};
use scatter_testing::{Filling, MapKind, OwnedFrame, rel_rmse, values};

/// Pixels that get more than a millionth of their unoccluded light, against the exact walk.
fn largest_loss(frame: &OwnedFrame, accumulate: Accumulate) -> (f64, f64) {
    let truth = frame.render(&mut ShadowMapWalk::new());
    let image = frame.render(&mut LightVolume::new(Options { accumulate, ..Options::exact() }));
    let whole = values(&frame.unoccluded().render(&mut ShadowMapWalk::new()));
    let mut worst = 0.0f64;
    for ((found, exact), whole) in values(&image).iter().zip(values(&truth)).zip(&whole) {
        if whole[0] > 0.0 {
            worst = worst.max((found[0] - exact[0]).abs() / whole[0]);
        }
    }
    (worst, rel_rmse(&image, &truth))
}

#[test]
fn every_way_keeps_its_share_of_the_unoccluded_light() {
    let ways = [Accumulate::Intervals, Accumulate::Shares, Accumulate::Signed, Accumulate::SignedSingle];
    for kind in [MapKind::Orthographic, MapKind::Point] {
        for sigma in [1e-3, 0.1, 10.0, 100.0] {
            let mut frame = OwnedFrame::stock(kind, [33, 17], 40, Filling::Random { seed: 7, far: 9.0 });
            frame.medium = Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).unwrap();
            for accumulate in ways {
                let (worst, rmse) = largest_loss(&frame, accumulate);
                println!(
                    "{kind:?} σ {sigma}: {accumulate:?} {worst:.1e} of the unoccluded light, rel_rmse {rmse:.1e}"
                );
                // Each of up to a hundred terms is rounded to 2⁻²⁴ of the whole light, and is a closed form in f32 (of a lamp to
                // 2.3e-5); so are intervals, which are no greater than the whole.
                assert!(worst <= 1e-4, "{kind:?} σ {sigma}: {accumulate:?} {worst:.1e}");
            }
        }
    }
}
