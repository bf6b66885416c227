//! `stress` and `validate --mutants`: their documents, the page, and wrong command lines.

use super::*;

#[test]
fn the_stress_document_has_a_row_for_every_cell() {
    let folder = tempfile::tempdir().unwrap();
    // Of the marcher alone: whether other techniques keep their rows is the matrix' business, not this test's.
    let arguments = ["stress", "--json", "--row", "bad input", "--row", "sun, known", "--threads", "1"];
    let output = xtask(folder.path(), &[&arguments[..], &["--method", "raymarch"]].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let rows = document["rows"].as_array().unwrap();
    let of = |method: &str| rows.iter().filter(|row| row["method"] == method).count();
    // Twelve integrals and nineteen refusals.
    assert_eq!((of("truth-shadow-map"), of("raymarch")), (31, 31));
    let integral = rows.iter().find(|row| row["shot"] == "σ = 0.1, s = 20").unwrap();
    assert!(integral["error"].as_f64().unwrap() < 1e-6 && integral["verdict"] == "ok", "{integral}");
    let refusal = rows.iter().find(|row| row["shot"] == "g = 1").unwrap();
    assert!(refusal["error"].is_null() && refusal["verdict"] == "ok", "{refusal}");
}

#[test]
fn the_stress_page_is_one_file_and_the_table_fits() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        xtask(folder.path(), &["stress", "--report", "rep", "--row", "image size", "--method", "raymarch"]);
    let stdout = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(code(&output), 0, "{stdout}");
    assert_eq!(names(&folder.path().join("rep")), ["stress.html"]);
    let html = std::fs::read_to_string(folder.path().join("rep/stress.html")).unwrap();
    assert!(html.contains("<table class=\"stress\">") && html.contains("--row image size"));
    assert!(stdout.lines().skip(2).all(|line| line.chars().count() <= 110), "{stdout}");
    assert!(stdout.contains("1x37, sun"), "{stdout}");
}

#[test]
fn rows_and_methods_that_do_not_exist_are_errors_of_one_line() {
    let folder = tempfile::tempdir().unwrap();
    assert!(error_line(folder.path(), &["stress", "--row", "no such row"]).contains("--row"));
    assert!(error_line(folder.path(), &["stress", "--method", "marcher"]).contains("raymarch"));
    assert!(error_line(folder.path(), &["stress", "--method", "truth-raycast"]).contains("shadow maps"));
    error_line(folder.path(), &["validate", "--mutants", "--shot", "nave"]);
}

#[test]
fn mutants_are_rejected_by_name() {
    let folder = tempfile::tempdir().unwrap();
    // The reference's mutants alone: references are no techniques.
    let output = xtask(folder.path(), &["validate", "--mutants", "--json", "--method", "truth-shadow-map"]);
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let rows = document["rows"].as_array().unwrap();
    assert!(rows.iter().all(|row| row["verdict"] == "rejected"), "{document}");
    // Of inputs and outputs, of the physics, of a technique's stages.
    for name in
        ["one pixel 1 % too bright", "1/d² of the lamp left out", "prefix sum of light rays off by one"]
    {
        assert_eq!(rows.iter().filter(|row| row["mutant"] == name).count(), 1, "{name}");
    }
    let flipped = rows.iter().find(|row| row["mutant"] == "g's sign flipped").unwrap();
    assert_eq!(flipped["rung"], "phase functions: g = 0.5, sun");
    assert!(flipped["wrong"].as_str().unwrap().starts_with("FAIL: largest error"), "{flipped}");
}

const SAMPLING: [&str; 6] = ["stress", "--method", "minmax-mipmap", "--set", "mode=sampling", "--row"];

#[test]
fn options_by_hand_stand_in_the_document_and_a_mode_without_a_promise_is_not_judged_by_its_error() {
    let folder = tempfile::tempdir().unwrap();
    let output = xtask(folder.path(), &[&SAMPLING[..], &["sun, known", "--json"]].concat());
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let rows = document["rows"].as_array().unwrap();
    let row = |method: &str, name: &str| {
        rows.iter().find(|row| row["method"] == method && row["shot"] == name).unwrap()
    };
    let (lit, slit) = ("σ = 0.1, s = 20", "lit on [1e4, 1e4 + 1] alone, σ = 1e-3");
    for name in [lit, slit] {
        let mode = row("minmax-mipmap", name);
        assert_eq!(
            (&mode["options"]["mode"], &mode["overrides"]["mode"]),
            (&"sampling".into(), &"sampling".into())
        );
        assert_eq!(row("truth-shadow-map", name)["overrides"], serde_json::json!({}));
    }
    // Where nothing casts a shadow the mode is held to the closed form; a slit between samples it misses.
    assert_eq!(row("minmax-mipmap", lit)["verdict"], "ok");
    let missed = row("minmax-mipmap", slit);
    assert!(missed["verdict"].as_str().unwrap().contains("no error is promised"), "{missed}");
    assert!(missed["error"].as_f64().unwrap() > 0.01 && missed["level"].is_null(), "{missed}");
}

#[test]
fn options_by_hand_stand_above_the_table_and_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let output = xtask(folder.path(), &[&SAMPLING[..], &["sun, known", "--report", "rep"]].concat());
    let stdout = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(code(&output), 0, "{stdout}");
    assert!(stdout.contains("minmax-mipmap with mode=sampling; ~: off by so much"), "{stdout}");
    assert!(stdout.contains(" without a promise, ") && stdout.contains("  ~ "), "{stdout}");
    let html = std::fs::read_to_string(folder.path().join("rep/stress.html")).unwrap();
    assert!(html.contains("Options by hand: minmax-mipmap with mode=sampling."));
    assert!(html.contains("class=\"unpromised\""));
}

#[test]
fn a_mode_that_promises_an_error_is_held_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["stress", "--method", "raymarch", "--set", "jitter=7", "--row", "sun, known", "--json"];
    let output = xtask(folder.path(), &arguments);
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let marched = document["rows"].as_array().unwrap().iter().filter(|row| row["method"] == "raymarch");
    assert!(marched.clone().all(|row| row["verdict"] == "ok" && row["overrides"]["jitter"] == "7"));
    assert!(marched.count() == 12, "{document}");
}

#[test]
fn options_that_nobody_has_or_takes_are_the_same_error_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let commands = [&["stress"][..], &["validate", "--mutants"], &["tradeoff"]];
    let lines = |more: &[&str]| commands.map(|command| error_line(folder.path(), &[command, more].concat()));
    let same = |more: &[&str]| {
        let [stress, mutants, tradeoff] = lines(more);
        assert_eq!((&stress, &mutants), (&tradeoff, &tradeoff));
        stress
    };
    let unknown = same(&["--method", "raymarch", "--set", "stps=9"]);
    assert!(unknown.contains("--set stps=9: raymarch has no option 'stps'; it has: steps"), "{unknown}");
    let value = same(&["--method", "minmax-mipmap", "--set", "mode=guess"]);
    assert!(
        value.contains("--set: minmax-mipmap: option mode is 'guess'; give exact, sampling or slices"),
        "{value}"
    );
    // What two options mean together.
    let both = same(&["--method", "filtered-prefix", "--set", "basis=moments", "--set", "coefficients=5"]);
    assert!(both.contains("filtered-prefix: option coefficients is '5'"), "{both}");
    // Of all techniques one has it, and does not take the value.
    assert!(same(&["--set", "mode=guess"]).contains("minmax-mipmap: option mode is 'guess'"));
    for command in [&["stress"][..], &["validate", "--mutants"]] {
        let line = error_line(
            folder.path(),
            &[command, &["--method", "truth-shadow-map", "--set", "steps=8"]].concat(),
        );
        assert!(line.contains("--set steps=8: references and auto have no options"), "{line}");
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn mutants_of_a_mode_are_rejected_beside_the_mode() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["validate", "--mutants", "--method", "minmax-mipmap", "--set", "mode=slices", "--json"];
    let output = xtask(folder.path(), &arguments);
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let rows = document["rows"].as_array().unwrap();
    let of_mode: Vec<_> = rows.iter().filter(|row| row["method"] == "minmax-mipmap").collect();
    assert!(of_mode.iter().all(|row| row["overrides"]["mode"] == "slices" && row["verdict"] == "rejected"));
    let shifted = of_mode.iter().find(|row| row["mutant"] == "light matrix off by half a texel").unwrap();
    assert!(shifted["correct"].as_str().unwrap().contains("no error is promised"), "{shifted}");
}
