//! The stepped surface against the exact walk through the map: every kind of light, map, camera and medium, on random frames,
//! with the sum of signs along every ray.

use light_volume::{LightVolume, Options, Tessellation};
use raymarch_ref::ShadowMapWalk;
use scatter_core::{HeightFalloff, Level, Light, ScatterImage, VolumetricShadow, walked_radiance};
use scatter_testing::{Filling, MapKind, OwnedFrame, Random, Recipe, differing, values};

/// Largest difference, as a share of a pixel's unoccluded radiance (a spot's: without its cone).
///
/// A lit interval's ends are rounded to f32: 2⁻²³ of the ray each, and where the medium is thick, a ray's radiance comes
/// from 1/(σD) of its length; random media have σD ≤ 14. An interval's integral is a sun's to 1e-5 or a lamp's to 1.2e-5, and
/// an unoccluded lamp's the same. Few intervals a ray: maps of 13 texels.
const MOST: f64 = 4e-5;

#[derive(Default, Debug)]
struct Seen {
    worst: f64,
    crossings: u64,
    violations: u64,
    walked: u64,
    rays: u64,
}

impl Seen {
    #[track_caller]
    fn hold(&mut self, frame: &OwnedFrame, what: &str) {
        let truth = values(&frame.render(&mut ShadowMapWalk::new()));
        let scale = values(&frame.unoccluded().without_cone().render(&mut ShadowMapWalk::new()));
        self.compare(frame, (&truth, &scale), what);
    }

    #[track_caller]
    fn compare(&mut self, frame: &OwnedFrame, (truth, scale): (&[[f64; 3]], &[[f64; 3]]), what: &str) {
        for simd in [Level::new(), Level::baseline()] {
            for tessellation in [Tessellation::Adaptive, Tessellation::Static] {
                let options = Options { tessellation, ..Options::exact() };
                let mut image = ScatterImage::new();
                let stats = frame
                    .with(|frame| LightVolume::with_simd(options, simd).render(frame, &mut image).unwrap());
                let found = differing(&image, truth, scale, MOST);
                assert!(found.is_close(), "{what}, {simd:?}, {tessellation:?}: {found}");
                self.worst = self.worst.max(found.largest());
                let count = |name| stats.counts.get(name).unwrap();
                self.crossings += count("crossings");
                self.violations += count("sign violations");
                self.walked += count("pixels in f64");
                self.rays += count("rays");
            }
        }
    }
}

impl Drop for Seen {
    fn drop(&mut self) {
        println!("worst of {MOST:.1e}: {self:?}");
        if !std::thread::panicking() {
            assert_eq!(self.violations, 0, "signs along a ray sum to 0 or 1 and alternate");
            assert!(self.crossings > 100, "faces are crossed");
            // Rays that numbers cannot hold pass a lamp; none does by chance.
            assert!(self.walked * 500 <= self.rays, "{self:?}");
        }
    }
}

#[test]
fn random_frames_are_what_the_exact_walk_says() {
    let mut seen = Seen::default();
    for kind in MapKind::ALL {
        for seed in 0..80 {
            let recipe = Recipe { size: [9, 5], ..Recipe::of(kind) };
            seen.hold(&OwnedFrame::random(seed, recipe), &format!("{kind:?} {seed}"));
        }
    }
}

#[test]
fn maps_of_many_texels_are_what_the_exact_walk_says() {
    let mut seen = Seen::default();
    for kind in MapKind::ALL {
        for (side, size) in [(257, [33, 17]), (300, [16, 8])] {
            let mut frame = OwnedFrame::stock(kind, size, side, Filling::Random { seed: 3, far: 9.0 });
            seen.hold(&frame, &format!("{kind:?} {side}"));
            frame.fill(Filling::Constant(4.0));
            seen.hold(&frame, &format!("{kind:?} {side}, all alike"));
        }
    }
}

/// In height fog against core's walk of one pixel: a sun's lit interval is a difference of transmittances.
#[test]
fn suns_in_height_fog_are_what_the_exact_walk_says() {
    let mut seen = Seen::default();
    for kind in [MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades] {
        for seed in 0..40 {
            let recipe = Recipe { size: [9, 5], ..Recipe::of(kind) };
            let mut frame = OwnedFrame::random(seed, recipe);
            let mut random = Random(seed);
            let up = random.direction().into();
            let falloff = HeightFalloff::new(up, random.range(-1.0, 1.0), random.range(0.2, 5.0)).unwrap();
            frame.medium = frame.medium.clone().with_height_falloff(falloff);
            let walked = |frame: &OwnedFrame| -> Vec<[f64; 3]> {
                frame.with(|frame| {
                    let pixels = (0..5).flat_map(|y| (0..9).map(move |x| [x, y]));
                    pixels.map(|[x, y]| walked_radiance(frame, x, y).to_array()).collect()
                })
            };
            seen.compare(
                &frame,
                (&walked(&frame), &walked(&frame.unoccluded())),
                &format!("{kind:?} {seed}"),
            );
        }
    }
}

/// The eye inside the light, in the shadow, on a cap, on a wall, on both, on the map's border and outside of it: numbers tie there.
/// No ray of an image of even size runs within a plane of the mesh.
#[test]
fn the_eye_may_be_anywhere_even_on_the_border_of_the_shadow() {
    use scatter_core::{Camera, MapProjection};
    let mut seen = Seen::default();
    let mut stock = OwnedFrame::stock(MapKind::Orthographic, [16, 10], 8, Filling::Constant(5.0));
    stock.light = Light::directional([0.0, -1.0, 0.0], [2.0; 3]).unwrap();
    // Columns run along x, rows along z, a texel a unit each, from −4 to 4; depth 0 at y = 8.
    let (origin, down, up) = ([0.0, 8.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]);
    stock.projections = vec![MapProjection::orthographic(origin, down, up, [4.0; 2], [8; 2]).unwrap()];
    stock.texels = vec![(0..64).map(|n| if (n % 8 + n / 8) % 3 == 0 { 5.0 } else { 7.0 }).collect()];
    let eyes = [
        ("in the light", [0.3, 4.0, 0.4]),
        ("in the shadow", [0.3, 0.5, 0.4]),
        ("on a cap", [0.5, 3.0, 0.5]),
        ("on a wall", [1.0, 2.0, 0.5]),
        ("on an edge along the light", [1.0, 2.0, 1.0]),
        ("on an edge of a cap", [1.0, 3.0, 0.5]),
        ("on a corner", [1.0, 3.0, 1.0]),
        ("on the map's border", [-4.0, 2.0, 0.5]),
        ("on the map's corner", [4.0, 3.0, 4.0]),
        ("outside of the map", [-6.0, 1.0, 0.3]),
        ("above the light's plane", [0.3, 9.0, 0.4]),
    ];
    for (what, eye) in eyes {
        for way in [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [-0.6, -0.4, 0.7]] {
            let target = [0, 1, 2].map(|axis| eye[axis] + way[axis]);
            let camera_up = if f64::abs(way[1]) > 0.5 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
            let frame = OwnedFrame {
                camera: Camera::perspective(eye, target, camera_up, 80.0, [16, 10]).unwrap(),
                ..stock.clone()
            };
            seen.hold(&frame, &format!("{what}, looking along {way:?}"));
        }
    }
}
