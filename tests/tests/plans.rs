//! What must hold for every plan, over frames of every kind and at the extremes.

use glam::DVec3;
use raymarch_ref::ShadowMapWalk;
use scatter::{
    Budget, Camera, Machine, Plan, PlanError, Quality, ScatterImage, SceneFacts, SceneSample, TECHNIQUES,
    Target, TechniqueSpeed, plan, plan_among, technique, walked_radiance,
};
use scatter_testing::{Filling, MapKind, OwnedFrame, Recipe, rel_rmse};

const KINDS: [MapKind; 7] = [
    MapKind::Unshadowed,
    MapKind::Orthographic,
    MapKind::Cascades,
    MapKind::Spot,
    MapKind::SpotCube,
    MapKind::Point,
    MapKind::Faces,
];

fn machine() -> Machine {
    Machine::built_in().with_threads(1)
}

fn planned(frame: &OwnedFrame, budget: Budget) -> Result<Plan, PlanError> {
    frame.with(|frame| plan(frame, budget, &machine()))
}

/// A picture wide enough for presets that measure; odd, and wider than high.
fn stock(kind: MapKind) -> OwnedFrame {
    OwnedFrame::stock(kind, [161, 93], 61, Filling::Random { seed: 5, far: 14.0 })
}

/// Checks what a plan says of itself, and renders its instance once.
#[track_caller]
fn check(owned: &OwnedFrame, plan: &mut Plan) {
    let id = plan.technique.info().id;
    let estimate = plan.estimate;
    assert!(estimate.time_ms.is_finite() && estimate.time_ms >= 0.0, "{id} {estimate:?}");
    let error = estimate.error;
    assert!(error.p99.is_finite() && error.p99 >= 0.0 && error.rel_rmse.is_finite() && error.rel_rmse >= 0.0);
    assert!(plan.map.error.is_finite() && plan.map.error >= 0.0, "{:?}", plan.map);
    assert!(plan.sentence.ends_with('.') && plan.sentence.contains(id), "{}", plan.sentence);
    // Every technique is either chosen or rejected with a reason.
    let mut ids: Vec<_> = plan.rejected.iter().map(|own| own.id).chain([id]).collect();
    ids.sort_unstable();
    let mut all: Vec<_> = TECHNIQUES.iter().map(|technique| technique.info().id).collect();
    all.sort_unstable();
    assert_eq!(ids, all);
    assert!(plan.rejected.iter().all(|own| !own.reason.is_empty()), "{:?}", plan.rejected);
    owned.with(|frame| {
        let mut out = ScatterImage::new();
        plan.instance.supports(frame).unwrap();
        plan.instance.render(frame, &mut out).unwrap();
        assert_eq!(out.size(), frame.size());
    });
}

#[test]
fn every_kind_of_frame_has_plans_that_render() {
    for kind in KINDS {
        let mut frame = stock(kind);
        for glass in [false, true] {
            if glass {
                frame = frame.with_glass();
            }
            for budget in [Budget::Level(Quality::Film), Budget::Promise(0.01), Budget::Time(1e3)] {
                let mut plan = planned(&frame, budget).unwrap_or_else(|error| panic!("{kind:?}: {error}"));
                assert!(plan.keeps_budget, "{kind:?} {budget}");
                check(&frame, &mut plan);
            }
        }
    }
}

#[test]
fn a_looser_budget_never_predicts_a_slower_or_a_worse_plan() {
    for kind in KINDS {
        let frame = stock(kind);
        let of = |budget| planned(&frame, budget).unwrap().estimate;
        let mut fastest = f64::INFINITY;
        for error in [1e-4, 1e-3, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.3, 0.9] {
            let estimate = of(Budget::Error(error));
            assert!(estimate.time_ms <= fastest && estimate.keeps <= error, "{kind:?} {error} {estimate:?}");
            fastest = estimate.time_ms;
        }
        let mut best = f64::INFINITY;
        for time in [1e-6, 0.1, 1.0, 3.0, 10.0, 100.0, 1e6] {
            let plan = planned(&frame, Budget::Time(time)).unwrap();
            // Errors that nobody sees are as good as each other.
            let error = plan.estimate.keeps.max(1e-3);
            if plan.keeps_budget {
                assert!(
                    plan.estimate.time_ms <= 1.25 * time && error <= best,
                    "{kind:?} {time} {:?}",
                    plan.estimate
                );
                best = error;
            } else {
                assert!(plan.sentence.contains("nothing fits"), "{}", plan.sentence);
            }
        }
        assert_eq!(best, 1e-3, "{kind:?}: with all the time there is, exact");
        let promise = |error| of(Budget::Promise(error)).time_ms;
        assert!(promise(0.5) <= promise(0.05) && promise(0.05) <= promise(0.005), "{kind:?}");
    }
}

#[test]
fn the_same_frame_has_the_same_plan_on_any_pool() {
    let frame = stock(MapKind::Cascades);
    let texts = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", planned(&frame, Budget::Level(Quality::Game)).unwrap()))
    });
    assert_eq!(texts[0], texts[1]);
}

#[test]
fn a_machine_that_is_slow_at_one_technique_takes_another() {
    let frame = stock(MapKind::Orthographic);
    let first = planned(&frame, Budget::Level(Quality::Film)).unwrap().technique.info().id;
    let speed = TechniqueSpeed { id: first.into(), slowness: 100.0, thread_gain: None };
    let machine = Machine::measured("slow at one", vec![speed]).with_threads(1);
    let other = frame.with(|frame| plan(frame, Budget::Level(Quality::Film), &machine)).unwrap();
    assert_ne!(other.technique.info().id, first);
}

#[test]
fn extremes_have_plans_or_one_clear_error() {
    let mut frames = Vec::new();
    for kind in KINDS {
        for depth in [0.0, f32::INFINITY] {
            frames.push(OwnedFrame::stock(kind, [1, 1], 1, Filling::Constant(depth)));
        }
        frames.push(OwnedFrame::stock(kind, [1, 7], 3, Filling::Checkerboard(0.0, f32::INFINITY)));
        for seed in 0..6 {
            frames.push(OwnedFrame::random(seed, Recipe { centre: DVec3::splat(1e5), ..Recipe::of(kind) }));
        }
    }
    // Endless rays, no ray at all, and no perspective.
    let mut endless = stock(MapKind::Orthographic);
    endless.max_distance = f64::INFINITY;
    endless.depth.fill(f32::INFINITY);
    frames.push(endless);
    let mut none = stock(MapKind::Point);
    none.depth.fill(0.0);
    frames.push(none);
    let mut flat = stock(MapKind::Cascades);
    flat.camera =
        Camera::orthographic([0.0, 2.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 4.0, flat.camera.size()).unwrap();
    frames.push(flat);
    let mut plans = 0;
    for frame in &frames {
        for budget in [Budget::Level(Quality::Game), Budget::Promise(0.02), Budget::Time(1e-9)] {
            let mut plan = planned(frame, budget).unwrap_or_else(|error| panic!("{budget}: {error}"));
            check(frame, &mut plan);
            plans += 1;
        }
    }
    assert_eq!(plans, 3 * frames.len());
}

#[test]
fn what_is_no_budget_and_what_nobody_renders_are_errors_that_say_so() {
    let frame = stock(MapKind::Orthographic);
    for (budget, word) in [
        (Budget::Error(0.0), "error 0"),
        (Budget::Error(f64::NAN), "error NaN"),
        (Budget::Promise(1.0), "promise 1"),
        (Budget::Time(-3.0), "time -3"),
        (Budget::Time(f64::INFINITY), "time inf"),
    ] {
        let error = planned(&frame, budget).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("give"), "{error}");
    }
    let none = frame.with(|frame| plan_among(&[], frame, Budget::Level(Quality::Game), &machine()));
    assert!(none.unwrap_err().to_string().contains("build with more techniques"));
    // One technique alone that does not take the frame: its own reason.
    let prefix = TECHNIQUES.iter().copied().filter(|own| own.info().id == "light-volume").collect::<Vec<_>>();
    let glass = stock(MapKind::Orthographic).with_glass();
    let refused = glass.with(|frame| plan_among(&prefix, frame, Budget::Level(Quality::Game), &machine()));
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("light-volume") && refused.contains("texture"), "{refused}");
}

#[test]
fn sampled_rays_are_walked_exactly() {
    let mut largest = 0.0f64;
    for kind in KINDS {
        for seed in 0..40 {
            // A picture of one pixel: its sample is that pixel's ray.
            let owned = OwnedFrame::random(seed, Recipe { size: [1, 1], ..Recipe::of(kind) });
            owned.with(|frame| {
                let sample = SceneSample::of(frame);
                assert_eq!(sample.rays.len(), 1);
                let exact = walked_radiance(frame, 0, 0).element_sum() / 3.0;
                let ray = &sample.rays[0];
                assert!(
                    ray.transitions <= 2.0 * ray.lit_runs
                        && ray.nodes >= f64::from(u8::from(ray.texels > 0.0))
                );
                largest = largest.max((ray.radiance - exact).abs() / ray.unoccluded.max(f64::MIN_POSITIVE));
            });
        }
    }
    // Both add the same stretches in f64, one of them by subtracting the dark ones from the whole.
    println!("largest difference {largest:.1e} of the unoccluded light, 1e-11 allowed");
    assert!(largest < 1e-11, "{largest}");
}

#[test]
fn a_march_is_off_by_about_what_the_sample_says() {
    let owned = stock(MapKind::Orthographic);
    let exact = owned.render(&mut ShadowMapWalk::new());
    for steps in [16, 64, 256] {
        let march = technique("raymarch").expect("the marcher");
        let found = owned.with(|frame| {
            let facts = SceneFacts::of(frame);
            let text = steps.to_string();
            let target = Target::Quality(Quality::Game);
            march.configure(target, &[("steps", text.as_str())], &facts).expect("options")
        });
        let mut found = found;
        let measured = rel_rmse(&owned.render(found.as_mut()), &exact);
        let [_, predicted] = owned.with(|frame| SceneSample::of(frame).march_error(f64::from(steps)));
        println!("{steps} steps: measured {measured:.2e}, predicted {predicted:.2e}");
        // Some hundred rays of 15,000, and edges that are not where chance puts them: a factor of two.
        assert!(measured < 2.0 * predicted && predicted < 2.0 * measured, "{steps}: {measured} {predicted}");
    }
}
