//! Rungs 3 to 5 of the ladder for epipolar slices: images against the CPU twin's and the exact walk's, the epipole on a pixel,
//! batches, any texture content, what is refused.

use epipolar::driver::Refinement;
use epipolar::{Epipolar, Options};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, DepthEncoding, HeightFalloff, Light, ScatterImage, Setup};
use scatter_gpu::harness::{GpuTechnique, HarnessDevice};
use scatter_gpu::{
    EpipolarSettings, GpuError, GpuFrame, Inputs, Output, ShadowDepth, Technique, View, ViewOptions, wgpu,
};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, boards, coloured_medium, rel_rmse};

const NOISE: Filling = Filling::Random { seed: 3, far: 12.0 };
const FACTOR_ERROR: f64 = 1e-3;

fn settings(spacing: f64) -> EpipolarSettings {
    EpipolarSettings {
        spacing,
        towards_light: 1.0,
        fewest_slices: 1.0,
        factor_error: FACTOR_ERROR,
        ..EpipolarSettings::default()
    }
}

fn gpu(frame: &OwnedFrame, settings: EpipolarSettings) -> ScatterImage {
    frame.render(&mut GpuTechnique::new(Technique::Epipolar(settings)))
}

/// The CPU's slices at the same places: none is halved, none is measured.
fn twin(frame: &OwnedFrame, spacing: f64) -> ScatterImage {
    let even = Options {
        spacing,
        fewest_slices: 1.0,
        target: None,
        refinement: Refinement { tolerance: 1.0, floor: 1.0, halvings: 0, walks_rest: false },
        uncut_columns: 0.0,
        factor_error: FACTOR_ERROR,
        shared_columns: Some(0),
        ..Options::default()
    };
    frame.render(&mut Epipolar::new(even))
}

/// A frame that looks along its sun, `ahead` 1 into the way that the light travels: the epipole, or the anti-epipole, is the centre
/// of the middle pixel.
fn along_the_sun(kind: MapKind, ahead: f64) -> OwnedFrame {
    let mut frame = OwnedFrame::stock(kind, [31, 33], 64, NOISE);
    let Light::Directional(sun) = &frame.light else { panic!("a sun") };
    let eye = frame.camera.eye();
    let target = eye + ahead * sun.direction();
    frame.camera =
        Camera::perspective(eye.to_array(), target.to_array(), [0.1, 1.0, 0.2], 50.0, [31, 33]).unwrap();
    frame
}

/// Both factorise to 1e-3 of a pixel, over bands that differ; the rest is rounding.
const TWIN: f64 = 2.0 * FACTOR_ERROR;

#[test]
fn images_are_the_cpu_twins_and_come_to_the_exact_walks_as_slices_come_closer() {
    if crate::support::skipped() {
        return;
    }
    let mut frames = vec![("boards", boards([63, 65]))];
    for kind in [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades] {
        frames.push(("noise", OwnedFrame::stock(kind, [37, 21], 64, NOISE)));
    }
    frames.push(("a plane", OwnedFrame::stock(MapKind::Cascades, [21, 37], 63, Filling::Constant(7.0))));
    frames.push(("a column", OwnedFrame::stock(MapKind::Orthographic, [1, 65], 63, NOISE)));
    frames.push(("into the sun", along_the_sun(MapKind::Orthographic, -1.0)));
    frames.push(("away from the sun", along_the_sun(MapKind::Cascades, 1.0)));
    let mut across = along_the_sun(MapKind::Orthographic, -1.0);
    let Light::Directional(sun) = &across.light else { panic!("a sun") };
    let (eye, up) =
        (across.camera.eye(), 0.8 * sun.direction().any_orthonormal_vector() - 0.6 * sun.direction());
    let target = eye + sun.direction().cross(up);
    across.camera =
        Camera::perspective(eye.to_array(), target.to_array(), up.to_array(), 50.0, [31, 33]).unwrap();
    frames.push(("the epipole at infinity", across));
    let mut coloured = OwnedFrame::stock(MapKind::Cascades, [37, 21], 64, NOISE);
    coloured.medium = coloured_medium();
    frames.push(("coloured", coloured));
    for (name, frame) in frames {
        let truth = frame.render(&mut ShadowMapWalk::new());
        let errors = [1.0, 1.0 / 16.0].map(|spacing| {
            let image = gpu(&frame, settings(spacing));
            let [apart, error] = [twin(&frame, spacing), truth.clone()].map(|other| rel_rmse(&image, &other));
            println!("{name}, {spacing} px: rel_rmse {apart:.1e} against the twin ({TWIN:e}), {error:.1e} against truth");
            assert!(apart <= TWIN, "{name}: {apart:e}");
            error
        });
        // Of maps of noise every texel is an edge: a sixteenth of the spacing takes at least three quarters of the error.
        assert!(errors[1] <= errors[0] / 4.0 + FACTOR_ERROR, "{name}: {errors:?}");
    }
}

/// In fog nothing is factorised. The density is that along the pixel's own ray, and on the CPU along the slice's, half a spacing
/// beside it at most: 1/8 of a pixel of 3.8 degrees, which over the 12 scale heights of the thinnest fog here changes ln of the density
/// by 0.1, of both sums of a share alike. A quarter of the spacing leaves a quarter of it, down to f32's rounding.
const FOG_TWIN: [f64; 2] = [1e-3, 2.5e-4];

#[test]
fn height_fog_is_the_cpu_twins() {
    if crate::support::skipped() {
        return;
    }
    for (scale, coloured) in [(0.5, false), (2.0, true), (40.0, false)] {
        for mut frame in [
            OwnedFrame::stock(MapKind::Cascades, [37, 21], 64, NOISE),
            along_the_sun(MapKind::Orthographic, -1.0),
        ] {
            if coloured {
                frame.medium = coloured_medium();
            }
            let falloff = HeightFalloff::new([0.0, 1.0, 0.0], 0.5, scale).unwrap();
            frame.medium = frame.medium.with_height_falloff(falloff);
            let truth = frame.render(&mut ShadowMapWalk::new());
            for (spacing, most) in [0.25, 1.0 / 16.0].into_iter().zip(FOG_TWIN) {
                let (image, cpu) = (gpu(&frame, settings(spacing)), twin(&frame, spacing));
                let apart = rel_rmse(&image, &cpu);
                let errors = [image, cpu].map(|image| rel_rmse(&image, &truth));
                println!(
                    "fog of {scale}, {spacing} px: rel_rmse {apart:.1e} against the twin ({most:e}), {:.1e} against truth, the twin {:.1e}",
                    errors[0], errors[1]
                );
                assert!(
                    apart <= most && errors[0] <= 1.1 * errors[1] + 1e-5,
                    "{scale}: {apart:e}, {errors:?}"
                );
            }
        }
    }
}

#[test]
fn pixels_on_the_epipole_walk_their_own_way() {
    if crate::support::skipped() {
        return;
    }
    for (kind, ahead) in [(MapKind::Orthographic, -1.0), (MapKind::Cascades, 1.0), (MapKind::Unshadowed, 1.0)]
    {
        for coloured in [false, true] {
            let mut frame = along_the_sun(kind, ahead);
            if coloured {
                frame.medium = coloured_medium();
            }
            let (image, truth) = (gpu(&frame, settings(0.5)), frame.render(&mut ShadowMapWalk::new()));
            for (found, exact) in image.at(15, 16).iter().zip(truth.at(15, 16)) {
                // Along the light a depth of f32 is met at one of the ray's distances: a few roundings.
                let off = f64::from((found - exact).abs()) / f64::from(exact.max(1e-6));
                println!("{kind:?} {ahead}: {found} of {exact}, off by {off:.1e}");
                assert!(off < 1e-4, "{kind:?} {ahead}: {found} of {exact}");
            }
        }
    }
}

#[test]
fn batches_change_no_bit() {
    if crate::support::skipped() {
        return;
    }
    for kind in [MapKind::Orthographic, MapKind::Cascades] {
        let frame = OwnedFrame::stock(kind, [37, 21], 64, NOISE);
        let whole = gpu(&frame, settings(0.5));
        let batched = gpu(&frame, EpipolarSettings { batch_bytes: 20_000, ..settings(0.5) });
        let bits = |image: &ScatterImage| {
            image.inscattered().iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert!(bits(&whole) == bits(&batched), "{kind:?}");
    }
}

/// Textures of a frame with an orthographic map or two cascades.
struct Textures {
    depth: wgpu::Texture,
    shadow: wgpu::Texture,
    meanings: Vec<ShadowDepth>,
}

impl Textures {
    fn new(
        device: &HarnessDevice,
        frame: &OwnedFrame,
        mut words: impl FnMut(usize) -> Option<Vec<u32>>,
    ) -> Self {
        frame.with(|frame| {
            let layers: Vec<_> = frame.shadow().layers().collect();
            let side = layers.iter().flat_map(|layer| layer.projection().size()).max().unwrap_or(1);
            let depth = device.r32float(frame.size(), 1);
            let shadow = device.r32float([side; 2], layers.len().max(1) as u32);
            let mut write = |texture, layer, size: [u32; 2], texels: &[f32]| match words(texels.len()) {
                Some(words) => device.write(texture, layer, size, bytemuck::cast_slice(&words)),
                None => device.write(texture, layer, size, bytemuck::cast_slice(texels)),
            };
            write(&depth, 0, frame.size(), frame.depth().texels());
            for (index, layer) in layers.iter().enumerate() {
                write(&shadow, index as u32, layer.projection().size(), layer.texels());
            }
            let meanings = (0..layers.len() as u32).map(ShadowDepth::linear).collect();
            Self { depth, shadow, meanings }
        })
    }

    fn draw(&self, device: &HarnessDevice, view: &mut View, setup: &Setup<'_>) -> Result<(), GpuError> {
        let [width, height] = setup.size();
        let viewport = [0, 0, width, height];
        let frame =
            GpuFrame { setup: *setup, depth: DepthEncoding::AlongRay, shadow: &self.meanings, exposure: 1.0 };
        let inputs = Inputs {
            depth: &self.depth,
            depth_layer: 0,
            viewport,
            shadow: (!self.meanings.is_empty()).then_some(&self.shadow),
            glass: None,
        };
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
        view.prepare(&device.queue, &frame, viewport)?;
        view.encode(&mut encoder, setup, &inputs, None)?;
        device.queue.submit([encoder.finish()]);
        assert_eq!(pollster::block_on(scope.pop()).map(|error| error.to_string()), None);
        Ok(())
    }
}

fn view(device: &HarnessDevice, scale: u32) -> View {
    let technique = Technique::Epipolar(settings(0.5));
    View::new(&device.gpu, ViewOptions { technique, output: Output::Rgba32Float, scale }).unwrap()
}

fn pixels(device: &HarnessDevice, image: Option<&wgpu::Texture>) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(&device.read_texture(image.expect("it was encoded"), 16))
}

#[test]
fn random_bits_as_depths_and_maps_give_finite_pixels_twice_the_same() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mut random = Random(23);
    for kind in [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades] {
        for (scale, mut frame) in
            [(1, OwnedFrame::stock(kind, [17, 13], 33, NOISE)), (2, along_the_sun(kind, 1.0))]
        {
            if scale == 2 {
                frame.medium = coloured_medium();
            }
            let textures = Textures::new(&device, &frame, |count| {
                Some((0..count).map(|_| random.bits() as u32).collect())
            });
            frame.with(|frame| {
                let mut view = view(&device, scale);
                let images = [(); 2].map(|()| {
                    textures.draw(&device, &mut view, frame.setup()).unwrap();
                    [view.inscattered(), view.transmittance()].map(|image| pixels(&device, image))
                });
                assert!(images[0] == images[1], "{kind:?}: two frames, two images");
                let values = images[0].iter().flatten();
                assert!(values.clone().all(|value| value.is_finite() && *value >= 0.0), "{kind:?}");
            });
        }
    }
}

#[test]
fn frames_after_the_second_allocate_nothing() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let frame = OwnedFrame::stock(MapKind::Cascades, [33, 9], 32, NOISE);
    let textures = Textures::new(&device, &frame, |_| None);
    frame.with(|frame| {
        let mut view = view(&device, 1);
        let (mut counted, mut bytes, mut slices) = (Vec::new(), Vec::new(), Vec::new());
        for moved in 0..100 {
            let camera = frame.camera().shifted(0.2 * f64::from(moved), 0.1);
            let setup = Setup::new(
                &camera,
                frame.light(),
                *frame.setup().maps(),
                frame.medium(),
                frame.max_distance(),
            )
            .unwrap();
            textures.draw(&device, &mut view, &setup).unwrap();
            device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            let counters = device.device.get_internal_counters().hal;
            counted.push([counters.textures.read(), counters.bind_groups.read(), counters.buffers.read()]);
            bytes.push(view.memory_bytes());
            slices.push(view.plan([33, 9], 1).workgroups());
        }
        assert!(slices.iter().any(|&groups| groups != slices[2]), "the camera moves");
        assert_eq!((&counted[2][..2], bytes[2]), (&counted[99][..2], bytes[99]));
        // wgpu's own staging for `write_buffer` comes and goes.
        assert!(counted[99][2] <= counted[2][2], "{:?} buffers", [counted[2], counted[99]]);
    });
}

#[test]
fn what_slices_do_not_render_is_refused_by_name() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let refused = |frame: &OwnedFrame| {
        let textures = Textures::new(&device, frame, |_| None);
        frame.with(|frame| {
            textures.draw(&device, &mut view(&device, 1), frame.setup()).unwrap_err().to_string()
        })
    };
    let sun = || OwnedFrame::stock(MapKind::Orthographic, [9, 7], 16, NOISE);
    let mut orthographic = sun();
    orthographic.camera =
        Camera::orthographic([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 6.0, [9, 7]).unwrap();
    for (word, frame) in [
        ("orthographic camera", orthographic),
        ("point light", OwnedFrame::stock(MapKind::Point, [9, 7], 16, NOISE)),
        ("spot light", OwnedFrame::stock(MapKind::Spot, [9, 7], 16, NOISE)),
        ("texture", sun().with_glass()),
    ] {
        let said = refused(&frame);
        println!("{said}");
        assert!(said.contains(word), "{word}: {said}");
    }
    let options = |settings| ViewOptions {
        technique: Technique::Epipolar(settings),
        output: Output::Rgba16Float,
        scale: 1,
    };
    for bad in [
        settings(0.0),
        settings(f64::NAN),
        EpipolarSettings { factor_error: 1.0, ..settings(1.0) },
        EpipolarSettings { towards_light: 0.0, ..settings(1.0) },
        EpipolarSettings { fewest_slices: -1.0, ..settings(1.0) },
        EpipolarSettings { batch_bytes: 1 << 40, ..settings(1.0) },
    ] {
        let said = View::new(&device.gpu, options(bad)).unwrap_err().to_string();
        assert!(said.contains("give"), "{said}");
    }
}
