//! `--device gpu`, `--gpu-adapter` and `gpu-report`, on whatever driver there is. SKIPPED without one, unless
//! `SCATTER_GPU=required`.

use super::*;

/// True, and said, where there is no adapter.
fn skipped(folder: &Path) -> bool {
    let output = xtask(folder, &["gpu-report", "--list"]);
    if code(&output) == 0 {
        return false;
    }
    let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
    assert!(!required, "SCATTER_GPU=required, and there is no adapter");
    println!("SKIPPED: no adapter");
    true
}

/// The one line of ours: drivers write lines of their own before it.
#[track_caller]
fn last_error_line(folder: &Path, arguments: &[&str]) -> String {
    let output = xtask(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(code(&output), 2, "{arguments:?}: {stderr}");
    let line = stderr.lines().last().unwrap_or_default();
    assert!(line.starts_with("error: "), "{arguments:?}: {stderr}");
    line.to_string()
}

#[test]
fn a_card_that_is_not_there_is_one_error_that_lists_those_that_are() {
    let folder = tempfile::tempdir().unwrap();
    if skipped(folder.path()) {
        return;
    }
    let on_gpu = ["--device", "gpu", "--gpu-adapter", "no such card"];
    for command in [
        vec!["validate", "--shot", "comb"],
        vec!["render", "--shot", "comb", "--json"],
        vec!["stress", "--row", "sun, known"],
    ] {
        let error = last_error_line(folder.path(), &[command, on_gpu.to_vec()].concat());
        assert!(error.contains("--gpu-adapter no such card") && error.contains("0: "), "{error}");
    }
    let error = last_error_line(folder.path(), &["stress", "--gpu-adapter", "0"]);
    assert!(error.contains("add --device gpu"), "{error}");
}

#[test]
fn a_twins_distance_stands_beside_the_distance_from_truth() {
    let folder = tempfile::tempdir().unwrap();
    if skipped(folder.path()) {
        return;
    }
    let shot = ["--shot", "comb", "--size", "49x37", "--shadow-map", "64", "--threads", "1"];
    let on_gpu = ["validate", "--json", "--device", "gpu", "--gpu-adapter", "0", "--method", "minmax-mipmap"];
    let output = xtask(folder.path(), &[&on_gpu[..], &shot].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let row = &document["rows"][0];
    assert_eq!(
        (&row["method"], &row["twin"]["method"]),
        (&"minmax-mipmap@gpu".into(), &"minmax-mipmap".into())
    );
    let twin = row["twin"]["rel_rmse"].as_f64().unwrap();
    // Two programs: equal to the bit it would be one image compared with itself.
    assert!(twin > 0.0 && twin < 1e-4, "{row}");
}

#[test]
fn extremes_run_on_the_gpu() {
    let folder = tempfile::tempdir().unwrap();
    if skipped(folder.path()) {
        return;
    }
    let rows = ["stress", "--json", "--device", "gpu", "--row", "sun, known", "--row", "bad input"];
    let output = xtask(folder.path(), &[&rows[..], &["--threads", "1"]].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let of = |method: &str| {
        document["rows"].as_array().unwrap().iter().filter(|row| row["method"] == method).count()
    };
    assert_eq!((of("raymarch@gpu"), of("minmax-mipmap@gpu")), (31, 31));
}

#[test]
fn the_quick_report_of_a_card_is_right_and_claims_no_times_of_a_software_driver() {
    let folder = tempfile::tempdir().unwrap();
    if skipped(folder.path()) {
        return;
    }
    let output = xtask(folder.path(), &["gpu-report", "--quick", "--repeat", "2", "--out", "rep"]);
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(code(&output), 0, "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(&folder.path().join("rep")), ["gpu-report.json", "gpu-report.txt"]);
    let written = std::fs::read_to_string(folder.path().join("rep/gpu-report.json")).unwrap();
    let report: Value = serde_json::from_str(&written).unwrap();
    let times = report["times"].as_array().unwrap();
    let timed = times.iter().filter(|frame| frame["refused"].is_null());
    assert!(
        timed.clone().count() >= 9 && timed.clone().all(|frame| frame["passes"][0]["workgroups"] == 84),
        "{text}"
    );
    assert!(report["functions"].as_array().unwrap().iter().all(|check| check["right"] == true));
    if report["emulated"] == true {
        let brackets = |line: &&str| line.trim_start().starts_with("frame");
        assert!(text.lines().filter(brackets).all(|line| line.contains('(')), "{text}");
        assert!(text.contains("not a GPU's"), "{text}");
    }
}
