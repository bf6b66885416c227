//! Rung 1 of the ladder: functions by themselves on grids of inputs, against f64; and mutants of them.

use scatter_gpu::harness::{HarnessDevice, check_functions, functions_module};
use scatter_kernels::modules::Module;

#[test]
fn every_function_is_within_what_f32_allows() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    for check in check_functions(&device, functions_module()) {
        println!(
            "{:<38} {:>6} inputs, worst error {:.2} of what is allowed",
            check.name, check.inputs, check.worst
        );
        assert!(check.is_right(), "{check:?}");
    }
}

/// The module with one text replaced.
fn mutant(name: &'static str, from: &str, to: &str) -> &'static Module {
    let original = functions_module();
    let files: Vec<&'static str> =
        original.files.iter().map(|text| &*text.replace(from, to).leak()).collect();
    assert!(files.iter().zip(original.files).any(|(a, b)| a != b), "{name}: nothing is replaced");
    Box::leak(Box::new(Module { name, files: files.leak(), entries: original.entries }))
}

#[test]
fn mutants_of_functions_are_rejected() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    for (name, from, to, function) in [
        ("the sign of g", "sin_sq, g >= 0.0", "sin_sq, g < 0.0", "phase_at"),
        ("phi without its series' third term", "x * (1.0 / 6.0 + x", "x * (1.0 / 6.1 + x", "phi"),
        (
            "fog from its thin end",
            "select(b, a, fog.slope > 0.0)",
            "select(a, b, fog.slope > 0.0)",
            "fog_column",
        ),
        (
            "z in the wrong place",
            "let denominator = q.z + q.w * z;",
            "let denominator = q.w + q.z * z;",
            "distance_of_texel",
        ),
        ("a shift of the hash", "x >> 15u", "x >> 14u", "mixed"),
        ("minus infinity taken for no surface", "bits == 0xff800000u", "bits == 0x7f800000u", "finite_texel"),
    ] {
        let wrong: Vec<_> = check_functions(&device, mutant(name, from, to))
            .into_iter()
            .filter(|check| !check.is_right())
            .map(|check| check.name)
            .collect();
        println!("{name}: rejected by {wrong:?}");
        assert!(wrong.iter().any(|name| name.starts_with(function)), "{name} is not seen: {wrong:?}");
    }
}
