//! Rung 3 of the ladder: the marcher's image on the GPU against the CPU marcher's, over all kinds of maps, cameras and media.

use raymarch_ref::{Options, RayMarch};
use scatter_core::{Camera, HeightFalloff, ScatterImage, VolumetricShadow};
use scatter_gpu::Technique;
use scatter_gpu::harness::GpuTechnique;
use scatter_testing::{Filling, MapKind, OwnedFrame, coloured_medium, rel_rmse};

/// n·2⁻²⁴·cond: 96 additions of weights, and optical depths of a few units.
const TWIN: f64 = 1e-5;
/// Share of the pixels that may hold a sample on a neighbouring texel: positions of f32 over 64 texels are off by 4·2⁻¹⁸ of a
/// texel, a sample crosses at most one border in u, v and depth, and a pixel has 96. Noise in the map: every border counts.
const TIPPED: f64 = 0.02;
const STEPS: u32 = 96;
const RANDOM: Filling = Filling::Random { seed: 3, far: 12.0 };

fn images(frame: &OwnedFrame, jitter: Option<u32>) -> [ScatterImage; 2] {
    let options = Options { steps: STEPS, jitter, ..Options::default() };
    let mut cpu = RayMarch::new(options).unwrap();
    let mut gpu = GpuTechnique::new(Technique::RayMarch { steps: STEPS, jitter, uniform: false });
    frame.with(|frame| {
        let mut images = [ScatterImage::new(), ScatterImage::new()];
        cpu.render(frame, &mut images[0]).unwrap();
        gpu.render(frame, &mut images[1]).unwrap();
        images
    })
}

#[track_caller]
fn check(name: &str, frame: &OwnedFrame, jitter: Option<u32>) {
    let [cpu, gpu] = images(frame, jitter);
    let mean = cpu.inscattered().iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3.0 * 777.0);
    let pairs = || gpu.inscattered().iter().zip(cpu.inscattered());
    let off = |(a, b): (&[f32; 3], &[f32; 3])| {
        (0..3)
            .map(|c| (f64::from(a[c]) - f64::from(b[c])).abs() / f64::from(b[c]).max(mean))
            .fold(0.0, f64::max)
    };
    let tipped = pairs().filter(|&pair| off(pair) > TWIN).count() as f64 / 777.0;
    let rest = pairs().map(off).filter(|&off| off <= TWIN).fold(0.0, f64::max);
    let error = rel_rmse(&gpu, &cpu);
    println!(
        "{name}: rel_rmse {error:.1e}; {tipped:.4} of the pixels tipped ({TIPPED}), the others within {rest:.1e} ({TWIN:e})"
    );
    assert!(tipped <= TIPPED, "{name}: {tipped}, rel_rmse {error:e}");
    // Two samples of a pixel at the most.
    assert!(error <= 2.0 * TIPPED.sqrt() / f64::from(STEPS) * 4.0, "{name}: {error:e}");
    let worst = cpu.transmittance().iter().flatten().zip(gpu.transmittance().iter().flatten());
    let worst = worst.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // exp and its argument, a few ulp each.
    assert!(worst < 1e-5, "{name}: transmittance off by {worst:e}");
}

#[test]
fn every_kind_of_map_gives_the_cpu_marchers_image() {
    if crate::support::skipped() {
        return;
    }
    for (index, kind) in MapKind::ALL.into_iter().enumerate() {
        for coloured in [false, true] {
            let mut frame = OwnedFrame::stock(kind, [37, 21], 64, RANDOM);
            if coloured {
                frame.medium = coloured_medium();
            }
            let jitter = (index % 2 == 1).then_some(5);
            check(&format!("{kind:?}, coloured {coloured}"), &frame, jitter);
        }
    }
}

#[test]
fn glass_fog_and_orthographic_cameras_give_the_cpu_marchers_image() {
    if crate::support::skipped() {
        return;
    }
    for kind in [MapKind::Orthographic, MapKind::Spot] {
        check("glass", &OwnedFrame::stock(kind, [37, 21], 64, RANDOM).with_glass(), None);
    }
    let mut frame = OwnedFrame::stock(MapKind::Orthographic, [37, 21], 64, RANDOM);
    frame.medium = frame.medium.with_height_falloff(HeightFalloff::new([0.0, 1.0, 0.0], 0.5, 2.0).unwrap());
    check("fog", &frame, None);
    for kind in [MapKind::Cascades, MapKind::Point] {
        let mut frame = OwnedFrame::stock(kind, [37, 21], 64, RANDOM);
        frame.camera =
            Camera::orthographic([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 6.0, [37, 21]).unwrap();
        check("orthographic", &frame, None);
    }
}

/// Exact min/max has no step: against the exact walk through the same map, in f64.
#[test]
fn exact_min_max_gives_the_exact_walks_image() {
    if crate::support::skipped() {
        return;
    }
    for kind in MapKind::ALL {
        for coloured in [false, true] {
            let mut frame = OwnedFrame::stock(kind, [37, 21], 64, RANDOM);
            if coloured {
                frame.medium = coloured_medium();
            }
            let truth = frame.render(&mut raymarch_ref::ShadowMapWalk::default());
            let found = frame.render(&mut GpuTechnique::new(Technique::MinmaxMipmap));
            let error = rel_rmse(&found, &truth);
            println!("{kind:?}, coloured {coloured}: rel_rmse {error:.1e} of 1e-4 against the exact walk");
            assert!(error <= 1e-4, "{kind:?}: {error:e}");
        }
    }
}

/// A mutant: the sign of g.
#[test]
fn a_phase_function_of_the_wrong_sign_is_seen() {
    if crate::support::skipped() {
        return;
    }
    let mut frame = OwnedFrame::stock(MapKind::Orthographic, [37, 21], 64, RANDOM);
    let medium = |g| {
        let phase = scatter_core::Phase::henyey_greenstein(g).unwrap();
        scatter_core::Medium::homogeneous([0.08; 3], [0.01; 3], phase).unwrap()
    };
    frame.medium = medium(0.6);
    let [cpu, _] = images(&frame, None);
    frame.medium = medium(-0.6);
    let [_, mutant] = images(&frame, None);
    assert!(rel_rmse(&mutant, &cpu) > 0.1);
}
