//! Epipolar integration on the built-in shots, and on the shared ones where there are any, as small pictures: its
//! presets keep what they promise against the exact walk through the same map.

use std::path::{Path, PathBuf};

use scatter::epipolar;
use scatter_core::{Quality, Target};
use scatter_scene::{builtin_shots, export, load_shot};
use scatter_validate::matrix::shadow_map_truth;
use scatter_validate::measure::{Outcome, Renderer, measure};
use scatter_validate::staged_shot::resized;
use scatter_validate::{Figures, Labelled, StagedShot, compare};

/// A picture of odd sides, with texels about as wide as its pixels.
const SIZE: [u32; 2] = [161, 119];
const MAP: u32 = 256;

/// Largest relative RMSE of a preset on shots that are lit: 1 % by default and at film.
///
/// p99 is printed, not judged: presets are made for pictures of many more pixels, whose shadows' edges are a smaller
/// part of them.
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

/// Renders a shot by each quality level and prints what was found; returns the levels that were missed.
fn check(path: &Path, most: fn(Quality) -> f64) -> Vec<String> {
    let mut shot = load_shot(path).unwrap();
    shot.camera = resized(&shot.camera, SIZE).unwrap();
    let staged = StagedShot::new(shot, MAP).unwrap();
    let truth = shadow_map_truth(&staged, 1).unwrap();
    let mut missed = Vec::new();
    for level in [Quality::Preview, Quality::Game, Quality::Film] {
        let technique = &epipolar::TECHNIQUE;
        let mut renderer =
            Renderer::configured(technique, Target::Quality(level), &[], &staged).unwrap().unwrap();
        let Outcome::Measured(found) = measure(&staged, &mut renderer, 1).unwrap() else {
            panic!("{} is not supported", staged.name());
        };
        let reference = Labelled { label: "truth-shadow-map", size: SIZE, pixels: &truth.image.pixels };
        let test = Labelled { label: epipolar::ID, size: SIZE, pixels: &found.image.pixels };
        let Figures { rel_rmse, p99, non_finite, .. } = compare(reference, test, None).unwrap();
        let name = staged.name();
        let line = format!("{name} at {level}: rel_rmse {rel_rmse:.5} of {}, p99 {p99:.5}", most(level));
        println!("{line}");
        assert_eq!(non_finite, 0, "{line}");
        if !(rel_rmse <= most(level)) {
            missed.push(line);
        }
    }
    missed
}

#[test]
fn presets_keep_their_error_on_every_built_in_shot() {
    let dir = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().collect();
    export(dir.path(), &shots).unwrap();
    let missed: Vec<_> =
        shots.iter().flat_map(|shot| check(&dir.path().join(format!("{}.toml", shot.name)), most)).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn the_finest_preset_keeps_its_level_on_every_shared_shot() {
    let Some(shared) = std::env::var_os("SCATTER_SHARED") else {
        println!(
            "SKIPPED the_finest_preset_keeps_its_level_on_every_shared_shot: SCATTER_SHARED does not name the folder of shared cases"
        );
        return;
    };
    let mut paths: Vec<PathBuf> = std::fs::read_dir(PathBuf::from(shared).join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "no shot file in SCATTER_SHARED/scenes");
    let missed: Vec<_> = paths.iter().flat_map(|path| check(path, most_in_the_dark)).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}
