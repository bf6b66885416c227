//! Exact mode of `minmax-mipmap` on the built-in shots, and on the shared ones where there are any, as small pictures: what
//! the exact walk through the same map says, to 1e-5 of the mean, with tens of nodes a pixel instead of thousands of texels.

use std::path::{Path, PathBuf};

use scatter::minmax_mipmap;
use scatter_core::{Quality, Target};
use scatter_scene::{builtin_shots, export, load_shot};
use scatter_validate::measure::{Outcome, Renderer, measure};
use scatter_validate::staged_shot::resized;
use scatter_validate::truths::shadow_map_truth;
use scatter_validate::{Labelled, StagedShot, compare};

/// A picture of odd sides, which no group of pixels fits.
const SIZE: [u32; 2] = [161, 119];
const MAP: u32 = 256;

/// Largest relative RMSE: what exact mode promises. Crossings in f32 are off by 2⁻²³ of a segment each, and a closed form
/// in f32 by a millionth; the rest is room for dark pictures, whose mean is a few thin shafts.
const MOST: f64 = 1e-5;

/// The shot's error and counts as a line, and whether it keeps the promise.
fn judged(path: &Path) -> (String, bool) {
    let mut shot = load_shot(path).unwrap();
    shot.camera = resized(&shot.camera, SIZE).unwrap();
    let staged = StagedShot::new(shot, MAP).unwrap();
    let truth = shadow_map_truth(&staged).unwrap();
    let target = Target::Quality(Quality::Preview);
    let mut renderer =
        Renderer::configured(&minmax_mipmap::TECHNIQUE, target, &[], &staged).unwrap().unwrap();
    let Outcome::Measured(found) = measure(&staged, &mut renderer, 1).unwrap() else {
        return (format!("{}: not supported", staged.name()), false);
    };
    let size = truth.image.size;
    let reference = Labelled { label: "truth-shadow-map", size, pixels: &truth.image.pixels };
    let test = Labelled { label: minmax_mipmap::ID, size, pixels: &found.image.pixels };
    let figures = compare(reference, test, None).unwrap();
    let pixels = f64::from(SIZE[0] * SIZE[1]);
    let a_pixel = |name: &str| found.counts[name] as f64 / pixels;
    let line = format!(
        "{}: rel_rmse {:.1e} of {MOST:.0e}, p99 {:.1e}; {:.1} nodes and {:.1} texels a pixel",
        staged.name(),
        figures.rel_rmse,
        figures.p99,
        a_pixel("nodes"),
        a_pixel("texels"),
    );
    (line, figures.rel_rmse <= MOST && figures.non_finite == 0)
}

#[track_caller]
fn judge(paths: &[PathBuf]) {
    let found: Vec<_> = paths.iter().map(|path| judged(path)).collect();
    found.iter().for_each(|(line, _)| println!("{line}"));
    let missed: Vec<_> = found.iter().filter(|(_, kept)| !kept).map(|(line, _)| line).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn every_built_in_shot_is_what_the_exact_walk_says() {
    let dir = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().collect();
    export(dir.path(), &shots).unwrap();
    let paths: Vec<_> = shots.iter().map(|shot| dir.path().join(format!("{}.toml", shot.name))).collect();
    judge(&paths);
}

#[test]
fn every_shared_shot_is_what_the_exact_walk_says() {
    let Some(shared) = std::env::var_os("SCATTER_SHARED") else {
        println!(
            "SKIPPED every_shared_shot_is_what_the_exact_walk_says: SCATTER_SHARED does not name the folder of shared cases"
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
    judge(&paths);
}
