//! Height fog under suns: slices against the direct sum of closed forms and the exact walk, from vacuum to soot and from the
//! ground to a hundred scale heights above it.

use epipolar::driver::{SliceDriver, SliceIntegrator};
use epipolar::{Baran, DirectIntegrator, Epipolar, Options};
use proptest::prelude::*;
use scatter_core::{HeightFalloff, Medium, Phase, RayLight, RenderStats, ScatterImage, VolumetricShadow};
use scatter_testing::{Facing, MapKind, OwnedFrame, Random, SliceCase, slice_cases};

use crate::judged::uniform;

/// A fog for a random frame: optical depths from 1e-9 to 1e4 and scale heights from hairs to planets, as far from the eye as
/// `heights` scale heights; every fourth is horizontal to the camera's axis, and a third coloured.
fn fog(frame: &OwnedFrame, seed: u64, heights: f64) -> Medium {
    let mut random = Random(seed ^ 0xF06);
    let scale = 10f64.powf(random.range(-1.5, 3.0));
    let up = if random.below(4) == 0 {
        frame.camera.forward().any_orthonormal_vector()
    } else {
        random.direction()
    };
    // What the ray's denser end has: the eye's height decides where that is.
    let base = up.dot(frame.camera.eye()) + scale * random.range(-heights, heights);
    let sigma = 10f64.powf(random.range(-9.0, 1.5));
    let colour = if random.below(3) == 0 { [1.0, random.range(0.0, 1.0), 1e-3] } else { [1.0; 3] };
    let falloff = HeightFalloff::new(up.into(), base, scale).unwrap();
    let albedo = random.range(0.1, 1.0);
    let [scattering, absorption] = [albedo, 1.0 - albedo].map(|part| colour.map(|c| c * sigma * part));
    let phase = Phase::HenyeyGreenstein { g: random.range(-0.8, 0.8) };
    Medium::homogeneous(scattering, absorption, phase).unwrap().with_height_falloff(falloff)
}

/// A sun's frame in fog; a third of them without an end to their rays, a quarter behind glass.
fn foggy(case: SliceCase, heights: f64) -> OwnedFrame {
    let mut frame = case.frame();
    let mut random = Random(case.seed ^ 0xE4D);
    frame.medium = fog(&frame, case.seed, heights);
    if random.below(3) == 0 {
        frame.max_distance = f64::INFINITY;
    }
    frame
}

fn suns() -> impl Strategy<Value = SliceCase> {
    (slice_cases(), any::<bool>()).prop_map(|(case, cascades)| SliceCase {
        kind: if cascades { MapKind::Cascades } else { MapKind::Orthographic },
        ..case
    })
}

fn image<I: SliceIntegrator>(frame: &OwnedFrame, integrator: I) -> (ScatterImage, RenderStats) {
    frame.with(|frame| {
        let mut out = ScatterImage::new();
        let stats = SliceDriver::new(integrator).render(frame, &uniform(1.0).slices(), &mut out);
        (out, stats)
    })
}

/// Unoccluded radiance of a pixel, f64.
fn whole(frame: &OwnedFrame, index: usize) -> [f64; 3] {
    frame.with(|frame| {
        let width = frame.size()[0];
        let (x, y) = (index as u32 % width, index as u32 / width);
        let ray = frame.camera().pixel_ray(x, y);
        let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
        light.interval(0.0, frame.ray_end(x, y)).to_array()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn slices_find_what_the_direct_sum_finds(case in suns(), glass in any::<u8>()) {
        const MOST: f64 = 3e-5;
        let mut frame = foggy(case, if case.seed.is_multiple_of(2) { 5.0 } else { 90.0 });
        if glass < 64 {
            let projection = *frame.projections.last().unwrap();
            let mut random = Random(case.seed ^ 0x61A55);
            let texels = projection.size()[0] * projection.size()[1];
            frame.texture = Some((projection, (0..texels).map(|_| random.rgb(0.0, 1.5).map(|c| c as f32)).collect()));
        }
        let (found, stats) = image(&frame, Baran::new(uniform(1.0).sums()));
        // One pixel may be the epipole's; others are walked where fog is thousands of scale heights below the eye.
        prop_assume!(stats.counts.get("walked pixels").unwrap() <= 1);
        let (direct, _) = image(&frame, DirectIntegrator::default());
        for (index, (a, b)) in found.inscattered().iter().zip(direct.inscattered()).enumerate() {
            let whole = whole(&frame, index);
            for channel in 0..3 {
                let off = f64::from((a[channel] - b[channel]).abs());
                prop_assert!(
                    off <= MOST * whole[channel] + 1e-35,
                    "{case:?} {:?} pixel {index}: {a:?} {b:?} of {whole:?}, off {}", frame.medium, off / whole[channel]
                );
            }
        }
    }
}
