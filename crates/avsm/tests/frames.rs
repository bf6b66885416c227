//! The technique on whole frames: without translucent occluders against the exact walk through the shadow map, with them
//! against sums over many short steps of the ray.

use avsm::{Avsm, Between, Curve, Moments, Nodes, Opaque, Options, Texels};
use glam::DVec3;
use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Frame, HeightFalloff, Level, MapError, MapProjection, RayLight, ScatterImage, Translucent,
    TranslucentLayer, TranslucentSegment, TranslucentSource, VolumetricShadow, walked_radiance,
};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, Recipe, coloured_medium, differing, values};

/// Pixels are written in f32: 6e-8 of the value, which is at most twice the unoccluded one behind glass.
const ROUNDING: f64 = 2e-6;

/// Crossings in lanes: 1e-5 of each for the closed form in f32, 1e-4 of its length at the most for the place of a step, of which
/// a ray through 24 texels has some ten, each a share of the ray; where the light is no exponential, what a parabola leaves of it.
const LANES: f64 = 1e-4;

fn in_height_fog(mut frame: OwnedFrame, seed: u64) -> OwnedFrame {
    let mut random = Random(seed);
    let up = random.direction().into();
    let falloff = HeightFalloff::new(up, random.range(-1.0, 1.0), random.range(0.2, 5.0)).unwrap();
    frame.medium = frame.medium.clone().with_height_falloff(falloff);
    frame
}

fn walked(frame: &OwnedFrame) -> Vec<[f64; 3]> {
    frame.with(|frame| {
        let [width, height] = frame.size();
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        pixels.map(|[x, y]| walked_radiance(frame, x, y).to_array()).collect()
    })
}

#[test]
fn without_translucent_occluders_it_is_the_exact_walk() {
    let mut worst = 0.0f64;
    for kind in MapKind::ALL {
        for seed in 0..60 {
            let recipe = Recipe { size: [9, 5], textured: seed % 4 == 3, ..Recipe::of(kind) };
            let mut frame = OwnedFrame::random(seed, recipe);
            let in_fog = seed % 3 == 1;
            if in_fog {
                frame = in_height_fog(frame, seed);
            }
            let truth =
                if in_fog { walked(&frame) } else { values(&frame.render(&mut ShadowMapWalk::new())) };
            let scale = walked(&frame.unoccluded());
            let scale: Vec<_> = scale.iter().map(|pixel| pixel.map(|value| 2.0 * value)).collect();
            let image = frame.render(&mut Avsm::new(Options::default()));
            let found = differing(&image, &truth, &scale, ROUNDING);
            assert!(found.is_close(), "{kind:?} {seed}: {found}");
            worst = worst.max(found.largest());
        }
        for side in [257, 600] {
            // An even number of columns: in the middle one a ray runs along a border of texels, where rounding decides.
            let frame = OwnedFrame::stock(kind, [16, 9], side, Filling::Random { seed: 3, far: 9.0 });
            let truth = values(&frame.render(&mut ShadowMapWalk::new()));
            let image = frame.render(&mut Avsm::new(Options::default()));
            let found = differing(&image, &truth, &walked(&frame.unoccluded()), ROUNDING);
            assert!(found.is_close(), "{kind:?} {side}: {found}");
        }
    }
    println!("worst {worst:.1e} of {ROUNDING:.1e}");
}

/// With the curve map's texels those of the shadow map, opaque surfaces in the curves are what they are in the map: to the
/// rounding of depths to f32 at most. Every kind of curve that can hold a step.
#[test]
fn opaque_surfaces_in_the_curves_are_those_of_the_map() {
    let mut worst = 0.0f64;
    for kind in MapKind::ALL {
        let side = 24;
        let mut frame = OwnedFrame::stock(kind, [14, 9], side, Filling::Random { seed: 5, far: 9.0 });
        frame.medium = coloured_medium();
        let truth = values(&frame.render(&mut ShadowMapWalk::new()));
        for (curve, between) in [
            (Curve::Avsm, Between::Exponential),
            (Curve::Avsm, Between::Linear),
            (Curve::Uncompressed, Between::Exponential),
            (Curve::Deep, Between::Linear),
        ] {
            let options =
                Options { opaque: Opaque::Curve, curves: side, curve, between, ..Options::default() };
            let image = frame.render(&mut Avsm::new(options));
            let is_in_lanes = curve == Curve::Avsm && between == Between::Exponential;
            let allowed = if is_in_lanes { LANES } else { ROUNDING };
            let found = differing(&image, &truth, &walked(&frame.unoccluded()), allowed);
            assert!(found.is_close(), "{kind:?} {curve:?}: {found}");
            worst = worst.max(found.largest());
        }
    }
    println!("worst {worst:.1e} of {LANES:.1e}");
}

/// Smoke and hair for maps of these projections: a list for each layer.
struct Smoke {
    projections: Vec<MapProjection>,
    offsets: Vec<Vec<u32>>,
    segments: Vec<Vec<TranslucentSegment>>,
}

impl Smoke {
    /// Random segments in two thirds of the texels, up to six each, to a depth of 9.
    fn random(seed: u64, projections: &[MapProjection]) -> Self {
        let mut random = Random(seed);
        let (mut offsets, mut segments) = (Vec::new(), Vec::new());
        for projection in projections {
            let [width, height] = projection.size();
            let (mut starts, mut list) = (vec![0], Vec::new());
            for _ in 0..width * height {
                for _ in 0..random.below(9).saturating_sub(2) {
                    let entry = random.range(0.1, 8.0) as f32;
                    let segment = match random.below(3) {
                        0 => TranslucentSegment::hair(entry, random.range(0.0, 0.6) as f32),
                        _ => TranslucentSegment::volume(
                            entry,
                            entry + random.range(0.1, 2.0) as f32,
                            random.range(0.0, 0.8) as f32,
                        ),
                    };
                    list.push(segment);
                }
                starts.push(list.len() as u32);
            }
            offsets.push(starts);
            segments.push(list);
        }
        Self { projections: projections.to_vec(), offsets, segments }
    }

    fn layers(&self) -> Vec<TranslucentLayer<'_>> {
        (0..self.projections.len())
            .map(|index| {
                TranslucentLayer::new(self.projections[index], &self.offsets[index], &self.segments[index])
                    .unwrap()
            })
            .collect()
    }
}

/// Names the very segments of a [`Smoke`], for maps of its own projections.
struct Stream<'a>(Vec<TranslucentLayer<'a>>);

impl TranslucentSource for Stream<'_> {
    fn capture(
        &self,
        projection: &MapProjection,
        [x0, y0, x1, y1]: [u32; 4],
        sink: &mut dyn FnMut(u32, TranslucentSegment),
    ) -> Result<(), MapError> {
        let layer =
            self.0.iter().find(|layer| layer.projection() == projection).expect("a map of this stream");
        for y in y0..y1 {
            for x in x0..x1 {
                layer.at(x, y).iter().for_each(|segment| sink((y - y0) * (x1 - x0) + (x - x0), *segment));
            }
        }
        Ok(())
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some([[-9.0; 3], [9.0; 3]])
    }

    fn memory_bytes(&self) -> u64 {
        0
    }
}

/// A pixel by `steps` equal steps to the end of its ray, each an exact interval of the light times the visibility and the
/// transmittance at its middle: nothing of curves, closed forms of pieces or walks in it.
fn stepped(frame: &Frame<'_>, layers: &[TranslucentLayer<'_>], [x, y]: [u32; 2], steps: u32) -> DVec3 {
    let (camera, end) = (frame.camera(), frame.ray_end(x, y));
    let ray = camera.pixel_ray(x, y);
    let light = RayLight::new(frame.light(), frame.medium(), camera.eye(), &ray);
    let mut sum = DVec3::ZERO;
    for step in 0..steps {
        let [a, b] = [step, step + 1].map(|n| end * f64::from(n) / f64::from(steps));
        let p = camera.eye() + ray.origin + ray.direction * (0.5 * (a + b));
        if frame.shadow().is_lit(p) {
            let left = layers.iter().find_map(|layer| layer.transmittance(p)).unwrap_or(1.0);
            let colour = frame.texture().map_or([1.0; 3], |texture| texture.lookup(p));
            sum += left * light.interval(a, b) * DVec3::from(colour.map(f64::from));
        }
    }
    sum
}

fn frames_with_smoke(check: impl Fn(&Frame<'_>, &[TranslucentLayer<'_>], &str)) {
    for kind in MapKind::ALL.into_iter().filter(|kind| *kind != MapKind::Unshadowed) {
        for seed in 0..4 {
            let recipe = Recipe { size: [4, 3], textured: seed == 3, ..Recipe::of(kind) };
            let mut frame = OwnedFrame::random(900 + seed, recipe);
            if seed == 2 {
                frame = in_height_fog(frame, seed);
            }
            let projections: Vec<_> = frame
                .projections
                .iter()
                .map(|map| map.with_size([7, if map.is_perspective() { 7 } else { 5 }]).unwrap())
                .collect();
            let smoke = Smoke::random(seed, &projections);
            let layers = smoke.layers();
            frame.with(|frame| check(frame, &layers, &format!("{kind:?} {seed}")));
        }
    }
}

/// Uncompressed curves are the sum over short steps, under every light, map, camera and medium.
#[test]
fn exact_curves_are_what_short_steps_say() {
    // Steps are cut at no edge: each of some tens loses half a step of its unoccluded value.
    const STEPS: u32 = 20_000;
    let worst = std::cell::Cell::new(0.0f64);
    frames_with_smoke(|frame, layers, what| {
        let smoke = Translucent::Captured(layers);
        let dimmed = frame.with_translucent(&smoke).unwrap();
        // Sixteen nodes lose none of up to six segments: lanes of every instruction set.
        for (curve, between, simd) in [
            (Curve::Uncompressed, Between::Exponential, Level::new()),
            (Curve::Deep, Between::Linear, Level::new()),
            (Curve::Avsm, Between::Exponential, Level::new()),
            (Curve::Avsm, Between::Exponential, Level::baseline()),
        ] {
            let nodes = Nodes::Sixteen;
            let options = Options { curve, between, nodes, threshold: 1e-5, ..Options::default() };
            let mut image = ScatterImage::new();
            Avsm::with_simd(options, simd).render(&dimmed, &mut image).unwrap();
            for (x, y) in [(0, 0), (3, 1), (1, 2)] {
                let expected = stepped(&dimmed, layers, [x, y], STEPS);
                let whole = RayLight::new(
                    frame.light(),
                    frame.medium(),
                    frame.camera().eye(),
                    &frame.camera().pixel_ray(x, y),
                )
                .interval(0.0, frame.ray_end(x, y));
                let found = DVec3::from(image.at(x, y).map(f64::from));
                let off = ((found - expected).abs() / (2.0 * whole).max(DVec3::splat(1e-30))).max_element();
                worst.set(worst.get().max(off));
                assert!(off < 1e-3, "{what}, {curve:?} at ({x}, {y}): {found} for {expected} of {whole}");
            }
        }
    });
    println!("worst {:.1e} of 1e-3", worst.get());
}

/// All other curves come near to the exact ones, and nearer with more nodes.
#[test]
fn compressed_curves_are_near_the_exact_ones() {
    let sums = std::cell::RefCell::new([0.0f64; 7]);
    frames_with_smoke(|frame, layers, _| {
        let smoke = Translucent::Captured(layers);
        let dimmed = frame.with_translucent(&smoke).unwrap();
        let render = |options: Options| {
            let mut image = ScatterImage::new();
            Avsm::new(options).render(&dimmed, &mut image).unwrap();
            values(&image)
        };
        let exact = render(Options { curve: Curve::Uncompressed, ..Options::default() });
        let scale: f64 = exact.iter().flatten().sum::<f64>() + 1e-30;
        let kinds = [
            Options { nodes: Nodes::Four, ..Options::default() },
            Options { nodes: Nodes::Eight, ..Options::default() },
            Options { nodes: Nodes::Twelve, ..Options::default() },
            Options { nodes: Nodes::Sixteen, ..Options::default() },
            Options { curve: Curve::Opacity, ..Options::default() },
            Options { curve: Curve::Fourier, ..Options::default() },
            Options { curve: Curve::Moments, moments: Moments::Eight, ..Options::default() },
        ];
        for (sum, options) in sums.borrow_mut().iter_mut().zip(kinds) {
            let image = render(options);
            let off: f64 =
                image.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).abs()).sum();
            *sum += off / scale / 24.0;
        }
    });
    let sums = sums.into_inner();
    println!("mean error, avsm 4 8 12 16, opacity, Fourier, moments 8: {sums:.4?}");
    // At most 12 nodes a texel, so 12 and 16 lose none: what is left is the parabola of a light over texels as large as these.
    assert!(sums[0] < 0.05 && sums[1] < 0.01 && sums[1] < sums[0], "{sums:?}");
    assert!(sums[2] < 5e-5 && sums[3] < 5e-5, "{sums:?}");
    assert!(sums[4] < 0.05 && sums[5] < 0.05 && sums[6] < 0.1, "{sums:?}");
}

/// Streaming gives the captured segments' image to the bit, in 8 bytes a node and texel, however many segments there are.
#[test]
fn a_stream_is_its_capture_and_holds_eight_bytes_a_node() {
    let frame = OwnedFrame::stock(MapKind::Point, [9, 5], 32, Filling::Constant(6.0));
    let smoke = Smoke::random(4, &frame.projections);
    let layers = smoke.layers();
    frame.with(|frame| {
        let captured = Translucent::Captured(&layers);
        let stream = Stream(layers.clone());
        let streamed = Translucent::Source(&stream);
        for (nodes, count) in [(Nodes::Four, 4), (Nodes::Eight, 8), (Nodes::Sixteen, 16)] {
            let images = [&captured, &streamed].map(|translucent| {
                let frame = frame.with_translucent(translucent).unwrap();
                let mut technique = Avsm::new(Options { nodes, curves: 32, ..Options::default() });
                let mut image = ScatterImage::new();
                let stats = technique.render(&frame, &mut image).unwrap();
                assert_eq!(stats.counts.get("curve bytes"), Some(8 * count * 6 * 32 * 32));
                image
            });
            assert_eq!(images[0], images[1]);
        }
        // Curves that need all segments capture them first.
        for curve in [Curve::Uncompressed, Curve::Deep, Curve::Opacity, Curve::Fourier, Curve::Moments] {
            let images = [&captured, &streamed].map(|translucent| {
                let frame = frame.with_translucent(translucent).unwrap();
                let mut image = ScatterImage::new();
                Avsm::new(Options { curve, curves: 32, ..Options::default() })
                    .render(&frame, &mut image)
                    .unwrap();
                image
            });
            assert_eq!(images[0], images[1], "{curve:?}");
        }
    });
}

/// What surfaces ask: the curve's own transmittance in a texel's middle, point and bilinear alike; between texels a mean.
#[test]
fn surfaces_see_what_the_curves_say() {
    let frame = OwnedFrame::stock(MapKind::Orthographic, [4, 3], 16, Filling::Constant(50.0));
    let smoke = Smoke::random(8, &frame.projections);
    let layers = smoke.layers();
    frame.with(|frame| {
        let captured = Translucent::Captured(&layers);
        let frame = frame.with_translucent(&captured).unwrap();
        let mut technique = Avsm::new(Options { curve: Curve::Uncompressed, ..Options::default() });
        technique.render(&frame, &mut ScatterImage::new()).unwrap();
        let map = frame.setup().maps().projections()[0];
        let point = |u: f64, v: f64, depth: f64| {
            let (origin, step) = map.light_ray(u, v).unwrap();
            origin + step * depth
        };
        for (i, j) in [(0, 0), (5, 3), (15, 11)] {
            for depth in [0.5, 3.3, 20.0] {
                let p = point(f64::from(i) + 0.5, f64::from(j) + 0.5, depth);
                let expected = layers[0].transmittance(p).unwrap();
                assert!((technique.curves().transmittance(p) - expected).abs() < 1e-6);
                assert!((technique.curves().transmittance_bilinear(p) - expected).abs() < 1e-6);
            }
        }
        let corner = point(6.0, 4.0, 5.0);
        let near = [(5.5, 3.5), (6.5, 3.5), (5.5, 4.5), (6.5, 4.5)];
        let mean =
            near.map(|(u, v)| technique.curves().transmittance(point(u, v, 5.0))).iter().sum::<f64>() / 4.0;
        assert!((technique.curves().transmittance_bilinear(corner) - mean).abs() < 1e-9);
        assert_eq!(technique.curves().transmittance(point(-1.0, 4.0, 5.0)), 1.0);
    });
}

/// Any number of threads gives the same bits.
#[test]
fn threads_do_not_change_a_bit() {
    let frame = OwnedFrame::stock(MapKind::Cascades, [33, 17], 64, Filling::Random { seed: 1, far: 9.0 });
    let smoke = Smoke::random(2, &frame.projections);
    let layers = smoke.layers();
    frame.with(|frame| {
        let captured = Translucent::Captured(&layers);
        let frame = frame.with_translucent(&captured).unwrap();
        let by_threads = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                [Curve::Avsm, Curve::Deep, Curve::Moments].map(|curve| {
                    let mut image = ScatterImage::new();
                    Avsm::new(Options { curve, ..Options::default() }).render(&frame, &mut image).unwrap();
                    image
                })
            })
        });
        assert_eq!(by_threads[0], by_threads[1]);
    });
}

/// Balls of smoke, `[x, y, z, radius]`, for any map.
struct Balls(Vec<[f64; 4]>);

impl TranslucentSource for Balls {
    fn capture(
        &self,
        projection: &MapProjection,
        [x0, y0, x1, y1]: [u32; 4],
        sink: &mut dyn FnMut(u32, TranslucentSegment),
    ) -> Result<(), MapError> {
        for [x, y, z, radius] in &self.0 {
            for (row, column) in (y0..y1).flat_map(|row| (x0..x1).map(move |column| (row, column))) {
                let Some((origin, step)) =
                    projection.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5)
                else {
                    continue;
                };
                // |origin + step·depth − middle|² = radius².
                let from = origin - DVec3::new(*x, *y, *z);
                let (half, unit) = (from.dot(step), step.length_squared());
                let square = half * half - unit * (from.length_squared() - radius * radius);
                let ends = [-1.0, 1.0].map(|side| (-half + side * square.max(0.0).sqrt()) / unit);
                let [entry, exit] = ends.map(|depth| depth.max(0.0) as f32);
                if exit > entry {
                    let texel = (row - y0) * (x1 - x0) + (column - x0);
                    sink(texel, TranslucentSegment::volume(entry, exit, 0.7 * unit.sqrt() as f32));
                }
            }
        }
        Ok(())
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let ends = self.0.iter().map(|[x, y, z, r]| (DVec3::new(*x, *y, *z), DVec3::splat(*r)));
        let all = ends.map(|(middle, reach)| (middle - reach, middle + reach));
        all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).map(|(low, high)| [low.into(), high.into()])
    }

    fn memory_bytes(&self) -> u64 {
        0
    }
}

/// On the shadow map's own texels, of which the occluders' box covers a part, uncompressed curves give shadow-map truth's image;
/// on texels of their own they give another one.
#[test]
fn on_the_shadow_maps_texels_it_is_shadow_map_truth() {
    // Nodes in f32: 6e-8 of depths of some ten, over smoke of 0.7 a unit, for each of some tens of texels on a ray.
    const NODES: f64 = 1e-5;
    let balls = Balls(vec![[0.3, 0.4, -0.2, 0.7], [-0.6, 0.9, 0.3, 0.5], [0.1, 0.2, 0.6, 0.4]]);
    let smoke = Translucent::Source(&balls);
    for kind in MapKind::ALL.into_iter().filter(|kind| *kind != MapKind::Unshadowed) {
        let owned = OwnedFrame::stock(kind, [13, 9], 48, Filling::Constant(40.0));
        owned.with(|frame| {
            let dimmed = frame.with_translucent(&smoke).unwrap();
            let render = |technique: &mut dyn VolumetricShadow, frame: &Frame<'_>| {
                let mut image = ScatterImage::new();
                technique.render(frame, &mut image).unwrap();
                image
            };
            let truth = values(&render(&mut ShadowMapWalk::new(), &dimmed));
            let base =
                Options { curve: Curve::Uncompressed, curves: 37, texels: Texels::Own, ..Options::default() };
            let scale = walked(&owned.unoccluded());
            let own = render(&mut Avsm::new(base), &dimmed);
            let shared = render(&mut Avsm::new(Options { texels: Texels::ShadowMap, ..base }), &dimmed);
            let clear = render(&mut Avsm::new(base), frame);
            let found = differing(&shared, &truth, &scale, NODES);
            assert!(found.is_close(), "{kind:?}: {found}");
            let other = differing(&own, &truth, &scale, NODES);
            let without = differing(&clear, &truth, &scale, NODES);
            println!("{kind:?}: {:.1e}, own texels {:.1e}", found.largest(), other.largest());
            assert!(without.largest() > 1e-2, "{kind:?}: the balls dim nothing, {without}");
            assert!(!other.is_close(), "{kind:?}: other texels, the same image");
        });
    }
}
