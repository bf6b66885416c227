//! The interpolated surface against its own exact walk: every kind of light, map, camera and medium, on random frames.

use light_volume::{LightVolume, Options, Surface};
use raymarch_ref::{HeightFieldWalk, ShadowMapWalk};
use scatter_core::{Level, ScatterImage, VolumetricShadow};
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
        for simd in [Level::new(), Level::baseline()] {
            let options = Options { surface: Surface::Interpolated, ..Options::exact() };
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
