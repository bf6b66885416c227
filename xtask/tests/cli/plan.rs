//! `plan`, the machine's file and `--method auto`, from outside.

use crate::{code, error_line, json, names, write_shot, xtask};

const SMALL: [&str; 6] = ["--shot", "wall.toml", "--shadow-map", "32", "--threads", "1"];

#[test]
fn a_plan_says_what_it_predicts_and_the_check_what_was_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    write_shot(folder.path());
    let output =
        xtask(folder.path(), &[&["plan", "--error", "game", "--check", "--json"], &SMALL[..]].concat());
    assert_eq!(code(&output), 0);
    let document = json(&output);
    let pass = &document["passes"][0];
    assert!(pass["predicted"]["time_ms"].as_f64().expect("a time") > 0.0);
    let sentence = pass["sentence"].as_str().expect("a sentence");
    assert!(sentence.contains(pass["method"].as_str().expect("a method")), "{sentence}");
    assert!(!pass["rejected"].as_array().expect("a list").is_empty());
    assert!(document["measured"]["p99"].as_f64().expect("an error") <= 0.03);
}

#[test]
fn auto_names_what_was_chosen_and_what_was_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    write_shot(folder.path());
    let row = json(&xtask(folder.path(), &[&["render", "--method", "auto", "--json"], &SMALL[..]].concat()));
    assert_eq!(row["requested"], "auto");
    assert_ne!(row["method"], "auto");
    assert!(!row["options"].as_object().expect("options").is_empty());
    let time = |stage: &str| row["time_ms"][stage].as_f64().expect("a time");
    assert!(time("plan") > 0.0 && time("plan") < time("total"));
    let rows =
        json(&xtask(folder.path(), &[&["validate", "--method", "auto", "--json"], &SMALL[..]].concat()));
    let rows = rows["rows"].as_array().expect("rows");
    assert!(rows.len() == 1 && rows[0]["requested"] == "auto" && rows[0]["verdict"] == "ok", "{rows:?}");
}

#[test]
fn the_survey_holds_plans_against_what_was_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    write_shot(folder.path());
    let run = |more: &[&str]| {
        json(&xtask(folder.path(), &[&["plan", "--survey", "--json"], more, &SMALL[..]].concat()))
    };
    let survey = run(&["--method", "minmax-mipmap", "--method", "raymarch"]);
    let list = |name: &str| survey[name].as_array().unwrap_or_else(|| panic!("no {name}")).clone();
    assert_eq!([list("rows").len(), list("auto").len(), list("times").len()], [6, 3, 3]);
    for row in list("times") {
        // The budget is a tenth more than a row took, so that there is always something within it.
        assert!(row["best_error"].is_number() && row["time_ms"].as_f64().expect("a time") > 0.0, "{row}");
    }
    let maps = &run(&["--check"])["maps"];
    let error = |name: &str| maps[0][name].as_f64().expect("an error");
    // A wall before a sun, 32 texels a side: every map's error is there, and a factor of ten tells it from none.
    let ratio = error("error") / error("predicted_error");
    println!("the map is off by {:.3} %, {ratio:.2} times what was predicted", 100.0 * error("error"));
    assert!(error("error") > 0.0 && ratio > 0.1 && ratio < 10.0, "{maps}");
}

#[test]
fn what_is_wrong_is_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    write_shot(folder.path());
    std::fs::write(folder.path().join("machine.toml"), "name = \"m\"\ntechnique = 3\n").expect("written");
    let cases: [(&[&str], &str); 7] = [
        (&["plan", "--error", "fine"], "--error fine: give preview, game, film"),
        (&["plan", "--error", "2"], "error 2 is no budget"),
        (&["plan", "--time", "0"], "time 0 is no budget"),
        (&["plan", "--machine", "machine.toml"], "run cargo xtask calibrate anew"),
        (&["plan", "--machine", "none.toml"], "none.toml"),
        (&["render", "--method", "auto", "--json", "--machine", "machine.toml"], "machine.toml"),
        (&["render", "--method", "auto", "--json", "--set", "steps=3"], "auto have no options"),
    ];
    for (arguments, words) in cases {
        let line = error_line(folder.path(), &[arguments, &SMALL[..]].concat());
        assert!(line.contains(words), "{line}");
    }
    assert!(error_line(folder.path(), &["plan", "--error", "game"]).contains("--shot"));
    assert_eq!(names(folder.path()), ["machine.toml", "wall.obj", "wall.toml"]);
}
