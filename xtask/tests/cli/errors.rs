//! Every wrong command line or input: exit code 2, one line, nothing on stdout, nothing left behind.

use super::*;

#[test]
fn unknown_names_list_the_known_ones() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let line = |arguments: &[&str]| error_line(folder.path(), arguments);
    let method = line(&["render", "--shot", "wall.toml", "--method", "marcher", "--json"]);
    for known in ["raymarch", "truth-raycast", "truth-shadow-map"] {
        assert!(method.contains(known), "{method}");
    }
    let shot = line(&["validate", "--shot", "nvae"]);
    assert!(shot.contains("nave") && shot.contains("lamp"), "{shot}");
    let option = line(&["render", "--shot", "wall.toml", "--set", "stps=8", "--json"]);
    assert!(option.contains("no option 'stps'") && option.contains("steps"), "{option}");
    let value = line(&["render", "--shot", "wall.toml", "--set", "steps=many", "--json"]);
    assert!(value.contains("steps is 'many'"), "{value}");
    let quality = line(&["render", "--shot", "wall.toml", "--quality", "best", "--json"]);
    assert!(quality.contains("preview, game or film"), "{quality}");
    let source = line(&["render", "--shot", "wall.toml", "--shadow-source", "gpu", "--json"]);
    assert!(source.contains("raycast") && source.contains("raster"), "{source}");
}

#[test]
fn flags_out_of_range_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    for wrong in [
        &["--size", "0x4"][..],
        &["--size", "640"],
        &["--size", "999999x4"],
        &["--threads", "0"],
        &["--repeat", "0"],
        &["--shadow-map", "0"],
        &["--shadow-map", "-4"],
        &["--cascades", "1"],
        &["--cascades", "17"],
        &["--cascades", "four"],
        &["--set", "steps"],
        &["--compare", "itself"],
        &["--no-such-flag"],
        &["--shadow-source", "raster", "--vulkan-device", "no such device"],
        &["--vulkan-device", "0"],
    ] {
        let mut arguments = vec!["render", "--shot", "wall.toml", "--json"];
        arguments.extend(wrong);
        error_line(folder.path(), &arguments);
    }
    error_line(folder.path(), &["no-such-command"]);
    error_line(folder.path(), &["render", "--json"]);
    error_line(folder.path(), &["render", "--shot", "wall.toml"]);
    error_line(
        folder.path(),
        &["render", "--shot", "wall.toml", "--json", "--method", "raymarch", "--method", "raymarch"],
    );
}

#[test]
fn references_take_no_options_and_are_not_compared_with_themselves() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let truth =
        ["render", "--shot", "wall.toml", "--method", "truth-raycast", "--json", "--shadow-map", "16"];
    let with = |more: &[&str]| error_line(folder.path(), &[&truth[..], more].concat());
    assert!(with(&["--set", "steps=8"]).contains("no options"));
    assert!(with(&["--compare", "raycast"]).contains("compared with itself"));
}

#[test]
fn broken_shots_name_file_place_and_cure() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_shot(folder.path());
    let good = std::fs::read_to_string(&path).unwrap();
    for (from, to, word) in [
        ("phase = ", "fase = ", "fase"),
        ("wall.obj", "wal.obj", "wal.obj"),
        ("[0.4, -1.0, 0.5]", "[0.0, 0.0, 0.0]", "direction"),
        ("[8, 6]", "[0, 6]", "resolution"),
        ("[0.05, 0.05, 0.05]", "[-0.05, 0.05, 0.05]", "scattering"),
        ("max_distance = 30.0", "max_distance = nan", "max_distance"),
    ] {
        std::fs::write(&path, good.replace(from, to)).unwrap();
        let line = error_line(folder.path(), &["render", "--shot", "wall.toml", "--out", "o.exr"]);
        assert!(line.starts_with("error: wall.toml: ") && line.contains(word), "{line}");
    }
    assert_eq!(names(folder.path()), ["wall.obj", "wall.toml"], "nothing is left behind");
}

#[test]
fn outputs_that_cannot_be_written_are_errors_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    // The shot does not even exist: the outputs are checked first.
    let line = |arguments: &[&str]| {
        error_line(folder.path(), &[&["render", "--shot", "no.toml"], arguments].concat())
    };
    assert!(line(&["--out", "no/o.exr"]).contains("no/o.exr: the folder no does not exist"));
    assert!(line(&["--out", "."]).contains("this is a folder"));
    assert!(line(&["--out", "o.exr", "--png", "o.exr"]).contains("same file"));
    let report = error_line(folder.path(), &["validate", "--shot", "wall.toml", "--report", "wall.obj"]);
    assert!(report.contains("wall.obj: this is a file"), "{report}");
    let rows = ["validate", "--shot", "wall.toml", "--report", "rep", "--row", "no such row"];
    assert!(error_line(folder.path(), &rows).contains("--row"));
    assert_eq!(names(folder.path()), ["wall.obj", "wall.toml"]);
}

#[test]
fn help_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["--help"][..], &["render", "--help"], &["--version"]] {
        let output = xtask(folder.path(), arguments);
        assert!(code(&output) == 0 && output.stderr.is_empty() && !output.stdout.is_empty(), "{arguments:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_reader_who_closes_the_pipe_is_no_error() {
    use std::io::Read;

    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["methods"])
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert!(child.wait().unwrap().success() && stderr.is_empty(), "{stderr}");
}
