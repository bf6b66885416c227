//! The marcher as tools see it: options from text, from levels, from promises.

use raymarch_ref::{Options, RayMarch, ShadowMapWalk, TECHNIQUE};
use scatter_core::{Quality, SceneFacts, Target, Technique, VolumetricShadow};
use scatter_testing::{MapKind, OwnedFrame, Recipe};

fn facts(scene: &OwnedFrame) -> SceneFacts {
    scene.with(SceneFacts::of)
}

#[test]
fn options_are_read_from_text_over_the_choice_of_the_level() {
    let mut options = Options::for_quality(Quality::Film);
    for (key, value) in [("steps", "77"), ("jitter", "9"), ("distribution", "uniform")] {
        options.set(key, value).unwrap();
    }
    assert_eq!(options.steps, 77);
    assert_eq!(options.jitter, Some(9));
    assert_eq!(options.distribution, raymarch_ref::Distribution::Uniform);
    options.set("jitter", "off").unwrap();
    assert_eq!(options.jitter, None);
}

#[test]
fn bad_options_are_errors_that_name_key_value_and_range() {
    let scene = OwnedFrame::random(1, Recipe::of(MapKind::Orthographic));
    let facts = facts(&scene);
    for (key, value, word) in [
        ("steps", "0", "1 to 65536"),
        ("steps", "65537", "1 to 65536"),
        ("steps", "many", "many"),
        ("jitter", "-1", "0 to 4294967295"),
        ("distribution", "log", "equi-angular"),
        ("stepz", "3", "steps, jitter, distribution"),
    ] {
        let error = TECHNIQUE
            .configure(Target::Quality(Quality::Game), &[(key, value)], &facts)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(error.contains(word) && error.contains(key), "{key}={value}: {error}");
    }
    assert!(RayMarch::new(Options { steps: 0, ..Options::default() }).is_err());
}

#[test]
fn every_rung_of_the_ladder_is_a_configuration() {
    let scene = OwnedFrame::random(1, Recipe::of(MapKind::Orthographic));
    let facts = facts(&scene);
    let ladder = TECHNIQUE.ladder();
    assert_eq!(ladder[0], [("steps", "8".to_string())]);
    assert_eq!(ladder[ladder.len() - 1], [("steps", "16384".to_string())]);
    for rung in ladder {
        let overrides: Vec<_> = rung.iter().map(|(key, value)| (*key, value.as_str())).collect();
        assert!(TECHNIQUE.configure(Target::Quality(Quality::Game), &overrides, &facts).is_ok());
    }
}

#[test]
fn a_promise_is_kept_or_refused() {
    /// A small map, so that 65,536 steps can promise anything at all.
    const SIDE: u32 = 5;
    for seed in 0..40 {
        let recipe = Recipe { map_side: SIDE, size: [7, 5], ..Recipe::of(MapKind::Orthographic) };
        let scene = OwnedFrame::random(seed, recipe);
        let clear = scene.unoccluded();
        let facts = facts(&scene);
        for error in [0.1, 0.03, 0.01] {
            let options = Options::for_error(error, &facts).unwrap();
            let image = scene.render(&mut RayMarch::new(options).unwrap());
            let truth = scene.render(&mut ShadowMapWalk::new());
            let whole = clear.render(&mut ShadowMapWalk::new());
            let values = image.inscattered().iter().flatten().zip(truth.inscattered().iter().flatten());
            for ((value, truth), whole) in values.zip(whole.inscattered().iter().flatten()) {
                let off = f64::from((value - truth).abs());
                assert!(
                    off <= error * f64::from(*whole) + 1e-30,
                    "seed {seed} {error}: {value} {truth} {whole}"
                );
            }
        }
    }
    let large = OwnedFrame::random(1, Recipe { map_side: 2000, ..Recipe::of(MapKind::Orthographic) });
    assert!(Options::for_error(0.001, &facts(&large)).is_err());
    let lamp = OwnedFrame::random(1, Recipe::of(MapKind::Point));
    assert!(Options::for_error(0.1, &facts(&lamp)).is_err());
}

#[test]
fn the_statistics_say_what_was_done() {
    let scene = OwnedFrame::random(4, Recipe { size: [9, 7], ..Recipe::of(MapKind::Orthographic) });
    scene.with(|frame| {
        let mut image = scatter_core::ScatterImage::new();
        let mut march = RayMarch::new(Options { steps: 50, ..Options::default() }).unwrap();
        let stats = march.render(frame, &mut image).unwrap();
        assert_eq!(stats.counts.get("shadow-map fetches"), Some(9 * 7 * 50));
        assert!(stats.stages.get("march").is_some());
        assert!(stats.modelled.get("shadow-map").is_some() && stats.modelled.get("light-texture").is_none());
        let stats = ShadowMapWalk::new().render(frame, &mut image).unwrap();
        assert_eq!(stats.counts.get("rays"), Some(63));
        assert!(stats.counts.get("shadow-map fetches").unwrap() > 0);
        assert!(stats.stages.get("walk").is_some() && stats.memory_bytes > 0);
    });
}
