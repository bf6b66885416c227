//! The suite of sun integrals with known values: σs = σt = σ (albedo 1), isotropic, irradiance 1.
//!
//! The values are `(e^{−σa} − e^{−σb})/4π` for light on [a, b], printed to five or six digits where the suite comes
//! from and worked out here to all of them; a unit test compares both.

use std::f64::consts::PI;

use glam::DVec3;
use scatter_core::{Camera, Light, ModelError, Phase};

use crate::scenario::{MapFrame, MapLayer, Scenario, Shadow};
use crate::stress::row::{Expectation, ROUNDING, StressRow};
use crate::stress::scenes;

const GROUP: &str = "sun, known integrals";

/// Rows (a) to (j).
pub fn rows() -> Vec<StressRow> {
    let value = |name: &str, scene: Result<Scenario, ModelError>, value: f64| {
        StressRow::expecting(GROUP, name, scene, Expectation::Value(value), ROUNDING)
    };
    let mut rows = vec![
        value("σ = 0.1, s = 20", clear(0.1, 20.0), between(0.1, 0.0, 20.0)),
        value("σ = 0.1, s = ∞", clear(0.1, f32::INFINITY), 1.0 / (4.0 * PI)),
        value("σ = 1e-8, s = 1", clear(1e-8, 1.0), between(1e-8, 0.0, 1.0)),
        value("σ = 1e3, s = 1e6", clear(1e3, 1e6), 1.0 / (4.0 * PI)),
        value("lit on [1e4, 1e4 + 1] alone, σ = 1e-3", far_slit(), between(1e-3, 1e4, 1e4 + 1.0)),
        value("all in shadow: exactly 0", slabs(64, 64.0, |_| true), 0.0),
        value("s = 0: exactly 0", clear(0.1, 0.0), 0.0),
        value("s = 1e-30", clear(0.1, 1e-30), between(0.1, 0.0, f64::from(1e-30f32))),
    ];
    for pairs in [1u32, 2, 1000] {
        // Slabs of equal thickness over 64 units, every other one lit, the first one dark.
        let width = 64.0 / f64::from(2 * pairs);
        let lit = (0..pairs)
            .map(|n| between(SIGMA, f64::from(2 * n + 1) * width, f64::from(2 * n + 2) * width))
            .sum();
        rows.push(value(
            &format!("{pairs} lit slabs between dark ones"),
            slabs(2 * pairs, 64.0, |n| n % 2 == 0),
            lit,
        ));
    }
    rows.push(value(
        "shadow everywhere but one texel of 64",
        slabs(64, 64.0, |n| n != 41),
        between(SIGMA, 41.0, 42.0),
    ));
    rows
}

/// Extinction of the slabs.
const SIGMA: f64 = 0.05;

/// `(e^{−σa} − e^{−σb})/4π` without cancellation.
fn between(sigma: f64, a: f64, b: f64) -> f64 {
    (-sigma * a).exp() * -(-sigma * (b - a)).exp_m1() / (4.0 * PI)
}

/// Nothing casts a shadow, all rays are as long.
fn clear(sigma: f64, end: f32) -> Result<Scenario, ModelError> {
    let mut scene = scenes::sun()?.in_medium(sigma, 0.0, Phase::Isotropic)?.ending_at(end);
    scene.light = Light::directional(scenes::SUN.to_array(), [1.0; 3])?;
    scene.shadow = Shadow::None;
    Ok(scene)
}

/// One pixel that looks along +x from x = 0, under a sun from above; columns of texels lie behind each other along x.
fn slabs(count: u32, length: f64, is_dark: impl Fn(u32) -> bool) -> Result<Scenario, ModelError> {
    let camera = Camera::perspective([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 30.0, [1, 1])?;
    let light = Light::directional([0.0, -1.0, 0.0], [1.0; 3])?;
    let frame = MapFrame {
        origin: DVec3::new(0.5 * length, 10.0, 0.3),
        forward: DVec3::NEG_Y,
        // Right is forward × up = +x.
        up: DVec3::NEG_Z,
        half: [0.5 * length, 4.0],
        size: [count, 1],
        perspective: false,
        by_matrix: false,
    };
    let map = MapLayer::filled(frame, |column, _| if is_dark(column) { 9.0 } else { f32::INFINITY });
    let mut scene = scenes::sun()?.in_medium(SIGMA, 0.0, Phase::Isotropic)?;
    scene.rays = None;
    scene.camera = camera;
    scene.light = light;
    scene.shadow = Shadow::Parallel(vec![map]);
    scene.distances = vec![length as f32];
    scene.max_distance = length;
    Ok(scene)
}

/// 10,002 columns of one unit; the last but one is lit.
fn far_slit() -> Result<Scenario, ModelError> {
    slabs(10_002, 10_002.0, |n| n != 10_000)?.in_medium(1e-3, 0.0, Phase::Isotropic)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::row::Trial;

    #[test]
    fn the_values_are_those_that_are_printed() {
        for (value, printed) in [
            (between(0.1, 0.0, 20.0), 0.068_807_9),
            (between(0.1, 0.0, f64::INFINITY), 0.079_577_5),
            (between(1e-8, 0.0, 1.0), 7.957_75e-10),
            (between(1e3, 0.0, 1e6), 0.079_577_5),
            (between(1e-3, 1e4, 1e4 + 1.0), 3.611_0e-9),
        ] {
            // Half a unit of the last digit printed, 0.00005/3.611 at worst.
            assert!((value / printed - 1.0).abs() < 1.5e-5, "{value} {printed}");
        }
    }

    #[test]
    fn the_brute_force_image_has_these_values() {
        for row in rows() {
            let Trial::Image(trial) = row.trial else { panic!("{}: not an image", row.name) };
            let Expectation::Value(value) = trial.expectation else { panic!("{}: no value", row.name) };
            for found in trial.scenario.expected().radiance.iter().flatten() {
                // f64 sums of at most 1000 terms.
                assert!((found - value).abs() <= 1e-12 * value, "{}: {found} {value}", row.name);
            }
        }
    }
}
