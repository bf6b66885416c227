//! `validate --baseline`: a run against an earlier one.

use super::*;

const RUN: [&str; 7] = ["validate", "--shot", "wall.toml", "--shadow-map", "32", "--set", "steps=4096"];

/// A run's document, written to `before.json` after `change`.
fn write_baseline(folder: &Path, change: impl Fn(&mut Value)) {
    write_shot(folder);
    let mut document = json(&xtask(folder, &[&RUN[..], &["--json"]].concat()));
    change(&mut document);
    std::fs::write(folder.join("before.json"), document.to_string()).expect("written");
}

fn against_baseline(folder: &Path, more: &[&str]) -> (i32, String) {
    let output = xtask(folder, &[&RUN[..], &["--baseline", "before.json"], more].concat());
    let text = [output.stdout.clone(), output.stderr.clone()].concat();
    (code(&output), String::from_utf8(text).expect("UTF-8"))
}

#[test]
fn the_same_run_again_is_no_worse() {
    let folder = tempfile::tempdir().unwrap();
    write_baseline(folder.path(), |_| ());
    let (exit, text) = against_baseline(folder.path(), &[]);
    assert_eq!(exit, 0, "{text}");
    assert!(text.contains("against before.json:") && text.contains("rows compared, 0 worse"), "{text}");
    let line = text.lines().find(|line| line.starts_with("raymarch on wall (game)")).unwrap();
    assert!(line.contains("time ×"), "{line}");
}

#[test]
fn an_error_that_grew_is_exit_code_1_and_named() {
    let folder = tempfile::tempdir().unwrap();
    write_baseline(folder.path(), |document| {
        for row in
            document["rows"].as_array_mut().unwrap().iter_mut().filter(|row| row["method"] == "raymarch")
        {
            row["errors"]["shadow_map"]["rel_rmse"] = 1e-9.into();
        }
    });
    let (exit, text) = against_baseline(folder.path(), &["--report", "rep", "--row", "image size"]);
    assert_eq!(exit, 1, "{text}");
    assert!(
        text.contains("WORSE raymarch on wall (game): shadow_map.rel_rmse grew from 1.0000e-9"),
        "{text}"
    );
    let html = std::fs::read_to_string(folder.path().join("rep/report.html")).unwrap();
    assert!(html.contains(">Against before.json</h2>") && html.contains("WORSE raymarch on wall"));
    let output = xtask(folder.path(), &[&RUN[..], &["--baseline", "before.json", "--json"]].concat());
    assert_eq!(code(&output), 1);
    let baseline = &json(&output)["baseline"];
    let before: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("before.json")).unwrap()).unwrap();
    let count = |document: &Value| document["rows"].as_array().unwrap().len();
    assert_eq!(count(baseline), count(&before), "stdout is one document: {baseline}");
}

#[test]
fn rows_that_only_one_run_has_are_said_and_are_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    write_baseline(folder.path(), |document| {
        let rows = document["rows"].as_array_mut().unwrap();
        rows.iter_mut().find(|row| row["method"] == "raymarch").unwrap()["method"] = "gone".into();
    });
    let (exit, text) = against_baseline(folder.path(), &[]);
    assert_eq!(exit, 0, "{text}");
    assert!(text.contains("only in the baseline, not run now: gone on wall (game)"), "{text}");
    assert!(text.contains("not in the baseline: raymarch on wall (game)"), "{text}");
}

#[test]
fn a_baseline_that_cannot_be_used_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    write_baseline(folder.path(), |document| {
        for row in document["rows"].as_array_mut().unwrap() {
            row["shot"] = "other".into();
        }
    });
    let line = |file: &str| error_line(folder.path(), &[&RUN[..], &["--baseline", file]].concat());
    let nothing = line("before.json");
    assert!(
        nothing.contains("before.json: none of its ") && nothing.contains(" rows was run now"),
        "{nothing}"
    );
    std::fs::write(folder.path().join("bad.json"), "{\"rows\": [{\n\"shot\": 3}]}").unwrap();
    let bad = line("bad.json");
    assert!(bad.contains("bad.json: ") && bad.contains("line 2") && bad.contains("validate --json"), "{bad}");
    assert!(line("none.json").contains("none.json: cannot be read"));
}
