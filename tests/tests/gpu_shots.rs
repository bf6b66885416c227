//! The GPU's techniques on the built-in shots, as small pictures of odd sides: the marcher against the CPU's marcher, exact
//! min/max and epipolar slices against the exact walk through the same maps. SKIPPED without an adapter, unless `SCATTER_GPU=required`.

use scatter_core::{Quality, Target, Technique};
use scatter_gpu::harness::{self, EPIPOLAR_GPU_ID, HarnessDevice, MARCH_GPU_ID, MINMAX_GPU_ID};
use scatter_scene::{builtin_shots, export, load_shot};
use scatter_validate::measure::{Measurement, Outcome, Renderer, measure};
use scatter_validate::staged_shot::resized;
use scatter_validate::truths::shadow_map_truth;
use scatter_validate::{Labelled, StagedShot, compare};

const SIZE: [u32; 2] = [161, 119];
const MAP: u32 = 256;
const LEVEL: Quality = Quality::Preview;
const STEPS: [(&str, &str); 1] = [("steps", "256")];

/// Of exact min/max, rel_rmse: what the ladder's third rung promises of runs of f32.
const MOST: f64 = 1e-4;
/// Of the marcher, p99: 99 of 100 pixels differ by the rounding of 256 sums alone, 1e-5.
const MOST_OF_MOST_PIXELS: f64 = 1e-4;
/// Of the marcher, rel_rmse: in the hundredth pixel f32 may put a sample onto a neighbouring texel, one of 256, which is worth at
/// most some five times what a mean pixel has of a sample: √0.01 · 5/256.
const MOST_TIPPED: f64 = 2e-3;

fn rendered(
    technique: &'static dyn Technique,
    options: &[(&str, &str)],
    staged: &StagedShot,
) -> Option<Measurement> {
    let target = Target::Quality(LEVEL);
    let mut renderer = Renderer::configured(technique, target, options, staged).unwrap().unwrap();
    match measure(staged, &mut renderer, 1).unwrap() {
        Outcome::Measured(measurement) => Some(*measurement),
        Outcome::Unsupported(reason) => {
            println!("{}: {reason}", staged.name());
            None
        }
    }
}

#[test]
fn every_built_in_shot_is_what_the_cpu_says() {
    match HarnessDevice::shared() {
        Ok(device) => println!("gpu: {}", device.describe()),
        Err(none) => {
            let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
            assert!(!required, "SCATTER_GPU=required, and there is no adapter: {none}");
            println!("SKIPPED every_built_in_shot_is_what_the_cpu_says: no adapter: {none}");
            return;
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().collect();
    export(dir.path(), &shots).unwrap();
    let (mut missed, mut judged) = (Vec::new(), 0);
    for shot in shots {
        let mut shot = load_shot(&dir.path().join(format!("{}.toml", shot.name))).unwrap();
        shot.camera = resized(&shot.camera, SIZE).unwrap();
        let staged = StagedShot::new(shot, MAP).unwrap();
        let ids = [MARCH_GPU_ID, MINMAX_GPU_ID, EPIPOLAR_GPU_ID];
        let [march, exact, slices] = ids.map(|id| harness::technique(id).unwrap());
        let truth = || shadow_map_truth(&staged).ok();
        let pairs = [
            (rendered(march, &STEPS, &staged), rendered(&raymarch_ref::TECHNIQUE, &STEPS, &staged)),
            (rendered(exact, &[], &staged), truth()),
            (rendered(slices, &[], &staged), truth()),
        ];
        for (id, pair) in ids.into_iter().zip(pairs) {
            let (Some(found), Some(truth)) = pair else { continue };
            let labelled = |label, of: &Measurement| (label, of.image.size);
            let (label, size) = labelled("cpu", &truth);
            let reference = Labelled { label, size, pixels: &truth.image.pixels };
            let (label, size) = labelled(id, &found);
            let figures =
                compare(reference, Labelled { label, size, pixels: &found.image.pixels }, None).unwrap();
            let [rel_rmse, p99] = match id {
                MARCH_GPU_ID => [MOST_TIPPED, MOST_OF_MOST_PIXELS],
                MINMAX_GPU_ID => [MOST; 2],
                // The level that it was configured for; of its RMSE a fifth, beside which a picture a column aside is another one.
                _ => [0.2 * LEVEL.error(), LEVEL.error()],
            };
            let line = format!(
                "{} {id}: rel_rmse {:.1e} of {rel_rmse:.0e}, p99 {:.1e} of {p99:.0e}",
                staged.name(),
                figures.rel_rmse,
                figures.p99
            );
            println!("{line}");
            judged += 1;
            // A mutant of rungs 3 and 4: the same picture a column aside is another one.
            let mut aside = found.image.pixels.clone();
            aside.rotate_left(1);
            let shifted = Labelled { label: "shifted", size, pixels: &aside };
            let reference = Labelled { label: "cpu", size, pixels: &truth.image.pixels };
            let mutant = compare(reference, shifted, None).unwrap();
            assert!(mutant.rel_rmse > rel_rmse, "{line}: a column aside is not seen: {:e}", mutant.rel_rmse);
            if !(figures.rel_rmse <= rel_rmse && figures.p99 <= p99 && figures.non_finite == 0) {
                missed.push(line);
            }
        }
    }
    assert!(judged >= 25, "only {judged} pictures were judged");
    assert!(missed.is_empty(), "{missed:#?}");
}
