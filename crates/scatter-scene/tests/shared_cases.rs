//! Ray-cast truth against the independent reference images of the shared cases (f64, no sampling, other people's code).

mod common;

use std::time::Instant;

use common::{TestShot, figures, read_exr, shared};

/// The demand is 1e-3 and 1e-4. References are f32: 6e-8 of a pixel's value is their rounding.
const LARGEST_RELATIVE_RMSE: f64 = 1e-6;
const LARGEST_BIAS: f64 = 1e-7;

#[test]
fn the_truth_is_the_reference_on_every_shared_case() {
    let Some(shared) = shared("the_truth_is_the_reference_on_every_shared_case") else { return };
    let mut cases: Vec<_> = std::fs::read_dir(shared.join("cases"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("shot.toml").exists())
        .collect();
    cases.sort();
    assert!(!cases.is_empty());
    let mut failed = 0;
    for case in cases {
        let shot = TestShot::load(&case.join("shot.toml"), None);
        let reference = read_exr(&case.join("reference.exr"));
        let fragile = image::open(case.join("fragile.png")).unwrap().to_luma8();
        let mask: Vec<bool> = fragile.pixels().map(|p| p.0[0] <= 127).collect();
        let start = Instant::now();
        let (image, _) = shot.truth();
        let time = start.elapsed();
        let (rmse, bias, non_finite) = figures(image.inscattered(), &reference, &mask);
        let (unmasked, ..) = figures(image.inscattered(), &reference, &vec![true; mask.len()]);
        let name = case.file_name().unwrap().to_string_lossy().into_owned();
        println!(
            "{name:14} rel_rmse {rmse:.2e} (unmasked {unmasked:.2e})  bias {bias:+.2e}  non-finite {non_finite}  {time:.0?}"
        );
        let good = rmse <= LARGEST_RELATIVE_RMSE && bias.abs() <= LARGEST_BIAS && non_finite == 0;
        failed += usize::from(!good);
    }
    assert_eq!(failed, 0, "cases out of tolerance");
}
