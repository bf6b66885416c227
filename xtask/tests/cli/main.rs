//! The built program from outside: exit codes, one-line errors, JSON, and that nothing is left behind.

mod cascades;
mod compare;
mod errors;
mod foreign;
#[cfg(feature = "gpu")]
mod gpu;
mod plan;
mod regression;
mod render;
mod stress;
mod tradeoff;
mod validate;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use scatter_scene::{RadianceImage, write_exr};
use serde_json::Value;

/// Runs the program in `folder`.
fn xtask(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

/// Its exit code.
fn code(output: &Output) -> i32 {
    output.status.code().expect("it ended by itself")
}

/// Its stderr, which must be one `error:` line, with exit code 2 and nothing on stdout.
#[track_caller]
fn error_line(folder: &Path, arguments: &[&str]) -> String {
    let output = xtask(folder, arguments);
    let stderr = String::from_utf8(output.stderr.clone()).expect("UTF-8");
    assert_eq!(code(&output), 2, "{arguments:?}: {stderr}");
    // What takes a second on a busy machine names its stages before.
    let lines: Vec<_> = stderr.lines().filter(|line| !line.starts_with("wall: ")).collect();
    assert!(lines.len() == 1 && lines[0].starts_with("error: "), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?}: something on stdout");
    lines[0].to_string()
}

/// Its stdout as one JSON document.
#[track_caller]
fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// What is in a folder, by name.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A shot of one wall under a slanted sun: 8 × 6 pixels.
fn write_shot(folder: &Path) -> PathBuf {
    std::fs::write(
        folder.join("wall.obj"),
        "v -1 0 -2\nv 1 0 -2\nv 1 2 -2\nv -1 2 -2\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nf 1 2 3 4\nf 5 6 7 8\n",
    )
    .expect("written");
    let path = folder.join("wall.toml");
    let text = "mesh = \"wall.obj\"\n[camera]\neye = [0.3, 1.0, 4.0]\ntarget = [0.0, 1.0, 0.0]\n\
                up = [0.0, 1.0, 0.0]\nvertical_fov_degrees = 60.0\nresolution = [8, 6]\nmax_distance = 30.0\n\
                [light]\nkind = \"directional\"\ndirection = [0.4, -1.0, 0.5]\nirradiance = [3.0, 2.0, 1.0]\n\
                [medium]\nscattering = [0.05, 0.05, 0.05]\nabsorption = [0.0, 0.0, 0.0]\nphase = \"isotropic\"\n\
                g = 0.0\n";
    std::fs::write(&path, text).expect("written");
    path
}

/// An image whose pixel (x, y) is `value(x, y)`.
fn write_image(path: &Path, size: [u32; 2], value: impl Fn(u32, u32) -> [f32; 3]) {
    let pixels =
        (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
    write_exr(path, &RadianceImage { size, pixels }).expect("written");
}
