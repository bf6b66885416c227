//! `validate --image`: images that other renderers made.

use super::*;
use scatter_scene::read_exr;

/// The wall's exact image, in `truth.exr`.
fn write_truth(folder: &Path) -> RadianceImage {
    write_shot(folder);
    let arguments = [
        "render",
        "--shot",
        "wall.toml",
        "--method",
        "truth-raycast",
        "--shadow-map",
        "32",
        "--out",
        "truth.exr",
    ];
    assert_eq!(code(&xtask(folder, &arguments)), 0);
    read_exr(&folder.join("truth.exr")).expect("it was written")
}

const GRADE: [&str; 5] = ["validate", "--shot", "wall.toml", "--shadow-map", "32"];

fn grade(folder: &Path, image: &str, more: &[&str]) -> Output {
    xtask(folder, &[&GRADE[..], &["--image", image], more].concat())
}

#[test]
fn an_image_is_graded_with_the_figures_of_compare_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let truth = write_truth(folder.path());
    // A tenth too bright everywhere: rel_rmse, p99 and bias against ray-cast truth follow by hand.
    write_image(&folder.path().join("mine.exr"), truth.size, |x, y| {
        truth.pixels[(y * truth.size[0] + x) as usize].map(|v| 1.1 * v)
    });
    let output = grade(folder.path(), "mine.exr", &["--json"]);
    let document = json(&output);
    assert_eq!(code(&output), 0, "{document}");
    let rows = document["rows"].as_array().unwrap();
    let row = rows.iter().find(|row| row["method"] == "mine.exr").unwrap();
    let figures = &row["errors"]["raycast"];
    let value = |name: &str| figures[name].as_f64().unwrap();
    assert!((value("bias") - 0.1).abs() < 1e-6 && (value("max") - 0.1).abs() < 1e-6, "{figures}");
    let rms = |f: fn(f64) -> f64| {
        let values = truth.pixels.iter().flatten().map(|&v| f(f64::from(v)));
        values.sum::<f64>() / (3 * truth.pixels.len()) as f64
    };
    assert!((value("rel_rmse") - 0.1 * rms(|v| v * v).sqrt() / rms(f64::abs)).abs() < 1e-6, "{figures}");
    assert!(row["errors"]["shadow_map"]["rel_rmse"].is_number(), "both truths");
    assert!(row["time_ms"].as_object().unwrap().is_empty() && row["level"].is_null(), "{row}");
    assert_eq!(rows.len(), 2, "no technique was asked for: the map's row and the image's");
    assert!(!folder.path().join("mine.difference.png").exists(), "nobody asked for a picture");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("mine.exr: part 1 of 1, channels R, G, B\n"), "{said}");
}

#[test]
fn the_table_says_which_level_an_image_reaches_or_that_it_is_identical() {
    let folder = tempfile::tempdir().unwrap();
    let truth = write_truth(folder.path());
    let text = |image: &str, more: &[&str]| {
        let output = grade(folder.path(), image, more);
        let text = String::from_utf8(output.stdout.clone()).unwrap();
        assert_eq!(code(&output), 0, "{text}");
        text.lines().find(|line| line.contains(image)).expect("its row").to_string()
    };
    assert!(text("truth.exr", &[]).contains("  identical to truth-raycast"));
    for (factor, words) in [(1.005, "reaches film"), (1.02, "reaches game"), (1.5, "misses preview")] {
        write_image(&folder.path().join("mine.exr"), truth.size, |x, y| {
            truth.pixels[(y * truth.size[0] + x) as usize].map(|v| factor * v)
        });
        let line = text("mine.exr", &["--difference", "d.png", "--report", "rep"]);
        assert!(line.contains(words), "{line}");
    }
    let html = std::fs::read_to_string(folder.path().join("rep/report.html")).unwrap();
    assert!(html.contains("mine.exr − truth-raycast"));
    assert!(std::fs::read(folder.path().join("d.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(!folder.path().join("rep/mine.difference.png").exists(), "it went where it was told to");
    text("mine.exr", &["--report", "other"]);
    assert!(folder.path().join("other/mine.difference.png").exists());
    assert!(!folder.path().join("mine.difference.png").exists());
}

#[test]
fn images_that_cannot_be_graded_are_one_line_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    write_shot(folder.path());
    write_image(&folder.path().join("wide.exr"), [9, 6], |_, _| [1.0; 3]);
    write_image(&folder.path().join("nan.exr"), [8, 6], |x, y| {
        if (x, y) == (3, 2) { [1.0, f32::NAN, 1.0] } else { [1.0; 3] }
    });
    std::fs::write(folder.path().join("text.exr"), "no image").unwrap();
    let line = |image: &str| error_line(folder.path(), &[&GRADE[..], &["--image", image]].concat());
    let size = line("wide.exr");
    assert!(
        size.contains("wide.exr: the image is 9x6 and wall is 8x6") && size.contains("--size 9x6"),
        "{size}"
    );
    let nan = line("nan.exr");
    assert!(nan.contains("nan.exr: 1 pixels are not finite, the first at column 3, row 2"), "{nan}");
    assert!(line("text.exr").contains("text.exr"));
    assert!(line("none.exr").contains("none.exr"));
    assert!(error_line(folder.path(), &["validate", "--image", "nan.exr"]).contains("give one --shot"));
    assert!(
        error_line(folder.path(), &[&GRADE[..], &["--difference", "d.png"]].concat()).contains("--image")
    );
    let unwritable = [&GRADE[..], &["--image", "wide.exr", "--difference", "no/d.png"]].concat();
    assert!(error_line(folder.path(), &unwritable).contains("the folder no does not exist"));
    assert_eq!(names(folder.path()), ["nan.exr", "text.exr", "wall.obj", "wall.toml", "wide.exr"]);
}
