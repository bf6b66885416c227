//! The price of features: each thing that a scene can require, switched on alone, against the plain scene.
//!
//! Driven by `TECHNIQUES`: a new technique gets its column without a line here. Prints the ratios first, medians of
//! interleaved runs, and then measures each pair with criterion. `cargo bench -p scatter --bench features -- --table`
//! prints the ratios alone. Every answer is compared with shadow-map truth once before anything is timed.

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion};
use glam::DVec3;
use scatter::{
    Camera, Medium, ModelError, Phase, Quality, ScatterImage, Scattering, SceneFacts, TECHNIQUES, Target,
    Technique, VolumetricShadow,
};
use scatter_validate::checks::{behind_lamp_glass, coloured_glass};
use scatter_validate::scenario::{Scenario, Shadow, texels_of};
use scatter_validate::stress::scenes;
use scatter_validate::{Contender, Labelled, compare};

/// Pixels of a measured image.
const SIZE: [u32; 2] = [320, 240];
/// Texels along a side of its maps.
const MAP_SIDE: u32 = 512;
/// Interleaved runs that the ratios are medians of.
const ROUNDS: u32 = 9;
/// Largest relative RMSE against shadow-map truth: the coarsest level.
const LARGEST_ERROR: f64 = 0.1;

/// What is switched on, what it is compared with, and the scene.
type Feature = (&'static str, &'static str, fn() -> Result<Scenario, ModelError>);

const FEATURES: [Feature; 21] = [
    ("sun", "sun", sun),
    ("sun, nothing casts a shadow", "sun", || Ok(Scenario { shadow: Shadow::None, ..sun()? })),
    ("sun, σt·D = 1e-6", "sun", || sun()?.in_medium(3e-8, 0.0, Phase::Isotropic)),
    ("sun, σt·D = 30", "sun", || sun()?.in_medium(1.0, 0.0, Phase::Isotropic)),
    ("sun, RGB σt", "sun", || coloured(sun()?)),
    ("sun, Henyey-Greenstein", "sun", || sun()?.in_medium(0.05, 0.0, Phase::henyey_greenstein(0.6)?)),
    ("sun, Rayleigh + Henyey-Greenstein", "sun", || air(sun()?)),
    ("sun, coloured glass", "sun", || Ok(Scenario { glass: Some(coloured_glass()), ..sun()? })),
    ("sun, height fog", "sun", || fog(sun()?)),
    ("sun, three cascades", "sun", cascades),
    ("sun, orthographic camera", "sun", orthographic),
    ("point", "sun", point),
    ("point, RGB σt", "point", || coloured(point()?)),
    ("point, Rayleigh", "point", || point()?.in_medium(0.05, 0.0, Phase::Rayleigh)),
    ("point, Henyey-Greenstein", "point", || point()?.in_medium(0.05, 0.0, Phase::henyey_greenstein(0.6)?)),
    ("point, Rayleigh + Henyey-Greenstein", "point", || air(point()?)),
    ("point, coloured glass", "point", || Ok(behind_lamp_glass(point()?))),
    ("point, height fog", "point", || fog(point()?)),
    ("spot", "point", || plain(scenes::spot()?)),
    ("spot, Henyey-Greenstein", "spot", || {
        plain(scenes::spot()?)?.in_medium(0.05, 0.0, Phase::henyey_greenstein(0.6)?)
    }),
    ("spot, coloured glass", "spot", || Ok(behind_lamp_glass(plain(scenes::spot()?)?))),
];

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    // Without --bench (cargo test --benches) one round shows that everything runs.
    let table = table(if has("--bench") { ROUNDS } else { 1 });
    print!("{table}");
    if has("--bench") && !has("--table") {
        let mut criterion = Criterion::default()
            .sample_size(10)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(1))
            .configure_from_args();
        measure(&mut criterion);
        criterion.final_summary();
    }
    if table.contains("WRONG") {
        std::process::exit(1);
    }
}

fn plain(scene: Scenario) -> Result<Scenario, ModelError> {
    let scene = scene.seen_by(scenes::camera(SIZE)?).with_map_side(MAP_SIDE);
    scene.in_medium(0.05, 0.0, Phase::Isotropic)
}

fn sun() -> Result<Scenario, ModelError> {
    plain(scenes::sun()?)
}

fn point() -> Result<Scenario, ModelError> {
    plain(scenes::point()?)
}

fn coloured(scene: Scenario) -> Result<Scenario, ModelError> {
    Ok(Scenario { medium: Medium::homogeneous([0.03, 0.05, 0.08], [0.0; 3], Phase::Isotropic)?, ..scene })
}

fn air(scene: Scenario) -> Result<Scenario, ModelError> {
    let gas = Scattering { sigma_s: [0.02; 3], phase: Phase::Rayleigh };
    let dust = Scattering { sigma_s: [0.03; 3], phase: Phase::henyey_greenstein(0.76)? };
    Ok(Scenario { medium: Medium::new(vec![gas, dust], [0.0; 3])?, ..scene })
}

/// Twelve times as dense on the ground as at the eye.
fn fog(scene: Scenario) -> Result<Scenario, ModelError> {
    scene.in_fog(DVec3::Y, 1.0, 0.65)
}

/// The plain sun's map, halved twice around its centre.
fn cascades() -> Result<Scenario, ModelError> {
    let mut scene = sun()?;
    if let Shadow::Parallel(layers) = &mut scene.shadow {
        let whole = layers[0].clone();
        let nearer = |share: f64| {
            let mut layer = whole.clone();
            layer.frame.half = whole.frame.half.map(|half| half * share);
            // The same surfaces: the texel of the whole map at the same place.
            let from = |n: u32| {
                ((0.5 + share * ((f64::from(n) + 0.5) / f64::from(MAP_SIDE) - 0.5)) * f64::from(MAP_SIDE))
                    as usize
            };
            layer.texels =
                texels_of([MAP_SIDE; 2], |i, j| whole.texels[from(j) * MAP_SIDE as usize + from(i)]);
            layer
        };
        *layers = vec![nearer(0.25), nearer(0.5), whole.clone()];
    }
    Ok(scene)
}

fn orthographic() -> Result<Scenario, ModelError> {
    let (eye, target) = (scenes::EYE.to_array(), scenes::TARGET.to_array());
    Ok(sun()?.seen_by(Camera::orthographic(eye, target, [0.0, 1.0, 0.0], 6.0, SIZE)?))
}

/// What a technique is to a scene.
enum Candidate {
    /// Ready to be timed.
    Ready(Box<dyn VolumetricShadow>),
    /// It said that it cannot.
    Unsupported,
    /// Its answer has this relative RMSE: a fast wrong answer has no price.
    Wrong(f64),
}

fn candidate(technique: &dyn Technique, scene: &Scenario) -> Candidate {
    let configured = scene.with_frame(|frame| {
        let facts = SceneFacts::of(frame);
        let renderer = technique.configure(Target::Quality(Quality::Game), &[], &facts).ok()?;
        renderer.supports(frame).ok()?;
        Some(renderer)
    });
    let Some(mut renderer) = configured.expect("the scene is a frame") else { return Candidate::Unsupported };
    let mut image = ScatterImage::new();
    render(renderer.as_mut(), scene, &mut image);
    let error = rel_rmse(&image, scene);
    // Not `error < LARGEST_ERROR`: a NaN is wrong too.
    if error <= LARGEST_ERROR { Candidate::Ready(renderer) } else { Candidate::Wrong(error) }
}

fn render(renderer: &mut dyn VolumetricShadow, scene: &Scenario, image: &mut ScatterImage) {
    let rendered = scene.with_frame(|frame| renderer.render(frame, image).map(drop));
    rendered.expect("the scene is a frame").expect("a supported frame is rendered");
}

fn rel_rmse(image: &ScatterImage, scene: &Scenario) -> f64 {
    let mut truth = ScatterImage::new();
    let facts = scene.with_frame(SceneFacts::of).expect("the scene is a frame");
    let mut reference = Contender::Reference.instance(&facts).expect("the reference has no options");
    render(reference.as_mut(), scene, &mut truth);
    let reference = Labelled { label: "truth", size: truth.size(), pixels: truth.inscattered() };
    let test = Labelled { label: "test", size: image.size(), pixels: image.inscattered() };
    compare(reference, test, None).expect("two images of one size").rel_rmse
}

/// Time of each feature over that of what it is compared with, a column a technique.
fn table(rounds: u32) -> String {
    let scenes: Vec<Scenario> = FEATURES.iter().map(|(_, _, scene)| scene().expect("a sane scene")).collect();
    let columns: Vec<Vec<Price>> =
        TECHNIQUES.iter().map(|technique| times(*technique, &scenes, rounds)).collect();
    let mut text = format!("{:<38}{:<8}", "feature", "against");
    for technique in TECHNIQUES {
        text += &format!("{:>16}", technique.info().id);
    }
    text.push('\n');
    for (row, (name, base, _)) in FEATURES.iter().enumerate() {
        let base_row = FEATURES.iter().position(|(name, ..)| name == base).expect("a feature of the list");
        text += &format!("{name:<38}{base:<8}");
        for times in &columns {
            let cell = match (times[row], times[base_row]) {
                (Price::Time(time), Price::Time(base)) => format!("{:.2}", time / base),
                (Price::Wrong(error), _) => format!("WRONG {:.0} %", 100.0 * error),
                _ => "-".into(),
            };
            text += &format!("{cell:>16}");
        }
        text.push('\n');
    }
    text
}

/// What a scene costs.
#[derive(Clone, Copy)]
enum Price {
    /// Median time \[s\].
    Time(f64),
    /// It is not supported.
    None,
    /// The answer's relative RMSE.
    Wrong(f64),
}

/// What each scene costs.
fn times(technique: &dyn Technique, scenes: &[Scenario], rounds: u32) -> Vec<Price> {
    let mut candidates: Vec<_> = scenes.iter().map(|scene| candidate(technique, scene)).collect();
    let mut runs = vec![Vec::new(); scenes.len()];
    let mut image = ScatterImage::new();
    for round in 0..rounds {
        for ((candidate, scene), runs) in candidates.iter_mut().zip(scenes).zip(&mut runs) {
            let Candidate::Ready(renderer) = candidate else { continue };
            // Frames differ, so that nothing is gained by keeping answers.
            let moved = Scenario { camera: scene.camera.shifted(f64::from(round), 0.0), ..scene.clone() };
            let start = Instant::now();
            render(renderer.as_mut(), &moved, &mut image);
            runs.push(start.elapsed().as_secs_f64());
        }
    }
    let price = |(candidate, mut runs): (Candidate, Vec<f64>)| match candidate {
        Candidate::Unsupported => Price::None,
        Candidate::Wrong(error) => Price::Wrong(error),
        Candidate::Ready(_) => {
            runs.sort_by(f64::total_cmp);
            runs.get(runs.len() / 2).map_or(Price::None, |&time| Price::Time(time))
        }
    };
    candidates.into_iter().zip(runs).map(price).collect()
}

fn measure(criterion: &mut Criterion) {
    for technique in TECHNIQUES {
        let mut group = criterion.benchmark_group(format!("features/{}", technique.info().id));
        for (name, _, scene) in FEATURES {
            let scene = scene().expect("a sane scene");
            let Candidate::Ready(mut renderer) = candidate(*technique, &scene) else { continue };
            let mut image = ScatterImage::new();
            group.bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| render(renderer.as_mut(), &scene, &mut image));
            });
        }
        group.finish();
    }
}
