//! What a technique declares of itself, against what its instances are.

use scatter::{
    Camera, DepthMap, Frame, Light, Medium, OptionRange, Phase, Quality, SceneFacts, ShadowMap, TECHNIQUES,
    Target,
};

fn facts() -> SceneFacts {
    let size = [1280, 960];
    let camera = Camera::perspective([0.0, 1.0, 4.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let distances = vec![5.0; 1280 * 960];
    let light = Light::directional([0.1, -1.0, 0.2], [1.0; 3]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let depth = DepthMap::new(&distances, size).unwrap();
    SceneFacts::of(&Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 9.0).unwrap())
}

#[test]
fn an_instance_with_the_default_options_can_what_its_technique_declares() {
    for technique in TECHNIQUES {
        let info = technique.info();
        let instance = technique.configure(Target::Quality(Quality::default()), &[], &facts()).unwrap();
        assert_eq!(instance.id(), info.id);
        assert_eq!(instance.capabilities(), info.capabilities, "{}", info.id);
        assert!(!info.rounding.derivation.is_empty(), "{}", info.id);
        assert!(info.rounding.overrides.iter().all(|(key, _)| info.option(key).is_ok()), "{}", info.id);
    }
}

#[test]
fn resolved_values_set_the_same_options_again() {
    let facts = facts();
    for technique in TECHNIQUES {
        let options = technique.info().options();
        for level in Quality::ALL {
            let resolved = technique.resolved(Target::Quality(level), &[], &facts).unwrap();
            assert!(resolved.iter().map(|(key, _)| *key).eq(options.iter().map(|option| option.key)));
            let overrides: Vec<_> = resolved.iter().map(|(key, value)| (*key, value.as_str())).collect();
            let again = technique.resolved(Target::Quality(level), &overrides, &facts).unwrap();
            assert_eq!(again, resolved, "{} {level}", technique.info().id);
        }
        let default = technique.resolved(Target::Quality(Quality::default()), &[], &facts).unwrap();
        for (option, (key, value)) in options.iter().zip(default) {
            assert_eq!(option.default.to_string(), value, "{} {key}", technique.info().id);
        }
    }
}

#[test]
fn every_rung_of_a_ladder_is_accepted_and_every_range_refuses_what_lies_beyond_it() {
    let facts = facts();
    for technique in TECHNIQUES {
        let target = Target::Quality(Quality::Game);
        for rung in technique.ladder() {
            let rung: Vec<_> = rung.iter().map(|(key, value)| (*key, value.as_str())).collect();
            let resolved = technique.resolved(target, &rung, &facts).unwrap();
            assert!(rung.iter().all(|(key, value)| resolved.contains(&(*key, value.to_string()))));
        }
        for option in technique.info().options() {
            let accepts = |text: &str| technique.configure(target, &[(option.key, text)], &facts).is_ok();
            assert!(!accepts("no-such-word") && !accepts("nan") && !accepts(""), "{}", option.key);
            assert!(option.range.words().into_iter().all(accepts), "{}", option.key);
            if let Some([least, most]) = option.range.numbers() {
                assert!(accepts(&least.to_string()) && accepts(&most.to_string()), "{}", option.key);
                assert!(!accepts(&(least - 1e-3).to_string()) && !accepts(&(most + 1.0).to_string()));
            }
            if let OptionRange::Whole([least, _]) | OptionRange::WordOrWhole(_, [least, _]) = option.range {
                assert!(!accepts(&format!("{least}.5")), "{}", option.key);
            }
        }
    }
}
