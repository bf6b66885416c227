//! The price of features: each thing that a scene can require, switched on alone, against the plain scene.
//!
//! Driven by `TECHNIQUES`: a new technique gets its column without a line here. Prints the ratios first, medians of
//! interleaved runs, and then measures each scene with criterion. `cargo bench -p scatter --bench features -- --table`
//! prints the ratios alone. Every answer is compared with shadow-map truth once before anything is timed. Features "of no
//! effect" are there in name alone and must cost nothing.

use std::io::Write;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion};
use glam::DVec3;
use scatter::{
    Camera, Medium, ModelError, Phase, Quality, ScatterImage, Scattering, SceneFacts, TECHNIQUES, Target,
    Technique, TranslucentSegment, VolumetricShadow,
};
use scatter_validate::checks::{behind_lamp_glass, coloured_glass};
use scatter_validate::scenario::{MapFrame, Scenario, Shadow, Smoke, texels_of};
use scatter_validate::stress::scenes;
use scatter_validate::{Contender, Labelled, compare};

/// Pixels of a measured image.
const SIZE: [u32; 2] = [320, 240];
/// Texels along a side of its maps.
const MAP_SIDE: u32 = 512;
/// Interleaved pairs of runs that a ratio is the median of.
const ROUNDS: u32 = 25;
/// Pairs of runs after which [`PATIENCE`] counts.
const FEWEST_ROUNDS: usize = 5;
/// How long the pairs of one ratio may take together.
const PATIENCE: Duration = Duration::from_millis(300);
/// Largest relative RMSE against shadow-map truth: the coarsest level.
const LARGEST_ERROR: f64 = 0.1;

/// What is switched on, what it is compared with, and the scene.
type Feature = (&'static str, &'static str, fn() -> Result<Scenario, ModelError>);

const FEATURES: [Feature; 25] = [
    ("sun", "sun", sun),
    ("sun, g = 0: of no effect", "sun", || sun()?.in_medium(0.05, 0.0, Phase::henyey_greenstein(0.0)?)),
    ("sun, σs = 0 beside: of no effect", "sun", || idle(sun()?)),
    ("sun, nothing casts a shadow", "sun", || Ok(Scenario { shadow: Shadow::None, ..sun()? })),
    ("sun, σt·D = 1e-6", "sun", || sun()?.in_medium(3e-8, 0.0, Phase::Isotropic)),
    ("sun, σt·D = 30", "sun", || sun()?.in_medium(1.0, 0.0, Phase::Isotropic)),
    ("sun, RGB σt", "sun", || coloured(sun()?)),
    ("sun, Henyey-Greenstein", "sun", || sun()?.in_medium(0.05, 0.0, Phase::henyey_greenstein(0.6)?)),
    ("sun, Rayleigh + Henyey-Greenstein", "sun", || air(sun()?)),
    ("sun, coloured glass", "sun", || Ok(Scenario { glass: Some(coloured_glass()), ..sun()? })),
    ("sun, height fog", "sun", || fog(sun()?)),
    ("sun, smoke and hair", "sun", smoke),
    ("sun, three cascades", "sun", cascades),
    ("sun, orthographic camera", "sun", orthographic),
    ("point", "sun", point),
    ("point, σs = 0 beside: of no effect", "point", || idle(point()?)),
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
    let all_right = print_table(if has("--bench") { ROUNDS } else { 1 });
    if has("--bench") && !has("--table") {
        let mut criterion = Criterion::default()
            .sample_size(10)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(1))
            .configure_from_args();
        measure(&mut criterion);
        criterion.final_summary();
    }
    if !all_right {
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

/// A second component that scatters nothing.
fn idle(scene: Scenario) -> Result<Scenario, ModelError> {
    let fog = Scattering { sigma_s: [0.05; 3], phase: Phase::Isotropic };
    let nothing = Scattering { sigma_s: [0.0; 3], phase: Phase::henyey_greenstein(0.8)? };
    Ok(Scenario { medium: Medium::new(vec![fog, nothing], [0.0; 3])?, ..scene })
}

/// A cloud and a strand of hair in a third of the texels of a map of their own.
fn smoke() -> Result<Scenario, ModelError> {
    let scene = sun()?;
    let Shadow::Parallel(layers) = &scene.shadow else { return Ok(scene) };
    let size = [32, 24];
    let frame = MapFrame { size, ..layers[0].frame };
    let texels = texels_of(size, |i, j| {
        let height = 14.0 + 0.3 * ((5 * i + 3 * j) % 11) as f32;
        let cloud = TranslucentSegment { entry: height, exit: height + 4.0, optical_depth: 0.6 };
        if (i + j) % 3 == 0 { vec![cloud, TranslucentSegment::hair(height + 2.0, 0.3)] } else { Vec::new() }
    });
    Ok(Scenario { smoke: Some(Smoke { frame, texels }), ..scene })
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

fn candidate(technique: &dyn Technique, scene: &Scenario, truth: &ScatterImage) -> Candidate {
    let configured = scene.with_frame(|frame| {
        let facts = SceneFacts::of(frame);
        let renderer = technique.configure(Target::Quality(Quality::Game), &[], &facts).ok()?;
        renderer.supports(frame).ok()?;
        Some(renderer)
    });
    let Some(mut renderer) = configured.expect("the scene is a frame") else { return Candidate::Unsupported };
    let mut image = ScatterImage::new();
    render(renderer.as_mut(), scene, &mut image);
    let error = rel_rmse(&image, truth);
    // Not `error < LARGEST_ERROR`: a NaN is wrong too.
    if error <= LARGEST_ERROR { Candidate::Ready(renderer) } else { Candidate::Wrong(error) }
}

fn render(renderer: &mut dyn VolumetricShadow, scene: &Scenario, image: &mut ScatterImage) {
    let rendered = scene.with_frame(|frame| renderer.render(frame, image).map(drop));
    rendered.expect("the scene is a frame").expect("a supported frame is rendered");
}

fn rel_rmse(image: &ScatterImage, truth: &ScatterImage) -> f64 {
    let labelled =
        |label, image| Labelled { label, size: ScatterImage::size(image), pixels: image.inscattered() };
    compare(labelled("truth", truth), labelled("test", image), None).expect("two images of one size").rel_rmse
}

/// Shadow-map truth of a scene.
fn truth_of(scene: &Scenario) -> ScatterImage {
    let mut truth = ScatterImage::new();
    let facts = scene.with_frame(SceneFacts::of).expect("the scene is a frame");
    let mut reference = Contender::Reference.instance(&facts).expect("the reference has no options");
    render(reference.as_mut(), scene, &mut truth);
    truth
}

/// Prints the time of each feature over that of what it is compared with, a column a technique, a row as soon as it is
/// measured. Says whether all answers were right.
fn print_table(rounds: u32) -> bool {
    print!("{:<38}{:<8}", "feature", "against");
    for technique in TECHNIQUES {
        print!("{:>16}", technique.info().id);
    }
    println!();
    let scene_of = |wanted: &str| {
        let (.., scene) = FEATURES.iter().find(|(name, ..)| *name == wanted).expect("a feature of the list");
        scene().expect("a sane scene")
    };
    let mut all_right = true;
    for (name, base, _) in FEATURES {
        let pair = [name, base].map(|name| {
            let scene = scene_of(name);
            let truth = truth_of(&scene);
            (scene, truth)
        });
        print!("{name:<38}{base:<8}");
        for technique in TECHNIQUES {
            let cell = match price(*technique, &pair, rounds) {
                Price::Ratio(ratio) => format!("{ratio:.2}"),
                Price::Unsupported => "-".into(),
                Price::Wrong(error) => {
                    all_right = false;
                    format!("WRONG {:.0} %", 100.0 * error)
                }
            };
            print!("{cell:>16}");
            // Slow techniques show that something goes on.
            std::io::stdout().flush().expect("stdout takes text");
        }
        println!();
    }
    all_right
}

/// What a feature costs.
enum Price {
    /// Its time over the plain scene's.
    Ratio(f64),
    /// It is not supported.
    Unsupported,
    /// An answer's relative RMSE.
    Wrong(f64),
}

/// The price of the first scene's feature against the second scene, which has none: the median of the ratios of runs
/// beside each other, so that a machine that slows down meanwhile slows both.
fn price(technique: &dyn Technique, pair: &[(Scenario, ScatterImage); 2], rounds: u32) -> Price {
    let mut ready = Vec::new();
    for (scene, truth) in pair {
        match candidate(technique, scene, truth) {
            Candidate::Ready(renderer) => ready.push(renderer),
            Candidate::Unsupported => return Price::Unsupported,
            Candidate::Wrong(error) => return Price::Wrong(error),
        }
    }
    let mut image = ScatterImage::new();
    let mut ratios = Vec::new();
    let start = Instant::now();
    for round in 0..rounds {
        if ratios.len() >= FEWEST_ROUNDS && start.elapsed() > PATIENCE {
            break;
        }
        let mut times = [0.0; 2];
        // Who goes first changes, or caches would favour the second.
        for index in [round as usize % 2, 1 - round as usize % 2] {
            // Frames differ, so that nothing is gained by keeping answers: by so little that the depth map stays right.
            let (scene, _) = &pair[index];
            let moved =
                Scenario { camera: scene.camera.shifted(1e-3 * f64::from(round), 0.0), ..scene.clone() };
            let start = Instant::now();
            render(ready[index].as_mut(), &moved, &mut image);
            times[index] = start.elapsed().as_secs_f64();
        }
        ratios.push(times[0] / times[1]);
    }
    ratios.sort_by(f64::total_cmp);
    Price::Ratio(ratios[ratios.len() / 2])
}

fn measure(criterion: &mut Criterion) {
    for technique in TECHNIQUES {
        let mut group = criterion.benchmark_group(format!("features/{}", technique.info().id));
        for (name, _, scene) in FEATURES {
            let scene = scene().expect("a sane scene");
            let truth = truth_of(&scene);
            let Candidate::Ready(mut renderer) = candidate(*technique, &scene, &truth) else { continue };
            let mut image = ScatterImage::new();
            group.bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| render(renderer.as_mut(), &scene, &mut image));
            });
        }
        group.finish();
    }
}
