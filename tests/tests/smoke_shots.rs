//! `avsm` on shots with smoke and hair, as small pictures, against ray-cast truth: every pixel's shadow rays by the spheres and
//! strands themselves, without a map.

use std::path::{Path, PathBuf};

use scatter::avsm;
use scatter_core::{Quality, Target};
use scatter_scene::{BuiltinShot, export, load_shot};
use scatter_validate::measure::{Outcome, Renderer, measure};
use scatter_validate::staged_shot::resized;
use scatter_validate::truths::raycast_truth;
use scatter_validate::{Labelled, StagedShot, compare};

/// A picture of odd sides, which no band of rows fits.
const SIZE: [u32; 2] = [53, 39];
const MAP: u32 = 256;

/// Largest relative RMSE of the defaults, 8 nodes at 256²: a light ray through a texel's middle stands for all of it, and hair is
/// thinner than a texel.
const MOST: f64 = 0.01;
/// Of 16 nodes at 1024², on shared cases: what is asked of them, the error of a shadow map of 256² texels included.
const MOST_FINE: f64 = 0.02;

/// The shot's relative RMSE with these options, and whether it is within `most`.
fn judged(path: &Path, overrides: &[(&str, &str)], most: f64) -> (String, bool) {
    let mut shot = load_shot(path).unwrap();
    shot.camera = resized(&shot.camera, SIZE).unwrap();
    let staged = StagedShot::new(shot, MAP).unwrap();
    let truth = raycast_truth(&staged).unwrap();
    let target = Target::Quality(Quality::Game);
    let mut renderer = Renderer::configured(&avsm::TECHNIQUE, target, overrides, &staged).unwrap().unwrap();
    let Outcome::Measured(found) = measure(&staged, &mut renderer, 1).unwrap() else {
        return (format!("{}: not supported", staged.name()), false);
    };
    let size = truth.image.size;
    let reference = Labelled { label: "truth-raycast", size, pixels: &truth.image.pixels };
    let test = Labelled { label: avsm::ID, size, pixels: &found.image.pixels };
    let figures = compare(reference, test, None).unwrap();
    let line = format!(
        "{} {overrides:?}: rel_rmse {:.1e} of {most:.0e}, p99 {:.1e}; {} bytes of curves",
        staged.name(),
        figures.rel_rmse,
        figures.p99,
        found.counts["curve bytes"],
    );
    (line, figures.rel_rmse <= most && figures.non_finite == 0)
}

#[test]
fn built_in_smoke_and_hair_are_what_rays_say() {
    let dir = tempfile::tempdir().unwrap();
    let shots = ["smoke", "hair", "smoke-and-hair"].map(|name| BuiltinShot::find(name).unwrap());
    export(dir.path(), &shots).unwrap();
    let found: Vec<_> =
        shots.iter().map(|shot| judged(&dir.path().join(format!("{}.toml", shot.name)), &[], MOST)).collect();
    found.iter().for_each(|(line, _)| println!("{line}"));
    assert!(found.iter().all(|(_, kept)| *kept), "{found:#?}");
}

#[test]
fn shared_smoke_is_what_rays_say() {
    let Some(shared) = std::env::var_os("SCATTER_SHARED") else {
        println!(
            "SKIPPED shared_smoke_is_what_rays_say: SCATTER_SHARED does not name the folder of shared cases"
        );
        return;
    };
    let cases = PathBuf::from(shared).join("cases-smoke");
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(cases).unwrap().map(|entry| entry.unwrap().path().join("shot.toml")).collect();
    paths.sort();
    assert!(!paths.is_empty(), "no case in SCATTER_SHARED/cases-smoke");
    for path in paths {
        let (line, kept) = judged(&path, &[("nodes", "16"), ("curves", "1024")], MOST_FINE);
        println!("{line}");
        assert!(kept, "{line}");
    }
}
