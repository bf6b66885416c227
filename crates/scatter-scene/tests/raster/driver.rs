//! The device that the tests run on, or a visible and counted note that there is none.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use scatter_scene::{BuiltinShot, RasterDevice, RasterOptions, Shot, load_shot};

static SKIPPED: AtomicU32 = AtomicU32::new(0);

/// Says on the terminal, past the test harness's capture, that a test did not run.
pub fn skip(test: &str, reason: &str) {
    let count = SKIPPED.fetch_add(1, Ordering::Relaxed) + 1;
    let _ = writeln!(std::io::stderr(), "SKIPPED {test} ({count} of this program): {reason}");
}

/// Whether a missing driver is a failure.
fn is_required() -> bool {
    std::env::var_os("SCATTER_VULKAN").is_some_and(|value| value == "required")
}

/// A device with the validation layer on where it is installed; `None`, visibly, without a driver.
pub fn device(test: &str) -> Option<RasterDevice> {
    match RasterDevice::open(&RasterOptions { validate: true, ..RasterOptions::default() }) {
        Ok(device) => Some(device),
        Err(error) if error.is_missing_driver() && !is_required() => {
            skip(test, &error.to_string());
            None
        }
        Err(error) => panic!("SCATTER_VULKAN=required, and: {error}"),
    }
}

/// The layer has nothing to say about a correct program.
pub fn assert_valid(device: &RasterDevice) {
    assert_eq!(device.validation_messages(), Vec::<String>::new());
}

/// A built-in shot.
pub fn builtin(name: &str) -> Shot {
    let files = BuiltinShot::find(name).unwrap().files();
    let folder = tempfile::tempdir().unwrap();
    for file in [&files.shot, &files.mesh].into_iter().chain(&files.others) {
        std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
    }
    load_shot(&folder.path().join(&files.shot.name)).unwrap()
}

/// A shot of the shared scenes; `None`, visibly, without them.
pub fn shared(test: &str, file: &str) -> Option<Shot> {
    let Some(folder) = std::env::var_os("SCATTER_SHARED") else {
        skip(test, "SCATTER_SHARED does not name the folder of shared cases");
        return None;
    };
    Some(load_shot(&PathBuf::from(folder).join("scenes").join(file)).unwrap())
}
