//! `validate`, `methods` and `shots`: their documents, the report, and the exit code of a failure.

use super::*;

const TINY: [&str; 5] = ["validate", "--shot", "wall.toml", "--shadow-map", "32"];

#[test]
fn the_document_has_machine_and_rows() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let output = xtask(folder.path(), &[&TINY[..], &["--json", "--set", "steps=4096"]].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    for key in ["cpu", "cores", "os", "rustc", "simd", "version"] {
        assert!(!document["machine"][key].is_null(), "{key}");
    }
    let rows = document["rows"].as_array().unwrap();
    let row = |method: &str| rows.iter().find(|row| row["method"] == method).unwrap();
    let march = row("raymarch");
    assert_eq!((&march["verdict"], &march["level"]), (&Value::from("ok"), &Value::from("game")));
    assert_eq!(march["ratio"], 1.0, "the marcher against itself");
    let map = row("truth-shadow-map");
    assert!(map["errors"]["raycast"]["rel_rmse"].is_number() && map["errors"]["shadow_map"].is_null());
    assert!(map["ratio"].is_null() && map["level"].is_null(), "references have no level");
}

#[test]
fn a_missed_level_is_exit_code_1_and_a_line_that_says_why() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let output = xtask(
        folder.path(),
        &[&TINY[..], &["--method", "truth-shadow-map", "--method", "raymarch", "--set", "steps=1"]].concat(),
    );
    let stdout = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(code(&output), 1, "{stdout}");
    assert!(stdout.contains("FAIL raymarch on wall: misses game"), "{stdout}");
    let table: Vec<&str> = stdout.lines().filter(|line| line.starts_with("wall")).collect();
    assert_eq!(table.len(), 2);
    assert!(table.iter().all(|line| line.chars().count() <= 120), "{stdout}");
}

#[test]
fn the_report_is_one_file_with_pictures_plots_and_the_grid() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    // Of the marcher and a few rows alone: fast, whatever other techniques there are.
    let more = ["--report", "rep", "--set", "steps=4096", "--method", "raymarch", "--row", "image size"];
    let output = xtask(folder.path(), &[&TINY[..], &more].concat());
    let stderr = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(code(&output), 0, "{stderr}");
    assert!(stderr.contains("for the report: the stress matrix"), "{stderr}");
    assert_eq!(names(&folder.path().join("rep")), ["report.html"]);
    let html = std::fs::read_to_string(folder.path().join("rep/report.html")).unwrap();
    // The two truths with their difference, the marcher with its two.
    assert_eq!(html.matches("<img src=\"data:image/png;base64,").count(), 6);
    assert_eq!(html.matches("<svg ").count(), 1, "a plot a shot");
    for text in [
        "raymarch − truth-shadow-map",
        "steps=4096",
        "<dt>quality level</dt><dd>game: errors up to 3 %</dd>",
        "<summary>All settings on wall</summary>",
        "<table class=\"stress\">",
        "1x37, sun",
    ] {
        assert!(html.contains(text), "{text}");
    }
    // Options by hand are not for the trade-off: it tries the whole ladder.
    assert!(html.contains("steps=8<"), "the cheapest setting");
}

#[test]
fn a_report_without_techniques_has_neither_plots_nor_grid() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let more = ["--report", "rep", "--method", "truth-shadow-map"];
    let output = xtask(folder.path(), &[&TINY[..], &more].concat());
    assert_eq!(code(&output), 0);
    let html = std::fs::read_to_string(folder.path().join("rep/report.html")).unwrap();
    assert!(
        html.contains("truth-shadow-map") && !html.contains("<svg ") && !html.contains("class=\"stress\"")
    );
}

#[test]
fn methods_lists_references_and_techniques_with_their_options() {
    let folder = tempfile::tempdir().unwrap();
    let list = json(&xtask(folder.path(), &["methods", "--json"]));
    let ids: Vec<&str> = list.as_array().unwrap().iter().map(|entry| entry["id"].as_str().unwrap()).collect();
    assert!(["truth-raycast", "truth-shadow-map", "raymarch"].iter().all(|id| ids.contains(id)), "{ids:?}");
    let march = list.as_array().unwrap().iter().find(|entry| entry["id"] == "raymarch").unwrap();
    assert!(march["options"].as_array().unwrap().iter().any(|option| option["key"] == "steps"));
}

#[test]
fn shots_tells_triangles_light_and_depth() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let list = json(&xtask(folder.path(), &["shots", "--shot", "wall.toml", "--json"]));
    let entry = &list[0];
    assert_eq!((&entry["name"], &entry["triangles"]), (&Value::from("wall"), &Value::from(4)));
    assert_eq!(entry["lights"], serde_json::json!(["directional"]));
    // σt = 0.05; the longest ray is the one that ends at max_distance = 30, or earlier.
    let depth = entry["optical_depth"].as_f64().unwrap();
    assert!(depth > 0.0 && depth <= 1.5 + 1e-6, "{depth}");
}
