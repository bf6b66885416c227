//! `--cascades`: a sun's map as several, on every command that takes shots; a lamp keeps its own, and says so.

use super::*;

/// A sun's shot made into a lamp's.
fn write_lamp(folder: &Path) {
    let sun = std::fs::read_to_string(folder.join("wall.toml")).unwrap();
    let lamp = sun
        .replace("\"directional\"", "\"point\"")
        .replace("direction = [0.4, -1.0, 0.5]", "position = [0.4, 3.0, 1.5]")
        .replace("irradiance", "intensity");
    std::fs::write(folder.join("lamp.toml"), lamp).unwrap();
}

#[test]
fn a_count_out_of_range_says_what_is_in_it() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    for command in ["render", "validate", "tradeoff", "shots"] {
        for count in ["0", "1", "17", "-4", "4.0"] {
            let line =
                error_line(folder.path(), &[command, "--shot", "wall.toml", &format!("--cascades={count}")]);
            assert!(line.contains("give 2 to 16 cascades") && line.contains("--cascades"), "{line}");
        }
    }
    let alone = error_line(folder.path(), &["shots", "--shot", "wall.toml", "--shadow-map", "64"]);
    assert!(alone.contains("add --cascades"), "{alone}");
    let large = ["shots", "--shot", "wall.toml", "--shadow-map", "16384", "--cascades", "4"];
    let large = error_line(folder.path(), &large);
    assert!(large.contains("32768x32768") && large.contains("smaller --shadow-map"), "{large}");
}

#[test]
fn a_rows_cascades_are_a_suns() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    write_lamp(folder.path());
    let render = |shot: &str, more: &[&str]| {
        let base =
            ["render", "--shot", shot, "--json", "--method", "epipolar", "--compare", "--shadow-map", "32"];
        xtask(folder.path(), &[&base[..], more].concat())
    };
    let one = json(&render("wall.toml", &[]));
    assert!(one["cascades"].is_null());
    let sun = render("wall.toml", &["--cascades", "3"]);
    let row = json(&sun);
    assert_eq!((&row["shadow_map"], &row["cascades"]), (&Value::from(32), &Value::from(3)), "{row}");
    assert!(!String::from_utf8_lossy(&sun.stderr).contains("note"), "nothing to note");
    let error = |row: &Value| row["errors"]["shadow_map"]["rel_rmse"].as_f64().unwrap();
    assert!(error(&row) < 0.03, "{row}");
    assert_ne!(error(&row), error(&one), "other maps");
    let lamp = render("lamp.toml", &["--cascades", "3"]);
    let stderr = String::from_utf8_lossy(&lamp.stderr).into_owned();
    assert!(json(&lamp)["cascades"].is_null() && code(&lamp) == 0);
    assert_eq!(stderr.matches("note: lamp: --cascades 3 is for a sun's map").count(), 1, "{stderr}");
    assert_eq!(json(&lamp)["errors"], json(&render("lamp.toml", &[]))["errors"], "the same map");
}

#[test]
fn validate_judges_cascades_and_a_baseline_of_one_map_is_another_run() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    let base = ["validate", "--shot", "wall.toml", "--shadow-map", "32"];
    let run = |more: &[&str]| xtask(folder.path(), &[&base[..], more].concat());
    let table = String::from_utf8(run(&["--cascades", "4"]).stdout).unwrap();
    assert!(table.contains("shadow map 4 cascades of 32x32;"), "{table}");
    let cascaded = run(&["--cascades", "4", "--json"]);
    assert_eq!(code(&cascaded), 0);
    assert!(json(&cascaded)["rows"].as_array().unwrap().iter().all(|row| row["cascades"] == 4));
    std::fs::write(folder.path().join("before.json"), &cascaded.stdout).unwrap();
    assert_eq!(code(&run(&["--cascades", "4", "--baseline", "before.json"])), 0);
    let other = error_line(folder.path(), &[&base[..], &["--baseline", "before.json"]].concat());
    assert!(other.contains("before.json: none of its "), "{other}");
}

#[test]
fn shots_prints_the_maps_own_error_with_one_map_and_with_cascades() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    write_lamp(folder.path());
    let arguments =
        ["shots", "--shot", "wall.toml", "--shot", "lamp.toml", "--cascades", "4", "--shadow-map", "32"];
    let document = json(&xtask(folder.path(), &[&arguments[..], &["--json"]].concat()));
    let (sun, lamp) = (&document[0]["map_error"], &document[1]["map_error"]);
    assert!(lamp.is_null(), "{lamp}");
    assert_eq!(
        (&sun["one_map"]["shadow_map"], &sun["one_map"]["cascades"]),
        (&Value::from(64), &Value::from(1))
    );
    assert_eq!(
        (&sun["cascades"]["shadow_map"], &sun["cascades"]["cascades"]),
        (&Value::from(32), &Value::from(4))
    );
    for map in ["one_map", "cascades"] {
        assert!(
            sun[map]["error"]["rel_rmse"].as_f64().unwrap() > 0.0 && sun[map]["maps_ms"].is_number(),
            "{sun}"
        );
    }
    // What is printed for cascades is what `validate` finds.
    let row =
        ["render", "--shot", "wall.toml", "--method", "truth-shadow-map", "--compare", "raycast", "--json"];
    let row = json(&xtask(folder.path(), &[&row[..], &["--cascades", "4", "--shadow-map", "32"]].concat()));
    assert_eq!(row["errors"]["raycast"], sun["cascades"]["error"]);
    let text = String::from_utf8(xtask(folder.path(), &arguments).stdout).unwrap();
    assert!(
        text.contains("one map %   4 cascades %")
            && text.contains("64x64 texels and with 4 cascades of 32x32"),
        "{text}"
    );
}
