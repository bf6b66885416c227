//! `compare` against figures computed by hand.

use scatter_scene::{RadianceImage, write_png};

use super::*;

#[test]
fn hand_made_images_have_their_hand_made_figures() {
    let folder = tempfile::tempdir().unwrap();
    // Reference 2 everywhere; the test image is 1 too bright in one of 5 × 4 pixels.
    write_image(&folder.path().join("a.exr"), [5, 4], |_, _| [2.0; 3]);
    write_image(
        &folder.path().join("b.exr"),
        [5, 4],
        |x, y| if (x, y) == (3, 1) { [3.0; 3] } else { [2.0; 3] },
    );
    let output = xtask(folder.path(), &["compare", "a.exr", "b.exr", "--json"]);
    assert_eq!(code(&output), 0);
    let figures = json(&output);
    let of = |key: &str| figures[key].as_f64().unwrap();
    // sqrt(1/20)/2; position 0.99·59 = 58.41 among 57 zeros and three of ½.
    assert!((of("rel_rmse") - 0.05f64.sqrt() / 2.0).abs() < 1e-12);
    assert_eq!((of("p99"), of("max"), of("non_finite")), (0.5, 0.5, 0.0));
    assert!((of("bias") - 1.0 / 40.0).abs() < 1e-12);
}

#[test]
fn white_pixels_of_the_mask_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    write_image(&folder.path().join("a.exr"), [5, 4], |_, _| [2.0; 3]);
    write_image(&folder.path().join("b.exr"), [5, 4], |x, _| if x == 3 { [f32::NAN; 3] } else { [2.0; 3] });
    let pixels = (0..20).map(|i| if i % 5 == 3 { [1e9; 3] } else { [0.0; 3] }).collect();
    write_png(&folder.path().join("m.png"), &RadianceImage { size: [5, 4], pixels }, 1.0).unwrap();
    let without = json(&xtask(folder.path(), &["compare", "a.exr", "b.exr", "--json"]));
    assert_eq!(without["non_finite"], 12);
    let with = json(&xtask(folder.path(), &["compare", "a.exr", "b.exr", "--mask", "m.png", "--json"]));
    assert_eq!((&with["non_finite"], &with["pixels"]), (&Value::from(0), &Value::from(16)));
}

#[test]
fn what_cannot_be_compared_is_an_error_of_one_line() {
    let folder = tempfile::tempdir().unwrap();
    write_image(&folder.path().join("a.exr"), [5, 4], |_, _| [2.0; 3]);
    write_image(&folder.path().join("b.exr"), [4, 5], |_, _| [2.0; 3]);
    let sizes = error_line(folder.path(), &["compare", "a.exr", "b.exr"]);
    assert!(sizes.contains("a.exr is 5x4") && sizes.contains("b.exr 4x5"), "{sizes}");
    let itself = error_line(folder.path(), &["compare", "a.exr", "./a.exr"]);
    assert!(itself.contains("compared with itself"), "{itself}");
    let missing = error_line(folder.path(), &["compare", "a.exr", "c.exr"]);
    assert!(missing.starts_with("error: c.exr: "), "{missing}");
    let pixels = vec![[0.0; 3]; 6];
    write_png(&folder.path().join("m.png"), &RadianceImage { size: [3, 2], pixels }, 1.0).unwrap();
    std::fs::copy(folder.path().join("a.exr"), folder.path().join("c.exr")).unwrap();
    let mask = error_line(folder.path(), &["compare", "a.exr", "c.exr", "--mask", "m.png"]);
    assert!(mask.contains("m.png: the mask is 3x2 and the images 5x4"), "{mask}");
    std::fs::write(folder.path().join("bad.png"), "no png").unwrap();
    let bad = error_line(folder.path(), &["compare", "a.exr", "c.exr", "--mask", "bad.png"]);
    assert!(bad.starts_with("error: bad.png: "), "{bad}");
    let garbage = folder.path().join("garbage.exr");
    std::fs::write(&garbage, [0u8; 100]).unwrap();
    let bad = error_line(folder.path(), &["compare", "a.exr", "garbage.exr"]);
    assert!(bad.starts_with("error: garbage.exr: "), "{bad}");
    let copy = error_line(folder.path(), &["compare", "a.exr", "c.exr"]);
    assert!(copy.contains("a.exr and c.exr hold the same bits"), "{copy}");
}
