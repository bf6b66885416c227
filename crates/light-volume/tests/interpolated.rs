//! The interpolated surface against its own exact walk: every kind of light, map, camera and medium, on random frames.

use light_volume::raster::surface_walk::lit_on_surface;
use light_volume::raster::tessellation_of;
use light_volume::volume::HeightField;
use light_volume::{LightVolume, Options, Surface, Tessellation};
use raymarch_ref::{HeightFieldWalk, ShadowMapWalk};
use scatter_core::{Frame, Level, RayLight, ScatterImage, VolumetricShadow};
use scatter_testing::{Filling, MapKind, OwnedFrame, Recipe, differing, values};

/// Largest difference, as a share of a pixel's unoccluded radiance: as of the stepped surface.
const MOST: f64 = 4e-5;

#[derive(Default)]
struct Seen {
    worst: f64,
    violations: u64,
    walked: u64,
    rays: u64,
    /// Values that differ from those of the stepped surface: the two are told apart.
    unlike_stepped: usize,
}

impl Seen {
    #[track_caller]
    fn hold(&mut self, frame: &OwnedFrame, what: &str) {
        let truth = values(&frame.render(&mut HeightFieldWalk));
        let stepped = values(&frame.render(&mut ShadowMapWalk::new()));
        let scale = values(&frame.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
        for (simd, tessellation) in [
            (Level::new(), Tessellation::Adaptive),
            (Level::baseline(), Tessellation::Adaptive),
            (Level::new(), Tessellation::Static),
        ] {
            let options = Options { surface: Surface::Interpolated, tessellation, ..Options::exact() };
            let mut image = ScatterImage::new();
            let stats =
                frame.with(|frame| LightVolume::with_simd(options, simd).render(frame, &mut image).unwrap());
            let found = differing(&image, &truth, &scale, MOST);
            assert!(found.is_close(), "{what}, {simd:?}: {found}");
            self.worst = self.worst.max(found.largest());
            let count = |name| stats.counts.get(name).unwrap();
            self.violations += count("sign violations");
            self.walked += count("pixels in f64");
            self.rays += count("rays");
        }
        let differs = |(a, b): (&[f64; 3], &[f64; 3])| (a[0] - b[0]).abs() > 1e-3 * a[0].abs();
        self.unlike_stepped += truth.iter().zip(&stepped).filter(|pair| differs(*pair)).count();
    }
}

impl Drop for Seen {
    fn drop(&mut self) {
        let Self { worst, violations, walked, rays, unlike_stepped } = self;
        println!(
            "worst {worst:.1e} of {MOST:.1e}; {violations} violations, {walked} of {rays} walked, {unlike_stepped}"
        );
        if !std::thread::panicking() {
            assert_eq!(*violations, 0, "signs along a ray sum to 0 or 1 and alternate");
            assert!(*unlike_stepped > 50, "{unlike_stepped}");
        }
    }
}

#[test]
fn random_frames_are_what_the_exact_walk_of_the_surface_says() {
    let mut seen = Seen::default();
    for kind in MapKind::ALL {
        for seed in 0..60 {
            let recipe = Recipe { size: [9, 5], ..Recipe::of(kind) };
            seen.hold(&OwnedFrame::random(seed, recipe), &format!("{kind:?} {seed}"));
        }
    }
}

#[test]
fn maps_of_many_texels_are_what_the_exact_walk_of_the_surface_says() {
    let mut seen = Seen::default();
    for kind in MapKind::ALL {
        let mut frame = OwnedFrame::stock(kind, [33, 17], 133, Filling::Random { seed: 3, far: 9.0 });
        seen.hold(&frame, &format!("{kind:?}"));
        frame.fill(Filling::Constant(4.0));
        seen.hold(&frame, &format!("{kind:?}, all alike"));
    }
}

/// Smooth hills with posts: quads of all levels beside each other.
fn hills(kind: MapKind, size: [u32; 2], side: u32) -> OwnedFrame {
    let mut frame = OwnedFrame::stock(kind, size, side, Filling::Constant(4.0));
    for (layer, texels) in frame.texels.iter_mut().enumerate() {
        for (n, texel) in texels.iter_mut().enumerate() {
            let [i, j] = [n as u32 % side, n as u32 / side].map(|n| f64::from(n) / f64::from(side));
            let hill = 5.0 + (7.0 * i + layer as f64).sin() + (5.0 * j).cos();
            let is_post = (n * 2_654_435_761) % 1000 < 6;
            *texel = if is_post {
                2.5
            } else if n % 2011 == 0 {
                f32::INFINITY
            } else {
                hill as f32
            };
        }
    }
    frame
}

/// The pixel at `(x, y)`, by the walk in f64.
fn walked(frame: &Frame<'_>, fields: &[HeightField], [x, y]: [u32; 2]) -> [f64; 3] {
    let ray = frame.camera().pixel_ray(x, y);
    let light = RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &ray);
    let mut sum = glam::DVec3::ZERO;
    lit_on_surface(frame, fields, &ray, frame.ray_end(x, y), |from, to| sum += light.interval(from, to));
    sum.to_array()
}

/// The walk in f64 of the base grid is the truth's, and of adaptive meshes what their image pass renders.
#[test]
fn the_walk_in_f64_and_the_image_pass_see_one_surface() {
    let (mut worst, mut gained) = ([0.0f64; 2], 0);
    for kind in MapKind::ALL.into_iter().filter(|kind| *kind != MapKind::Unshadowed) {
        let owned = hills(kind, [29, 17], 90);
        let scale = values(&owned.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
        let truth = values(&owned.render(&mut HeightFieldWalk));
        let mut counts = Vec::new();
        for (tessellation, threshold) in [
            (Tessellation::Static, 0.0),
            (Tessellation::Adaptive, 0.0),
            (Tessellation::Adaptive, 0.001),
            (Tessellation::Adaptive, 0.02),
        ] {
            let options =
                Options { surface: Surface::Interpolated, tessellation, threshold, ..Options::exact() };
            let (walked, image, stats) = owned.with(|frame| {
                let tessellation = tessellation_of(frame, &options);
                let fields: Vec<HeightField> = frame
                    .shadow()
                    .layers()
                    .map(|layer| {
                        let mut field = HeightField::default();
                        field.build(&layer, tessellation);
                        field
                    })
                    .collect();
                let pixels = (0..17).flat_map(|y| (0..29).map(move |x| [x, y]));
                let walked: Vec<[f64; 3]> = pixels.map(|place| walked(frame, &fields, place)).collect();
                let mut image = ScatterImage::new();
                let stats = LightVolume::new(options).render(frame, &mut image).unwrap();
                (walked, image, stats)
            });
            let found = differing(&image, &walked, &scale, MOST);
            assert!(found.is_close(), "{kind:?} {tessellation:?} {threshold}: {found}");
            worst[0] = worst[0].max(found.largest());
            assert_eq!(stats.counts.get("sign violations"), Some(0), "{kind:?} {threshold}");
            counts.push(stats.counts.get("triangles").unwrap());
            if threshold == 0.0 {
                for ((walked, truth), scale) in walked.iter().zip(&truth).zip(&scale) {
                    let off = (walked[0] - truth[0]).abs() / scale[0].max(1e-30);
                    worst[1] = worst[1].max(off);
                    // Codes of f32, 6e-8 of a depth, and as much of the way to a crossing over the cosine: a hundredfold at most here.
                    assert!(off <= 1e-5, "{kind:?}: {walked:?} {truth:?}");
                }
            }
        }
        assert!(counts.is_sorted_by(|a, b| a >= b), "{kind:?}: never more triangles: {counts:?}");
        gained += usize::from(counts[3] * 2 < counts[0]);
    }
    println!("image pass against walk {:.1e}, walk against truth {:.1e}", worst[0], worst[1]);
    assert!(gained >= 4, "adaptive meshes have fewer triangles: {gained} kinds");
}
