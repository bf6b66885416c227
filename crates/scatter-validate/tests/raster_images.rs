//! Shadow-map truth does not care which source made the maps: its images from both agree, on every shot.

use std::io::Write as _;
use std::path::PathBuf;

use scatter_scene::{RasterDevice, RasterOptions, Shot, builtin_shots, builtin_variants, export, load_shot};
use scatter_validate::staged_shot::resized;
use scatter_validate::truths::shadow_map_truth;
use scatter_validate::{Labelled, StagedShot, compare};

/// Largest relative RMS difference of the two images. A texel that differs is a shaft of light that is there or not:
/// in a dark hall a single one can be as much as this.
const MAY_DIFFER: f64 = 2e-3;
/// Small, so that the ray casts are quick; not square, and no multiple of a rasteriser's tile.
const SIZE: [u32; 2] = [201, 149];
/// Texels along a side of the shadow map.
const MAP_SIZE: u32 = 509;

/// A device; `None`, visibly, where there is none and none is required.
fn device(test: &str) -> Option<RasterDevice> {
    let required = std::env::var_os("SCATTER_VULKAN").is_some_and(|value| value == "required");
    match RasterDevice::open(&RasterOptions::default()) {
        Ok(device) => Some(device),
        Err(error) if error.is_missing_driver() && !required => {
            skip(test, &error.to_string());
            None
        }
        Err(error) => panic!("SCATTER_VULKAN=required, and: {error}"),
    }
}

/// Says on the terminal, past the test harness's capture, that a test did not run.
fn skip(test: &str, reason: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED {test}: {reason}");
}

fn images_agree(shot: impl Fn() -> Shot, device: &RasterDevice) {
    let image = |device: Option<&RasterDevice>| {
        let mut shot = shot();
        shot.camera = resized(&shot.camera, SIZE).unwrap();
        let staged = StagedShot::with_source(shot, MAP_SIZE, device).unwrap();
        shadow_map_truth(&staged).unwrap().image
    };
    let (cast, drawn) = (image(None), image(Some(device)));
    let figures = compare(
        Labelled { label: "maps by ray casts", size: cast.size, pixels: &cast.pixels },
        Labelled { label: "maps by raster", size: drawn.size, pixels: &drawn.pixels },
        None,
    )
    .unwrap();
    println!("{}: rel_rmse {:.1e}", shot().name, figures.rel_rmse);
    assert!(figures.reference_mean > 0.0 && figures.non_finite == 0, "{}: {figures:?}", shot().name);
    assert!(figures.rel_rmse <= MAY_DIFFER, "{}: {figures:?}", shot().name);
}

#[test]
fn images_of_the_built_in_shots_agree() {
    let Some(device) = device("images_of_the_built_in_shots_agree") else { return };
    let folder = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().chain(builtin_variants()).collect();
    for path in export(folder.path(), &shots).unwrap() {
        images_agree(|| load_shot(&path).unwrap(), &device);
    }
}

#[test]
fn images_of_the_shared_shots_agree() {
    let test = "images_of_the_shared_shots_agree";
    let Some(device) = device(test) else { return };
    let Some(shared) = std::env::var_os("SCATTER_SHARED") else {
        return skip(test, "SCATTER_SHARED does not name the folder of shared cases");
    };
    let mut paths: Vec<PathBuf> = std::fs::read_dir(PathBuf::from(shared).join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "no shot file in SCATTER_SHARED/scenes");
    for path in paths {
        images_agree(|| load_shot(&path).unwrap(), &device);
    }
}
