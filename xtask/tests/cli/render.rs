//! `render`: the image, and the JSON object of the documentation.

use scatter_scene::read_exr;

use super::*;

#[test]
fn the_object_has_what_the_documentation_says() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let arguments = [
        "render",
        "--shot",
        "wall.toml",
        "--method",
        "raymarch",
        "--set",
        "steps=64",
        "--shadow-map",
        "32",
        "--threads",
        "1",
        "--repeat",
        "2",
        "--compare",
        "--json",
        "--out",
        "o.exr",
        "--png",
        "o.png",
    ];
    let output = xtask(folder.path(), &arguments);
    let row = json(&output);
    assert_eq!(code(&output), 0);
    assert_eq!((&row["shot"], &row["method"]), (&Value::from("wall"), &Value::from("raymarch")));
    assert_eq!(row["overrides"], serde_json::json!({"steps": "64"}));
    assert_eq!(row["options"]["steps"], "64");
    assert!(row["options"]["jitter"].is_string(), "options hold every option's value: {row}");
    assert_eq!(row["size"], serde_json::json!([8, 6]));
    assert_eq!((&row["shadow_map"], &row["threads"]), (&Value::from(32), &Value::from(1)));
    assert!(row["time_ms"]["total"].as_f64().unwrap() > 0.0 && row["maps_ms"].as_f64().unwrap() > 0.0);
    for key in ["memory_bytes", "counts", "modelled"] {
        assert!(!row[key].is_null(), "{key}");
    }
    for truth in ["shadow_map", "raycast"] {
        for figure in ["rel_rmse", "p99", "max", "bias", "non_finite"] {
            assert!(row["errors"][truth][figure].is_number(), "{truth}.{figure}");
        }
    }
    assert_eq!(names(folder.path()), ["o.exr", "o.png", "wall.obj", "wall.toml"]);
}

#[test]
fn figures_in_the_object_are_those_of_the_written_images() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let common = ["render", "--shot", "wall.toml", "--shadow-map", "32", "--json"];
    let render = |more: &[&str]| json(&xtask(folder.path(), &[&common[..], more].concat()));
    let row = render(&["--set", "steps=4", "--compare", "shadow-map", "--out", "march.exr"]);
    assert!(row["errors"]["raycast"].is_null(), "only what was asked for");
    render(&["--method", "truth-shadow-map", "--out", "truth.exr"]);
    let figures = json(&xtask(folder.path(), &["compare", "truth.exr", "march.exr", "--json"]));
    assert_eq!(row["errors"]["shadow_map"], figures);
    assert!(figures["rel_rmse"].as_f64().unwrap() > 0.0, "four steps are not exact");
}

#[test]
fn size_quick_and_threads_mean_what_they_say() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let render = |more: &[&str]| {
        let base =
            ["render", "--shot", "wall.toml", "--method", "truth-raycast", "--json", "--shadow-map", "8"];
        json(&xtask(folder.path(), &[&base[..], more].concat()))
    };
    render(&["--size", "13x7", "--threads", "1", "--out", "a.exr"]);
    render(&["--size", "13x7", "--threads", "3", "--out", "b.exr"]);
    let (a, b) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
    assert_eq!(read_exr(&a).unwrap().size, [13, 7]);
    assert_eq!(read_exr(&a).unwrap(), read_exr(&b).unwrap(), "the same bits for any number of threads");
    let quick = json(&xtask(
        folder.path(),
        &["render", "--shot", "wall.toml", "--method", "truth-raycast", "--json", "--quick"],
    ));
    assert_eq!((&quick["shadow_map"], &quick["size"]), (&Value::from(512), &serde_json::json!([8, 6])));
}

#[test]
fn an_old_output_is_replaced_and_survives_an_error() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let out = folder.path().join("o.exr");
    std::fs::write(&out, "old").unwrap();
    error_line(folder.path(), &["render", "--shot", "no.toml", "--out", "o.exr"]);
    assert_eq!(std::fs::read(&out).unwrap(), b"old");
    let output =
        xtask(folder.path(), &["render", "--shot", "wall.toml", "--shadow-map", "8", "--out", "o.exr"]);
    assert_eq!(code(&output), 0);
    assert_eq!(read_exr(&out).unwrap().size, [8, 6]);
}
