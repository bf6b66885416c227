//! Rungs 2 and 5 of the ladder for exact min/max: extrema equal to the bit, the traversal fed the CPU's extrema, what it
//! looked at, mutants of both, and textures of random bits.

use scatter_core::{DepthEncoding, Frame};
use scatter_gpu::harness::{Bound, HarnessDevice};
use scatter_gpu::{GpuFrame, Inputs, Output, ShadowDepth, Technique, View, ViewOptions, wgpu};
use scatter_kernels::FrameUniform;
use scatter_kernels::minmax::{EXTREMA, FINEST, MinMaxPlan, TRAVERSE_FLOAT, TreeLayer};
use scatter_kernels::modules::Module;
use scatter_testing::{Filling, MapKind, OwnedFrame, Random};

use crate::support::changed;

/// `FARTHEST` of the shaders.
const FARTHEST: f32 = scatter_kernels::FARTHEST;

/// A frame on the device, for passes that run by themselves.
struct Scene {
    uniform: FrameUniform,
    plan: MinMaxPlan,
    maps: wgpu::TextureView,
}

fn scene(device: &HarnessDevice, frame: &Frame<'_>) -> Scene {
    let layers: Vec<_> = frame.shadow().layers().collect();
    let size = layers.iter().fold([1; 2], |[w, h], layer| {
        let [width, height] = layer.projection().size();
        [w.max(width), h.max(height)]
    });
    let texture = device.r32float(size, layers.len() as u32);
    for (index, layer) in layers.iter().enumerate() {
        device.write(&texture, index as u32, layer.projection().size(), bytemuck::cast_slice(layer.texels()));
    }
    let shadow: Vec<_> = (0..layers.len() as u32).map(ShadowDepth::linear).collect();
    let gpu_frame =
        GpuFrame { setup: *frame.setup(), depth: DepthEncoding::AlongRay, shadow: &shadow, exposure: 1.0 };
    let mut uniform = FrameUniform::new(&gpu_frame, [0, 0]).unwrap();
    uniform.depth_more[1] = 1.0;
    let mut plan = MinMaxPlan::default();
    plan.rebuild(frame.setup()).unwrap();
    let maps = texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    });
    Scene { uniform, plan, maps }
}

/// All nodes by loops over their texels.
fn nodes_of(frame: &Frame<'_>, plan: &MinMaxPlan) -> Vec<[f32; 2]> {
    let mut nodes = vec![[f32::NAN; 2]; plan.node_bytes() as usize / 8];
    for (tree, layer) in plan.layers().iter().zip(frame.shadow().layers()) {
        let [width, height] = layer.projection().size();
        for level in FINEST..=tree.coarsest {
            let columns = width.div_ceil(1 << level);
            for j in 0..height {
                for i in 0..width {
                    let at = tree.offsets[level as usize] + (j >> level) * columns + (i >> level);
                    let node = &mut nodes[at as usize];
                    let depth = layer.at(i, j).min(FARTHEST);
                    *node = [node[0].min(depth), node[1].max(depth)];
                }
            }
        }
    }
    nodes
}

/// The same by the two passes.
fn extrema(device: &HarnessDevice, scene: &Scene, modules: [&'static Module; 2]) -> Vec<[f32; 2]> {
    let layers: &[u8] = bytemuck::cast_slice::<TreeLayer, u8>(scene.plan.layers());
    let blank = vec![0xffu8; scene.plan.node_bytes() as usize];
    let low = device.run(
        modules[0],
        0,
        &[
            (0, Bound::Uniform(bytemuck::bytes_of(&scene.uniform))),
            (modules[0].entries[0].bindings[1].number, Bound::Storage(layers)),
            (modules[0].entries[0].bindings[2].number, Bound::Storage(&blank)),
            (4, Bound::Texture(&scene.maps)),
        ],
        scene.plan.extrema_low(),
    );
    let high = device.run(
        modules[1],
        0,
        &[
            (modules[1].entries[0].bindings[0].number, Bound::Storage(layers)),
            (modules[1].entries[0].bindings[1].number, Bound::Storage(&low[1])),
        ],
        scene.plan.extrema_high(),
    );
    bytemuck::pod_collect_to_vec(&high[1])
}

fn bits(nodes: &[[f32; 2]]) -> Vec<[u32; 2]> {
    nodes.iter().map(|node| node.map(f32::to_bits)).collect()
}

fn noise(kind: MapKind, side: u32) -> OwnedFrame {
    let mut frame =
        OwnedFrame::stock(kind, [19, 13], side, Filling::Random { seed: u64::from(side), far: 9.0 });
    // Some without a surface.
    for texels in &mut frame.texels {
        texels.iter_mut().step_by(7).for_each(|texel| *texel = f32::INFINITY);
    }
    frame
}

#[test]
fn extrema_are_those_of_the_texels_to_the_bit() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let swapped = changed(
        EXTREMA[0],
        "extrema, min and max swapped",
        "node = vec2<f32>(min(node.x, depth), max(node.y, depth));",
        "node = vec2<f32>(max(node.y, depth), min(node.x, depth));",
    );
    let shifted = changed(
        EXTREMA[0],
        "extrema, a texel off",
        "vec2<u32>(n & 3u, n >> 2u)",
        "vec2<u32>((n & 3u) + 1u, n >> 2u)",
    );
    let transposed = changed(
        EXTREMA[0],
        "extrema, rows and columns swapped",
        "block.y * blocks.x + block.x",
        "block.x * blocks.y + block.y",
    );
    for (kind, side) in [
        (MapKind::Orthographic, 1),
        (MapKind::Spot, 63),
        (MapKind::Cascades, 65),
        (MapKind::Point, 127),
        (MapKind::Orthographic, 517),
    ] {
        noise(kind, side).with(|frame| {
            let scene = scene(&device, frame);
            let expected = bits(&nodes_of(frame, &scene.plan));
            let found = bits(&extrema(&device, &scene, EXTREMA));
            assert_eq!(found.len(), expected.len());
            let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            println!("{kind:?}, {side}: {differing} of {} nodes differ", found.len());
            assert_eq!(differing, 0, "{kind:?}, {side}");
            if side > 64 {
                for mutant in [swapped, shifted, transposed] {
                    let found = bits(&extrema(&device, &scene, [mutant, EXTREMA[1]]));
                    // Maps of equal columns and rows hide no transposition: nodes stand elsewhere.
                    assert_ne!(found, expected, "{} is not seen, {kind:?}, {side}", mutant.name);
                }
            }
        });
    }
}

/// The traversal by itself: image, and counters.
fn traversed(
    device: &HarnessDevice,
    module: &'static Module,
    frame: &Frame<'_>,
    nodes: &[[f32; 2]],
) -> (Vec<[f32; 4]>, [u32; 4]) {
    let scene = scene(device, frame);
    let distance = device.r32float(frame.size(), 1);
    device.write(&distance, 0, frame.size(), bytemuck::cast_slice(frame.depth().texels()));
    let image = || {
        device.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: frame.size()[0],
                height: frame.size()[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    };
    let (light, through) = (image(), image());
    let views = [&distance, &light, &through].map(|texture| texture.create_view(&Default::default()));
    let bindings = module.entries[0].bindings;
    let found = device.run(
        module,
        0,
        &[
            (0, Bound::Uniform(bytemuck::bytes_of(&scene.uniform))),
            (bindings[1].number, Bound::Storage(bytemuck::cast_slice(scene.plan.layers()))),
            (bindings[2].number, Bound::Storage(bytemuck::cast_slice(nodes))),
            (3, Bound::Texture(&views[0])),
            (4, Bound::Texture(&scene.maps)),
            (5, Bound::Texture(&views[0])),
            (6, Bound::Texture(&views[1])),
            (7, Bound::Texture(&views[2])),
            (bindings[8].number, Bound::Storage(&[0; 16])),
        ],
        scene.plan.traverse(),
    );
    let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&found[2]);
    (
        bytemuck::pod_collect_to_vec(&device.read_texture(&light, 16)),
        [counts[0], counts[1], counts[2], counts[3]],
    )
}

/// Fed the CPU's extrema: no ray is cut short, texels are looked at once a visit, swapped extrema are seen, and so is a ray
/// that takes a column's border for a row's.
#[test]
fn the_traversal_looks_at_few_nodes_and_mutants_of_it_are_seen() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let counting = changed(
        &TRAVERSE_FLOAT_STATIC,
        "traverse, counting",
        "override count_looks: bool = false",
        "override count_looks: bool = true",
    );
    let mixed_up = changed(
        &TRAVERSE_FLOAT_STATIC,
        "traverse, rows and columns swapped",
        "let by_rows = row_end < column_end;",
        "let by_rows = row_end > column_end;",
    );
    let boards = scatter_testing::boards([31, 17]);
    boards.with(|frame| {
        let nodes = nodes_of(frame, &scene(&device, frame).plan);
        let (image, [cut, nodes_looked, texels, runs]) = traversed(&device, counting, frame, &nodes);
        let rays = 31 * 17;
        println!(
            "boards: {:.1} nodes, {:.1} texels, {:.2} lit runs a ray; {cut} cut short",
            f64::from(nodes_looked) / f64::from(rays),
            f64::from(texels) / f64::from(rays),
            f64::from(runs) / f64::from(rays)
        );
        // Three boards cut a ray into at most four lit runs; a ray that visits each texel of its way sees 80 + 64.
        assert!(cut == 0 && runs <= 4 * rays && runs >= rays / 2 && nodes_looked + texels < 144 * rays / 2);
        let sum = |image: &[[f32; 4]]| image.iter().map(|p| f64::from(p[0])).sum::<f64>();
        let lit = sum(&image);
        let swapped: Vec<_> = nodes.iter().map(|&[near, far]| [far, near]).collect();
        for (name, mutant) in [
            ("extrema swapped", traversed(&device, &TRAVERSE_FLOAT_STATIC, frame, &swapped).0),
            ("borders swapped", traversed(&device, mixed_up, frame, &nodes).0),
        ] {
            let off =
                image.iter().zip(&mutant).map(|(a, b)| f64::from((a[0] - b[0]).abs())).sum::<f64>() / lit;
            println!("{name}: {off:.2} of the light elsewhere");
            assert!(off > 0.01, "{name} is not seen: {off:e}");
        }
    });
}

/// The module as a static: the harness keeps pipelines by name.
static TRAVERSE_FLOAT_STATIC: Module = TRAVERSE_FLOAT;

/// A driver that fuses one product of a ray's slope leaves a rounding where there is none. Either sign of it must do: rays that
/// stay on a border of texels once left the map by it, next to the lamp, and were dark from there on (a tenth of the light
/// of `Point`, on a card).
#[test]
fn the_rounding_of_a_slope_decides_nothing() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let tilted = ["+", "-"].map(|sign| {
        changed(
            &TRAVERSE_FLOAT_STATIC,
            if sign == "+" { "traverse, slopes rounded up" } else { "traverse, slopes rounded down" },
            "let slope = step * w.x - place * w.y;",
            &format!("let slope = step * w.x - place * w.y {sign} 1e-7 * abs(place * w.y);"),
        )
    });
    for kind in [MapKind::Spot, MapKind::SpotCube, MapKind::Point, MapKind::Faces] {
        OwnedFrame::stock(kind, [37, 21], 64, Filling::Constant(7.0)).with(|frame| {
            let nodes = nodes_of(frame, &scene(&device, frame).plan);
            let image = traversed(&device, &TRAVERSE_FLOAT_STATIC, frame, &nodes).0;
            let mean = image.iter().map(|p| f64::from(p[0])).sum::<f64>() / image.len() as f64;
            for module in tilted {
                let other = traversed(&device, module, frame, &nodes).0;
                let off =
                    image.iter().zip(&other).map(|(a, b)| f64::from((a[0] - b[0]).abs())).fold(0.0, f64::max);
                println!("{kind:?}, {}: {:.1e} of the mean (1e-5)", module.name, off / mean);
                // Runs that are cut elsewhere are integrated in other panels: a hundred roundings.
                assert!(off <= 1e-5 * mean, "{kind:?}, {}: {:e}", module.name, off / mean);
            }
        });
    }
}

/// Whatever the textures hold, the image is finite, and both frames have the same bits.
#[test]
fn textures_of_random_bits_give_finite_images_twice_the_same() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    for (seed, kind) in MapKind::ALL.into_iter().enumerate() {
        let frame = OwnedFrame::stock(kind, [17, 13], 33, Filling::Constant(5.0));
        frame.with(|frame| {
            let mut random = Random(seed as u64 + 1);
            let mut words = |count: u32| -> Vec<u32> {
                (0..count).map(|_| random.below(1 << 16) << 16 | random.below(1 << 16)).collect()
            };
            let count = frame.shadow().layer_count() as u32;
            let (depth, maps) = (device.r32float([17, 13], 1), device.r32float([33; 2], count.max(1)));
            device.write(&depth, 0, [17, 13], bytemuck::cast_slice(&words(17 * 13)));
            for layer in 0..count {
                device.write(&maps, layer, [33; 2], bytemuck::cast_slice(&words(33 * 33)));
            }
            let options =
                ViewOptions { technique: Technique::MinmaxMipmap, output: Output::Rgba32Float, scale: 1 };
            let mut view = View::new(&device.gpu, options).unwrap();
            let shadow: Vec<_> = (0..count).map(ShadowDepth::linear).collect();
            let viewport = [0, 0, 17, 13];
            let inputs = Inputs {
                depth: &depth,
                depth_layer: 0,
                viewport,
                shadow: (count > 0).then_some(&maps),
                glass: None,
            };
            let gpu_frame = GpuFrame {
                setup: *frame.setup(),
                depth: DepthEncoding::AlongRay,
                shadow: &shadow,
                exposure: 1.0,
            };
            let images = [(); 2].map(|()| {
                let mut encoder = device.device.create_command_encoder(&Default::default());
                device
                    .validated(|| {
                        view.prepare(&device.queue, &gpu_frame, viewport)?;
                        view.encode(&mut encoder, frame.setup(), &inputs, None)
                    })
                    .unwrap();
                device.queue.submit([encoder.finish()]);
                [view.inscattered(), view.transmittance()]
                    .map(|image| device.read_texture(image.expect("it was encoded"), 16))
            });
            assert_eq!(images[0], images[1], "{kind:?}");
            let values: Vec<f32> = bytemuck::pod_collect_to_vec(&images[0][0]);
            assert!(values.iter().all(|value| value.is_finite() && *value >= 0.0), "{kind:?}");
        });
    }
}
