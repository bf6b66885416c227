//! The same input gives the same bits, whatever the number of threads.

use raymarch_ref::{Options, RayMarch, ShadowMapWalk};
use scatter_core::VolumetricShadow;
use scatter_testing::{MapKind, OwnedFrame, Recipe};

#[test]
fn the_number_of_threads_changes_no_bit() {
    for kind in MapKind::ALL {
        let scene = OwnedFrame::random(17, Recipe { size: [67, 75], textured: true, ..Recipe::of(kind) });
        let jittered = Options { steps: 100, jitter: Some(5), ..Options::default() };
        let techniques: [fn(Options) -> Box<dyn VolumetricShadow>; 3] = [
            |_| Box::new(ShadowMapWalk::new()),
            |options| Box::new(RayMarch::new(options).unwrap()),
            |options| Box::new(RayMarch::portable(options).unwrap()),
        ];
        for make in techniques {
            let images = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| scene.render(make(jittered).as_mut()))
            });
            assert_eq!(images[0], images[1], "{kind:?}");
            assert_eq!(images[0], images[2], "{kind:?}");
        }
    }
}

#[test]
fn a_used_technique_renders_like_a_new_one() {
    let mut walk = ShadowMapWalk::new();
    let mut march = RayMarch::new(Options { steps: 50, ..Options::default() }).unwrap();
    for seed in 0..12 {
        let recipe = Recipe { map_side: 60, size: [9, 7], ..Recipe::of(MapKind::ALL[seed as usize % 6]) };
        let scene = OwnedFrame::random(seed, recipe);
        assert_eq!(scene.render(&mut walk), scene.render(&mut ShadowMapWalk::new()));
        assert_eq!(scene.render(&mut march), scene.render(&mut RayMarch::new(march.options()).unwrap()));
    }
}

#[test]
fn a_seed_is_a_picture() {
    let scene = OwnedFrame::random(2, Recipe { size: [9, 7], ..Recipe::of(MapKind::ALL[1]) });
    let image = |seed| {
        let options = Options { steps: 20, jitter: seed, ..Options::default() };
        scene.render(&mut RayMarch::new(options).unwrap())
    };
    assert_eq!(image(Some(1)), image(Some(1)));
    assert_ne!(image(Some(1)), image(Some(2)));
    assert_ne!(image(Some(0)), image(None));
}
