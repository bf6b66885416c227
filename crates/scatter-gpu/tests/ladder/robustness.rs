//! Rung 5 of the ladder: any texture content, odd sizes and viewports, every depth convention, several samples a pixel, the
//! second frame's allocations, and the picture that is composed.

use scatter_core::{
    Camera, ClipSpace, DepthEncoding, DepthMap, Frame, Medium, Phase, ScatterImage, ShadowDepthEncoding,
    ShadowMap, VolumetricShadow,
};
use scatter_gpu::harness::{GpuTechnique, HarnessDevice};
use scatter_gpu::{
    Compose, GpuError, GpuFrame, Inputs, Output, ShadowDepth, Technique, View, ViewOptions, wgpu,
};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, rel_rmse};

const MARCH: Technique = Technique::RayMarch { steps: 48, jitter: None, uniform: false };
const RANDOM: Filling = Filling::Random { seed: 9, far: 12.0 };

fn view(device: &HarnessDevice, technique: Technique, scale: u32) -> View {
    View::new(&device.gpu, ViewOptions { technique, output: Output::Rgba32Float, scale }).unwrap()
}

/// Encodes and submits one frame, or says why not.
fn draw(
    device: &HarnessDevice,
    view: &mut View,
    frame: &GpuFrame<'_>,
    inputs: &Inputs<'_>,
) -> Result<(), GpuError> {
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
    view.prepare(&device.queue, frame, inputs.viewport)?;
    view.encode(&mut encoder, &frame.setup, inputs, None)?;
    device.queue.submit([encoder.finish()]);
    assert_eq!(pollster::block_on(scope.pop()).map(|error| error.to_string()), None);
    Ok(())
}

fn pixels(device: &HarnessDevice, image: &wgpu::Texture) -> Vec<[f32; 4]> {
    bytemuck::pod_collect_to_vec(&device.read_texture(image, 16))
}

#[test]
fn random_bits_as_depths_and_maps_give_finite_pixels() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mut random = Random(17);
    for kind in MapKind::ALL {
        let owned = OwnedFrame::stock(kind, [17, 13], 32, RANDOM);
        owned.with(|frame| {
            let layers = frame.shadow().layer_count().max(1) as u32;
            let depth = device.r32float([17, 13], 1);
            let shadow = device.r32float([32, 32], layers);
            let mut bits = |count: usize| (0..count).map(|_| random.bits() as u32).collect::<Vec<u32>>();
            device.write(&depth, 0, [17, 13], bytemuck::cast_slice(&bits(17 * 13)));
            for layer in 0..layers {
                device.write(&shadow, layer, [32, 32], bytemuck::cast_slice(&bits(32 * 32)));
            }
            let meanings: Vec<_> =
                (0..frame.shadow().layer_count() as u32).map(ShadowDepth::linear).collect();
            for encoding in [
                DepthEncoding::AlongRay,
                DepthEncoding::ReversedInfinite { near: 0.1 },
                DepthEncoding::Forward { near: 0.1, far: 50.0 },
            ] {
                let gpu_frame =
                    GpuFrame { setup: *frame.setup(), depth: encoding, shadow: &meanings, exposure: 1.0 };
                let inputs = Inputs {
                    depth: &depth,
                    depth_layer: 0,
                    viewport: [0, 0, 17, 13],
                    shadow: (!meanings.is_empty()).then_some(&shadow),
                    glass: None,
                };
                for technique in [MARCH, Technique::MinmaxMipmap] {
                    let mut view = view(&device, technique, 1);
                    draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
                    for image in [view.inscattered().unwrap(), view.transmittance().unwrap()] {
                        let found = pixels(&device, image);
                        assert!(
                            found.iter().flatten().all(|value| value.is_finite() && *value >= 0.0),
                            "{kind:?} {encoding:?} {technique:?}"
                        );
                    }
                }
            }
        });
    }
}

/// Engines' depths and maps, viewports and two frames: the image of the decoded frame, whatever they are stored as.
#[test]
fn every_depth_convention_gives_the_image_of_the_decoded_frame() {
    if crate::support::skipped() {
        return;
    }
    let size = [37, 21];
    let camera = Camera::perspective([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, size).unwrap();
    let mut owned = OwnedFrame::stock(MapKind::Orthographic, size, 64, RANDOM);
    owned.camera = camera.clone();
    let (near, far) = (0.5, 40.0);
    for encoding in [
        DepthEncoding::Forward { near, far },
        DepthEncoding::Reversed { near, far },
        DepthEncoding::ForwardInfinite { near },
        DepthEncoding::ReversedInfinite { near },
        DepthEncoding::ViewZ,
        DepthEncoding::AlongRay,
    ] {
        let mut encoded = Vec::new();
        encoding.encode(&camera, &owned.depth, &mut encoded).unwrap();
        let mut decoded = Vec::new();
        encoding.decode(&camera, &encoded, &mut decoded).unwrap();
        let reference = owned.with(|frame| {
            let depth = DepthMap::new(&decoded, size).unwrap();
            let frame = Frame::new(
                &camera,
                depth,
                frame.light(),
                frame.shadow(),
                frame.medium(),
                frame.max_distance(),
            )
            .unwrap();
            let mut image = ScatterImage::new();
            GpuTechnique::new(Technique::MinmaxMipmap).render(&frame, &mut image).unwrap();
            image
        });
        let device = HarnessDevice::shared().unwrap();
        owned.with(|frame| {
            // In a larger texture, beside rubbish.
            let (origin, whole) = ([5, 3], [48, 32]);
            let mut buffer = vec![f32::NAN; 48 * 32];
            for (index, &texel) in encoded.iter().enumerate() {
                buffer[(index / 37 + 3) * 48 + index % 37 + 5] = texel;
            }
            let depth = device.r32float(whole, 1);
            device.write(&depth, 0, whole, bytemuck::cast_slice(&buffer));
            // The map's texels in an atlas, with their own z/w.
            let layer = frame.shadow().layer(0).unwrap();
            let side = layer.projection().size();
            let atlas = device.r32float([96, 80], 1);
            let mut texels = vec![0.0f32; 96 * 80];
            for (index, &texel) in layer.texels().iter().enumerate() {
                texels[(index / side[0] as usize + 7) * 96 + index % side[0] as usize + 9] = texel;
            }
            device.write(&atlas, 0, [96, 80], bytemuck::cast_slice(&texels));
            let meaning = [ShadowDepth { origin: [9, 7], ..ShadowDepth::linear(0) }];
            let gpu_frame =
                GpuFrame { setup: *frame.setup(), depth: encoding, shadow: &meaning, exposure: 1.0 };
            let inputs = Inputs {
                depth: &depth,
                depth_layer: 0,
                viewport: [origin[0], origin[1], 37, 21],
                shadow: Some(&atlas),
                glass: None,
            };
            let mut view = view(&device, Technique::MinmaxMipmap, 1);
            draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
            let mut image = ScatterImage::new();
            image.resize(size);
            for (pixel, texel) in
                image.pixels_mut().0.iter_mut().zip(pixels(&device, view.inscattered().unwrap()))
            {
                *pixel = [texel[0], texel[1], texel[2]];
            }
            let error = rel_rmse(&image, &reference);
            println!("{encoding:?}: rel_rmse {error:.1e}");
            // A quotient of f32 texels: z near 1 of a forward buffer is good to 2⁻²⁴ of (far/near) of the distance.
            assert!(error < 2e-5, "{encoding:?}: {error:e}");
        });
    }
}

#[test]
fn a_reversed_map_of_a_sun_means_the_depths_that_it_decodes_to() {
    // Rows of an orthographic clip matrix looking down, reversed z: near plane at y = 8, far plane at y = −12.
    let clip = [[0.2, 0.0, 0.0, 0.0], [0.0, 0.0, 0.05, 0.0], [0.0, 0.2, 0.0, 0.0], [0.0, 0.0, 0.6, 1.0]];
    let encoding = ShadowDepthEncoding::Clip(ClipSpace::WGPU.reversed());
    let (_, meaning) = ShadowDepth::of_clip(encoding, clip, [4, 3], 0).unwrap();
    let mut linear = Vec::new();
    let texels: Vec<f32> = (0..12).map(|n| n as f32 / 12.0).collect();
    encoding.decode(clip, [4, 3], &texels, &mut linear).unwrap();
    let scatter_core::ShadowDepthQuotient::Quotient { coefficients: [a, b, c, d], slope, cleared } =
        meaning.quotient
    else {
        panic!("a parallel map is a quotient")
    };
    assert_eq!((slope.length(), cleared), (0.0, Some(0.0)));
    for (&texel, &depth) in texels.iter().zip(&linear).skip(1) {
        let z = f64::from(texel);
        assert!(((a + b * z) / (c + d * z) - f64::from(depth)).abs() < 1e-5, "{texel}: {depth}");
    }
    assert!(linear[0].is_infinite());
    let _ = ShadowMap::Unshadowed;
}

#[test]
fn frames_after_the_second_allocate_nothing_and_repeat_their_bits() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    for technique in [MARCH, Technique::MinmaxMipmap] {
        let owned = OwnedFrame::stock(MapKind::Cascades, [33, 9], 32, RANDOM);
        owned.with(|frame| {
            let depth = device.r32float([33, 9], 1);
            device.write(&depth, 0, [33, 9], bytemuck::cast_slice(frame.depth().texels()));
            let shadow = device.r32float([32, 32], 2);
            for (index, layer) in frame.shadow().layers().enumerate() {
                let size = layer.projection().size();
                device.write(&shadow, index as u32, size, bytemuck::cast_slice(layer.texels()));
            }
            let meanings = [ShadowDepth::linear(0), ShadowDepth::linear(1)];
            let inputs = Inputs {
                depth: &depth,
                depth_layer: 0,
                viewport: [0, 0, 33, 9],
                shadow: Some(&shadow),
                glass: None,
            };
            let mut view = view(&device, technique, 1);
            let mut counted = Vec::new();
            for moved in 0..100 {
                let camera = frame.camera().shifted(0.01 * f64::from(moved), 0.0);
                let setup = scatter_core::Setup::new(
                    &camera,
                    frame.light(),
                    *frame.setup().maps(),
                    frame.medium(),
                    frame.max_distance(),
                )
                .unwrap();
                let gpu_frame =
                    GpuFrame { setup, depth: DepthEncoding::AlongRay, shadow: &meanings, exposure: 1.0 };
                draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
                device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
                let counters = device.device.get_internal_counters().hal;
                // wgpu 30 does not count textures on Vulkan, but their bytes.
                counted.push([
                    counters.buffers.read(),
                    counters.texture_memory.read(),
                    counters.texture_views.read(),
                    counters.bind_groups.read(),
                ]);
            }
            // wgpu's own staging for `write_buffer` comes and goes; what we hold does not change.
            assert_eq!(counted[2][1..], counted[99][1..], "{technique:?}");
            assert!(
                counted[99][0] <= counted[2][0],
                "{technique:?}: {:?} buffers",
                [counted[2], counted[99]]
            );
            let gpu_frame = GpuFrame {
                setup: *frame.setup(),
                depth: DepthEncoding::AlongRay,
                shadow: &meanings,
                exposure: 1.0,
            };
            draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
            let first = pixels(&device, view.inscattered().unwrap());
            draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
            assert!(
                first == pixels(&device, view.inscattered().unwrap()),
                "{technique:?}: two frames, two images"
            );
        });
    }
}

/// Composed at full and at half size: over an even picture the result is `light + through · picture`.
#[test]
fn the_picture_is_composed_at_full_and_half_size() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let size = [34, 21];
    // Nothing casts a shadow, and all rays end at one distance: what half the pixels know is right for the others, too.
    let mut owned = OwnedFrame::stock(MapKind::Unshadowed, size, 8, RANDOM);
    owned.depth.fill(7.0);
    // Channels extinguished differently; and phase functions, by which light varies over a block of pixels.
    let isotropic = Medium::homogeneous([0.1, 0.2, 0.3], [0.0; 3], Phase::Isotropic).unwrap();
    let peaked = Medium::homogeneous([0.08; 3], [0.01; 3], Phase::henyey_greenstein(0.7).unwrap()).unwrap();
    let media = [
        ("grey", scatter_testing::grey_medium()),
        ("coloured extinction", isotropic),
        ("a peaked phase function", peaked),
        ("both", scatter_testing::coloured_medium()),
    ];
    for ((name, medium), scale) in media.iter().flat_map(|medium| [1, 2, 4].map(|scale| (medium, scale))) {
        owned.medium = medium.clone();
        owned.with(|frame| {
            let depth = device.r32float(size, 1);
            device.write(&depth, 0, size, bytemuck::cast_slice(frame.depth().texels()));
            let gpu_frame = GpuFrame {
                setup: *frame.setup(),
                depth: DepthEncoding::AlongRay,
                shadow: &[],
                exposure: 2.0,
            };
            let inputs =
                Inputs { depth: &depth, depth_layer: 0, viewport: [0, 0, 34, 21], shadow: None, glass: None };
            let mut view = view(&device, MARCH, scale);
            draw(&device, &mut view, &gpu_frame, &inputs).unwrap();
            let format = wgpu::TextureFormat::Rgba16Float;
            let target = device.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: 40, height: 30, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            // 0.5 in half floats, alpha 1.
            let grey: Vec<u16> = [0x3800u16, 0x3800, 0x3800, 0x3c00].repeat(40 * 30);
            device.write(&target, 0, [40, 30], bytemuck::cast_slice(&grey));
            let mut encoder = device.device.create_command_encoder(&Default::default());
            let target_view = target.create_view(&Default::default());
            device
                .validated(|| {
                    view.encode_composite(&mut encoder, &target_view, format, [4, 6, 34, 21], Compose::Full)?;
                    device.queue.submit([encoder.finish()]);
                    Ok(())
                })
                .unwrap();
            let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&device.read_texture(&target, 8));
            let half = |bits: u16| {
                let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
                if exponent == 0 {
                    mantissa * 2f64.powi(-24)
                } else {
                    (1024.0 + mantissa) * 2f64.powi(exponent - 25)
                }
            };
            let mut image = ScatterImage::new();
            raymarch_ref::ShadowMapWalk::new().render(frame, &mut image).unwrap();
            let mut worst = 0.0f64;
            for y in 0..21u32 {
                for x in 0..34u32 {
                    let found = halves[((y + 6) * 40 + x + 4) as usize];
                    for (c, &bits) in found[..3].iter().enumerate() {
                        let through = f64::from(image.transmittance()[(y * 34 + x) as usize][c]);
                        let expected = 2.0 * f64::from(image.at(x, y)[c]) + 0.5 * through;
                        worst = worst.max((half(bits) / expected - 1.0).abs());
                    }
                }
            }
            println!("{name}, scale {scale}: {worst:.1e}");
            // Two roundings to 11 bits, of the target; light of one distance is the same in all pixels but for its phase,
            // which is each pixel's own.
            assert!(worst < 2e-3, "{name}, scale {scale}: {worst:e}");
            assert_eq!(
                halves[0],
                [0x3800, 0x3800, 0x3800, 0x3c00],
                "outside of the viewport nothing is drawn"
            );
        });
    }
}

#[test]
fn what_does_not_fit_is_said_before_anything_is_recorded() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let owned = OwnedFrame::stock(MapKind::Orthographic, [9, 7], 16, RANDOM);
    owned.with(|frame| {
        let (depth, small) = (device.r32float([9, 7], 1), device.r32float([4, 4], 1));
        let meanings = [ShadowDepth::linear(0)];
        let said = |depth: &wgpu::Texture, shadow: Option<&wgpu::Texture>, meanings: &[ShadowDepth]| {
            let gpu_frame = GpuFrame {
                setup: *frame.setup(),
                depth: DepthEncoding::AlongRay,
                shadow: meanings,
                exposure: 1.0,
            };
            let inputs = Inputs { depth, depth_layer: 0, viewport: [0, 0, 9, 7], shadow, glass: None };
            draw(&device, &mut view(&device, MARCH, 1), &gpu_frame, &inputs).unwrap_err().to_string()
        };
        assert!(said(&depth, None, &meanings).contains("shadow texture is missing"));
        assert!(said(&depth, Some(&small), &meanings).contains("a map of 16x12"));
        assert!(said(&small, Some(&depth), &meanings).contains("smaller than the viewport"));
        assert!(said(&depth, Some(&depth), &[]).contains("give one a map"));
        let bad =
            View::new(&device.gpu, ViewOptions { technique: MARCH, output: Output::Rgba16Float, scale: 3 });
        assert!(bad.unwrap_err().to_string().contains("give 1, 2 or 4"));
    });
}
