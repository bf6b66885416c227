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
