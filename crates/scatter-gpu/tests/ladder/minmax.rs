//! Rungs 2 to 5 of the ladder for exact min/max: extrema bit-equal, images against the CPU's exact mode and against the
//! exact walk, textures of random bits.

use minmax_mipmap::{MinMaxMipmap, Mode, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, HeightFalloff, Medium, Phase, ScatterImage};
use scatter_gpu::Technique;
use scatter_gpu::harness::GpuTechnique;
use scatter_testing::{Filling, MapKind, OwnedFrame, boards, coloured_medium, rel_rmse};

/// What the issue asks for. Crossings are off by a few roundings of f32: 2⁻²⁴ of a ray over the share of a texel that a
/// lit run has of it, which for maps of noise is the largest.
const TWIN: f64 = 1e-4;

fn gpu(frame: &OwnedFrame) -> ScatterImage {
    frame.render(&mut GpuTechnique::new(Technique::MinmaxMipmap))
}

#[track_caller]
fn check(name: &str, frame: &OwnedFrame) {
    let image = gpu(frame);
    let mut exact = MinMaxMipmap::new(Options { mode: Mode::Exact, ..Options::default() });
    let cpu = frame.render(&mut exact);
    let truth = frame.render(&mut ShadowMapWalk::new());
    let (twin, error) = (rel_rmse(&image, &cpu), rel_rmse(&image, &truth));
    println!(
        "{name}: rel_rmse {twin:.1e} against the CPU's exact mode, {error:.1e} against truth; {:.1e} between those two ({TWIN:e})",
        rel_rmse(&cpu, &truth)
    );
    assert!(twin <= TWIN && error <= TWIN, "{name}: {twin:e}, {error:e}");
    let through = cpu.transmittance().iter().flatten().zip(image.transmittance().iter().flatten());
    let worst = through.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{name}: transmittance off by {worst:e}");
}

fn fillings() -> [Filling; 2] {
    [Filling::Random { seed: 3, far: 12.0 }, Filling::Constant(7.0)]
}

#[test]
fn every_kind_of_map_gives_the_exact_image() {
    if crate::support::skipped() {
        return;
    }
    for kind in MapKind::ALL {
        for filling in fillings() {
            for (coloured, side, size) in [(false, 64, [37, 21]), (true, 61, [64, 9])] {
                let mut frame = OwnedFrame::stock(kind, size, side, filling);
                if coloured {
                    frame.medium = coloured_medium();
                }
                check(&format!("{kind:?}, {filling:?}, coloured {coloured}"), &frame);
            }
        }
    }
    check("boards", &boards([63, 65]));
}

#[test]
fn glass_gives_the_exact_image() {
    if crate::support::skipped() {
        return;
    }
    for kind in MapKind::ALL {
        let random = Filling::Random { seed: 7, far: 12.0 };
        let mut frame = OwnedFrame::stock(kind, [37, 21], 64, random).with_glass();
        // Panes of three colours, so that rays cross from one into the next.
        if let Some((_, texels)) = &mut frame.texture {
            texels.iter_mut().enumerate().for_each(|(n, texel)| texel[(n / 5) % 3] *= 0.3);
        }
        check(&format!("glass, {kind:?}"), &frame);
    }
}

#[test]
fn fog_and_orthographic_cameras_give_the_exact_image() {
    if crate::support::skipped() {
        return;
    }
    let random = Filling::Random { seed: 5, far: 12.0 };
    for scale in [0.5, 40.0] {
        let mut frame = OwnedFrame::stock(MapKind::Cascades, [37, 21], 64, random);
        let falloff = HeightFalloff::new([0.0, 1.0, 0.0], 0.5, scale).unwrap();
        frame.medium = frame.medium.with_height_falloff(falloff);
        check("fog", &frame);
    }
    for kind in MapKind::ALL {
        let mut frame = OwnedFrame::stock(kind, [37, 21], 64, random);
        frame.camera =
            Camera::orthographic([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 6.0, [37, 21]).unwrap();
        frame.medium =
            Medium::homogeneous([0.08; 3], [0.01; 3], Phase::henyey_greenstein(0.7).unwrap()).unwrap();
        check(&format!("orthographic camera, {kind:?}"), &frame);
    }
}

/// Looking straight at a point light, and straight away from it, 1e-6 and 1e-5 units beside it: rays in the planes between two
/// faces of its cube, and rays that stay on a border of texels. Judged pixel by pixel, for what passes the lamp outshines all
/// others by 1e5. Before a plane's rounding belonged to a face, rays in it lost up to half of their light.
#[test]
fn rays_between_two_faces_are_lit_pixel_by_pixel() {
    if crate::support::skipped() {
        return;
    }
    let mut worst = 0.0_f64;
    for beside in [0.0, 1e-6, 1e-5] {
        for (eye, at) in [(6.0, -1.0), (-3.0, -9.0)] {
            let mut frame = OwnedFrame::stock(MapKind::Point, [13, 9], 64, Filling::Constant(7.0));
            frame.camera =
                Camera::perspective([beside, 3.0, eye], [beside, 3.0, at], [0.0, 1.0, 0.0], 70.0, [13, 9])
                    .unwrap();
            frame.depth = (0..13 * 9).map(|n| 7.5 + (n % 9) as f32 * 0.1).collect();
            let (image, truth) = (gpu(&frame), frame.render(&mut ShadowMapWalk::new()));
            for (n, (is, should)) in image.inscattered().iter().zip(truth.inscattered()).enumerate() {
                let off = f64::from((is[0] - should[0]).abs() / should[0]);
                worst = worst.max(off);
                assert!(
                    off <= TWIN,
                    "{beside:e} beside, from {eye}, pixel {n}: {is:?}, should be {should:?}"
                );
            }
        }
    }
    println!("no pixel is off by more than {worst:.1e} of itself ({TWIN:e})");
}
