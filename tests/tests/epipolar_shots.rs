//! Epipolar integration on the built-in shots, and on the shared ones where there are any, as small pictures: its
//! presets and its error targets keep what they promise against the exact walk through the same map.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use glam::DVec2;
use raymarch_ref::ShadowMapWalk;
use scatter::epipolar;
use scatter::epipolar::geometry::Epipole;
use scatter_core::{
    Frame, Light, Quality, ScatterImage, ShadowMap, Target, VolumetricShadow, walked_radiance,
};
use scatter_scene::{MapResolution, builtin_shots, export, load_shot};
use scatter_validate::measure::{Measurement, Outcome, Renderer, measure};
use scatter_validate::staged_shot::resized;
use scatter_validate::truths::shadow_map_truth;
use scatter_validate::{Figures, Labelled, StagedShot, compare};

/// A picture of odd sides, with texels about as wide as its pixels.
const SIZE: [u32; 2] = [161, 119];
const MAP: u32 = 256;

/// Largest relative RMSE of a preset on shots that are lit: 1 % by default and at film.
///
/// p99 is printed, not judged: presets are made for pictures of many more pixels, whose shadows' edges are a smaller
/// part of them. Larger pictures are judged by it below.
fn most(level: Quality) -> f64 {
    match level {
        Quality::Preview => 0.1,
        Quality::Game | Quality::Film => 0.01,
    }
}

/// The same for shots whose lit share may be a few hundredths, such as a church with one window: errors are relative to
/// its mean, and a picture this small has few pixels in a shaft. The finest preset alone is judged, by its own level.
fn most_in_the_dark(level: Quality) -> f64 {
    if level == Quality::Film { level.error() } else { f64::INFINITY }
}

/// Errors that are asked for, as shares of each pixel's unoccluded radiance.
const TARGETS: [f64; 3] = [0.05, 0.01, 0.002];

/// Share of pixels whose error may be larger than what was asked for; chosen before anything was measured.
///
/// Promised is that no pixel's error is larger than e of its unoccluded radiance, except where a shadow is thinner
/// than half a pixel and lies between two slices that agree. Slices are half a pixel apart, texels of [`MAP`] about as
/// wide as a pixel: what is thinner is the corner of a texel that reaches into a gap without reaching across, and what
/// it takes from a ray has to be more than e. A pixel at p of its gap is weighed by 2p(1 − p), what an edge anywhere
/// in the gap changes on average: a step Δ between slices may be left where 2p(1 − p)Δ ≤ e/2, and is wrong by more
/// than e only if it lies within p of the nearer slice, at odds of (e/4Δ)² at the most. One pixel in a thousand allows
/// for both; in other words p99.9 keeps the promise. How many of those are of the first kind is printed.
const EXCEPTED: f64 = 1e-3;

/// Closed forms in f32 beside the same in f64, relative: core promises 2.3e-5 for a lamp, and less for a sun.
const ROUNDING: f64 = 2.3e-5;

/// The image of a preset or of an error target, as far as it is judged.
struct Judged {
    line: String,
    kept: bool,
}

/// What is found on one shot.
#[derive(Default)]
struct Found {
    presets: Vec<Judged>,
    targets: Vec<Judged>,
    /// Presets with four cascades in place of a sun's one map.
    cascaded: Vec<Judged>,
}

fn rendered(staged: &StagedShot, target: Target) -> Measurement {
    let mut renderer = Renderer::configured(&epipolar::TECHNIQUE, target, &[], staged).unwrap().unwrap();
    let Outcome::Measured(found) = measure(staged, &mut renderer, 1).unwrap() else {
        panic!("{} is not supported", staged.name());
    };
    *found
}

fn figures(staged: &StagedShot, truth: &Measurement, found: &Measurement) -> Figures {
    let size = truth.image.size;
    let reference = Labelled { label: "truth-shadow-map", size, pixels: &truth.image.pixels };
    let test = Labelled { label: epipolar::ID, size, pixels: &found.image.pixels };
    let figures = compare(reference, test, None).unwrap();
    assert_eq!(figures.non_finite, 0, "{}", staged.name());
    figures
}

fn preset(staged: &StagedShot, truth: &Measurement, level: Quality, most: f64) -> Judged {
    let found = rendered(staged, Target::Quality(level));
    let Figures { rel_rmse, p99, .. } = figures(staged, truth, &found);
    let line = format!("{} at {level}: rel_rmse {rel_rmse:.5} of {most}, p99 {p99:.5}", staged.name());
    Judged { line, kept: rel_rmse <= most }
}

/// What reaches the camera if nothing casts a shadow, all lights together, without the glass before them: what the
/// technique multiplies by the share that it finds.
fn unoccluded(staged: &StagedShot) -> Vec<[f32; 3]> {
    let mut sum = vec![[0.0; 3]; (staged.camera().size()[0] * staged.camera().size()[1]) as usize];
    for index in 0..staged.light_count() {
        let mut image = ScatterImage::new();
        let rendered = staged.with_frame(index, staged.camera(), |frame| {
            let shadow = ShadowMap::Unshadowed;
            let (camera, light) = (frame.camera(), frame.light());
            Frame::new(camera, frame.depth(), light, &shadow, frame.medium(), frame.max_distance())
                .map(|frame| ShadowMapWalk::new().render(&frame, &mut image).map(drop))
        });
        rendered.unwrap().unwrap().unwrap();
        for (sum, pixel) in sum.iter_mut().zip(image.inscattered()) {
            *sum = std::array::from_fn(|channel| sum[channel] + pixel[channel]);
        }
    }
    sum
}

/// Each pixel's error over its unoccluded radiance: that of its worst channel.
fn relative_errors(found: &[[f32; 3]], truth: &[[f32; 3]], unoccluded: &[[f32; 3]]) -> Vec<f64> {
    let pixels = found.iter().zip(truth).zip(unoccluded);
    pixels
        .map(|((found, truth), whole)| {
            let channels = (0..3).map(|channel| {
                let error = (f64::from(found[channel]) - f64::from(truth[channel])).abs();
                if error == 0.0 { 0.0 } else { error / f64::from(whole[channel]) }
            });
            channels.fold(0.0, f64::max)
        })
        .collect()
}

/// Whether what a pixel sees is hidden from slices: exact walks up to half a pixel apart, on both sides of its centre
/// across its slice, agree within half the error, and the walk through the centre is off by more than that from both.
fn hides_between_slices(staged: &StagedShot, pixel: u32, error: f64) -> bool {
    const STEPS: i32 = 16;
    let (x, y) = (pixel % SIZE[0], pixel / SIZE[0]);
    (0..staged.light_count()).any(|index| {
        let hides = staged.with_frame(index, staged.camera(), |frame| {
            let away = Epipole::new(frame.camera(), frame.light())
                .towards(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            let across = away.perp().normalize_or(DVec2::X);
            let walk = |step: i32, shadow: &ShadowMap<'_>| {
                let by = across * f64::from(step) / f64::from(2 * STEPS);
                let camera = frame.camera().shifted(by.x, by.y);
                let (light, medium) = (frame.light(), frame.medium());
                let moved = Frame::new(&camera, frame.depth(), light, shadow, medium, frame.max_distance());
                walked_radiance(&moved.unwrap(), x, y).max_element()
            };
            let allowed = 0.5 * error * walk(0, &ShadowMap::Unshadowed);
            let walks: Vec<f64> = (-STEPS..=STEPS).map(|step| walk(step, frame.shadow())).collect();
            let own = walks[STEPS as usize];
            let differs = |a: f64, b: f64| (a - b).abs() > allowed;
            let slices =
                (0..STEPS as usize).flat_map(|from| (1..=STEPS as usize).map(move |to| (from, from + to)));
            slices
                .filter(|&(from, to)| from < STEPS as usize && to > STEPS as usize)
                .map(|(from, to)| (walks[from], walks[to]))
                .any(|(a, b)| !differs(a, b) && differs(own, a) && differs(own, b))
        });
        hides.unwrap()
    })
}

fn target(staged: &StagedShot, truth: &Measurement, unoccluded: &[[f32; 3]], error: f64) -> Judged {
    let found = rendered(staged, Target::Error(error));
    let mut errors = relative_errors(&found.image.pixels, &truth.image.pixels, unoccluded);
    let is_beyond = |found: f64| !(found <= error + ROUNDING);
    let beyond: Vec<usize> = (0..errors.len()).filter(|&pixel| is_beyond(errors[pixel])).collect();
    let thin = beyond.iter().filter(|&&pixel| hides_between_slices(staged, pixel as u32, error)).count();
    errors.sort_unstable_by(f64::total_cmp);
    let last = errors.len() - 1;
    let [p99, p999, max] = [0.99, 0.999, 1.0].map(|part| errors[(part * last as f64).ceil() as usize]);
    let share = beyond.len() as f64 / errors.len() as f64;
    let count = |name: &str| found.counts.get(name).copied().unwrap_or(0);
    let line = format!(
        "{} at an error of {error}: p99 {:.3}, p99.9 {:.3}, max {:.3} of it, {} of {} pixels beyond, {thin} of them between slices that agree; rank {}, {} slices, {} pixels walked",
        staged.name(),
        p99 / error,
        p999 / error,
        max / error,
        beyond.len(),
        errors.len(),
        count("rank"),
        count("slices"),
        count("walked pixels"),
    );
    Judged { line, kept: share <= EXCEPTED }
}

fn staged(path: &Path, size: [u32; 2], map: u32) -> StagedShot {
    let mut shot = load_shot(path).unwrap();
    shot.camera = resized(&shot.camera, size).unwrap();
    StagedShot::new(shot, map).unwrap()
}

/// Stages a shot once, renders it by every preset and every error target.
fn find(path: &Path, most: fn(Quality) -> f64) -> Found {
    let mut staged = staged(path, SIZE, MAP);
    let truth = shadow_map_truth(&staged).unwrap();
    let unoccluded = unoccluded(&staged);
    let levels = [Quality::Preview, Quality::Game, Quality::Film];
    let presets = levels.map(|level| preset(&staged, &truth, level, most(level))).into();
    let targets = TARGETS.map(|error| target(&staged, &truth, &unoccluded, error)).into();
    let lights: Vec<Light> = staged.lights().map(|(light, _)| light.clone()).collect();
    // As many texels in all.
    let cascades = MapResolution::cascaded(MAP / 2, 4);
    staged.restage(staged.camera().clone(), &lights, cascades).unwrap();
    let cascaded = if staged.cascades().is_some() {
        let truth = shadow_map_truth(&staged).unwrap();
        levels.map(|level| preset(&staged, &truth, level, most(level))).into()
    } else {
        Vec::new()
    };
    Found { presets, targets, cascaded }
}

/// Folder with the built-in shots.
static FILES: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let dir = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().collect();
    export(dir.path(), &shots).unwrap();
    dir
});

fn builtin_path(name: &str) -> PathBuf {
    FILES.path().join(format!("{name}.toml"))
}

static BUILT_IN: LazyLock<Vec<Found>> =
    LazyLock::new(|| builtin_shots().iter().map(|shot| find(&builtin_path(shot.name), most)).collect());

/// `None` without the folder of shared cases.
static SHARED: LazyLock<Option<Vec<Found>>> = LazyLock::new(|| {
    let shared = std::env::var_os("SCATTER_SHARED")?;
    let mut paths: Vec<PathBuf> = std::fs::read_dir(PathBuf::from(shared).join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "no shot file in SCATTER_SHARED/scenes");
    Some(paths.iter().map(|path| find(path, most_in_the_dark)).collect())
});

/// Prints what was found, and fails if something was missed.
#[track_caller]
fn judge<'a>(found: impl IntoIterator<Item = &'a Judged>) {
    let found: Vec<_> = found.into_iter().collect();
    found.iter().for_each(|judged| println!("{}", judged.line));
    let missed: Vec<_> = found.iter().filter(|judged| !judged.kept).map(|judged| &judged.line).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

/// As [`judge`], of the shared shots; says so if there are none.
#[track_caller]
fn judge_shared(test: &str, part: fn(&Found) -> &Vec<Judged>) {
    match &*SHARED {
        Some(found) => judge(found.iter().flat_map(part)),
        None => println!("SKIPPED {test}: SCATTER_SHARED does not name the folder of shared cases"),
    }
}

#[test]
fn presets_keep_their_error_on_every_built_in_shot() {
    judge(BUILT_IN.iter().flat_map(|found| &found.presets));
}

#[test]
fn the_finest_preset_keeps_its_level_on_every_shared_shot() {
    judge_shared("the_finest_preset_keeps_its_level_on_every_shared_shot", |found| &found.presets);
}

#[test]
fn with_four_cascades_presets_keep_their_error_on_every_suns_shot() {
    let suns = BUILT_IN.iter().filter(|found| !found.cascaded.is_empty()).count();
    assert!(suns >= 6, "{suns} shots have cascades");
    judge(BUILT_IN.iter().flat_map(|found| &found.cascaded));
}

#[test]
fn with_four_cascades_the_finest_preset_keeps_its_level_on_every_shared_shot() {
    judge_shared("with_four_cascades_the_finest_preset_keeps_its_level_on_every_shared_shot", |found| {
        &found.cascaded
    });
}

#[test]
fn an_error_that_is_asked_for_is_kept_on_every_built_in_shot() {
    judge(BUILT_IN.iter().flat_map(|found| &found.targets));
}

#[test]
fn an_error_that_is_asked_for_is_kept_on_every_shared_shot() {
    judge_shared("an_error_that_is_asked_for_is_kept_on_every_shared_shot", |found| &found.targets);
}

/// At the size that presets were chosen at, with half as many texels a side: 99 % of the pixels keep the level.
#[test]
fn in_larger_pictures_99_of_100_pixels_keep_the_level() {
    for name in ["comb", "sunset", "beam"] {
        let staged = staged(&builtin_path(name), [641, 479], 1024);
        let truth = shadow_map_truth(&staged).unwrap();
        judge(&[Quality::Game, Quality::Film].map(|level| {
            let found = rendered(&staged, Target::Quality(level));
            let Figures { rel_rmse, p99, .. } = figures(&staged, &truth, &found);
            let most = level.error();
            let line = format!("{name} at {level}: p99 {p99:.5} of {most}, rel_rmse {rel_rmse:.5}");
            Judged { line, kept: p99 <= most }
        }));
    }
}
