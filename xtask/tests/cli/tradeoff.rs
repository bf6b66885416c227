//! `tradeoff`: its documents, its tables, its files.

use super::*;

const TINY: [&str; 7] = ["tradeoff", "--shot", "wall.toml", "--shadow-map", "32", "--method", "raymarch"];

#[test]
fn the_document_has_every_setting_and_the_time_to_each_level() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let output = xtask(folder.path(), &[&TINY[..], &["--json", "--threads", "2"]].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    assert!(document["machine"]["cpu"].is_string());
    let rows = document["rows"].as_array().unwrap();
    assert!(rows.len() >= 5, "{rows:?}");
    for row in rows {
        for truth in ["shadow_map", "raycast"] {
            for figure in ["rel_rmse", "p99", "bias", "non_finite"] {
                assert!(row["errors"][truth][figure].is_number(), "{truth} {figure}: {row}");
            }
        }
        assert!(
            row["time_ms"]["total"].as_f64() > Some(0.0)
                && row["time_ms_one_thread"]["total"].as_f64() > Some(0.0)
        );
        assert!(row["memory_bytes"].is_u64() && row["counts"].is_object() && row["front"].is_boolean());
        assert_eq!((&row["verdict"], &row["threads"]), (&Value::from("ok"), &Value::from(2)));
    }
    assert!(rows.iter().any(|row| row["front"] == true));
    // The same setting under two names is one row.
    let settings: Vec<String> = rows.iter().map(|row| row["setting"].to_string()).collect();
    let preset = settings.iter().find(|setting| setting.contains("preview")).unwrap();
    assert!(!settings.iter().any(|other| other != preset && other.contains("preview")), "{settings:?}");
    let levels = document["levels"].as_array().unwrap();
    let names: Vec<&str> = levels.iter().map(|row| row["level"].as_str().unwrap()).collect();
    assert_eq!(names, ["preview", "game", "film"]);
    for row in levels {
        assert_eq!(row["reached"]["one_thread_ratio"], 1.0, "the marcher against itself: {row}");
    }
}

#[test]
fn tables_plot_and_page_are_written() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let more = ["--repeat", "1", "--plot", "p.svg", "--plot-shot", "wall", "--report", "rep"];
    let output = xtask(folder.path(), &[&TINY[..], &more].concat());
    let stdout = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(code(&output), 0, "{stdout}");
    assert!(stdout.contains("steps=8 ") && stdout.contains("game (3 %) ms"), "{stdout}");
    assert_eq!(names(folder.path()), ["p.svg", "rep", "wall.obj", "wall.toml"]);
    let svg = std::fs::read_to_string(folder.path().join("p.svg")).unwrap();
    assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n") && svg.contains("raymarch"));
    assert_eq!(names(&folder.path().join("rep")), ["tradeoff.html"]);
    let html = std::fs::read_to_string(folder.path().join("rep/tradeoff.html")).unwrap();
    assert!(html.contains("<svg ") && html.contains("steps=8<") && html.contains("--plot-shot wall"));
    let markdown = xtask(folder.path(), &[&TINY[..], &["--repeat", "1", "--markdown"]].concat());
    let markdown = String::from_utf8(markdown.stdout).unwrap();
    assert!(
        markdown.starts_with("| shot | method |") && markdown.contains("\n| wall | raymarch | "),
        "{markdown}"
    );
}

#[test]
fn scaling_has_five_sizes_and_their_slope() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let arguments = ["--scaling", "--json", "--size", "48x36", "--shadow-map", "64", "--method", "raymarch"];
    let output = xtask(folder.path(), &[&TINY[..3], &arguments].concat());
    let document = json(&output);
    let rows = document["rows"].as_array().unwrap();
    let sizes: Vec<String> =
        rows.iter().map(|row| format!("{}, {}", row["size"], row["shadow_map"])).collect();
    assert_eq!(sizes, ["[48,36], 64", "[34,25], 45", "[24,18], 32", "[17,13], 23", "[12,9], 16"]);
    let steps: Vec<f64> =
        rows.iter().map(|row| row["options"]["steps"].as_str().unwrap().parse().unwrap()).collect();
    assert!((steps[2] - 0.5 * steps[0]).abs() <= 0.5, "half the side, half the steps: {steps:?}");
    let slopes = document["slopes"].as_array().unwrap();
    assert_eq!(slopes.len(), 2, "of the shot, and of all");
    assert!(slopes[0]["fit"]["slope"].is_number() && slopes[1]["shot"].is_null());
}

#[test]
fn motion_tells_the_flicker_of_technique_map_and_truth() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let more = ["--motion", "--json", "--method", "truth-shadow-map"];
    let document = json(&xtask(folder.path(), &[&TINY[..], &more].concat()));
    let rows = document["rows"].as_array().unwrap();
    let methods: Vec<&str> = rows.iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["truth-shadow-map", "raymarch"]);
    for row in rows {
        assert_eq!((&row["frames"], &row["light_turned"]), (&Value::from(16), &Value::from(true)));
        for figure in ["flicker", "truth_flicker", "rel_rmse"] {
            assert!(row[figure].as_f64().is_some_and(|value| value > 0.0 && value < 10.0), "{figure}: {row}");
        }
    }
    assert_eq!((&rows[1]["level"], &rows[1]["non_finite"]), (&Value::from("game"), &Value::from(0)));
}

#[test]
fn what_cannot_be_traded_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let line =
        |more: &[&str]| error_line(folder.path(), &[&["tradeoff", "--shot", "wall.toml"], more].concat());
    assert!(line(&["--method", "truth-raycast"]).contains("no settings"));
    assert!(line(&["--scaling", "--motion"]).contains("cannot be used"));
    assert!(line(&["--plot", "no/p.svg"]).contains("does not exist"));
    assert!(line(&["--plot-shot", "wall"]).contains("--plot"));
    assert!(line(&["--set", "stps=9"]).contains("no option 'stps'"));
    assert_eq!(names(folder.path()), ["wall.obj", "wall.toml"]);
}
