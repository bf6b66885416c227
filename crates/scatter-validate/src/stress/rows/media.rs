//! Thin and thick media, phase functions from needle to needle, rays of no length and without an end.

use scatter_core::{Medium, ModelError, Phase, Scattering};

use crate::scenario::Scenario;
use crate::stress::row::StressRow;
use crate::stress::scenes::{self, SCENES};

/// Rows of media, phase functions and ray lengths.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        for depth in [1e-9, 1e-4, 1.0, 30.0, 1e4] {
            // Rays of up to 30 units.
            let sigma = depth / 30.0;
            let scene = scene().and_then(|scene| scene.in_medium(sigma, 0.0, Phase::Isotropic));
            rows.push(StressRow::image("optical depth σt·D", format!("{depth:e}, {light}"), scene));
        }
        rows.push(StressRow::image(
            "optical depth σt·D",
            format!("σt = 0: a vacuum, {light}"),
            vacuum(scene()),
        ));
    }
    for (light, scene) in SCENES {
        for g in [-0.9999, -0.99, -0.5, 0.0, 0.5, 0.99, 0.9999] {
            let scene = scene().and_then(|s| s.in_medium(0.05, 0.01, Phase::henyey_greenstein(g)?));
            rows.push(StressRow::image("phase functions", format!("g = {g}, {light}"), scene));
        }
        for (name, medium) in [("Rayleigh", rayleigh()), ("RGB air: Rayleigh + g = 0.76", air())] {
            let scene = scene().and_then(|scene| Ok(Scenario { medium: medium?, ..scene }));
            rows.push(StressRow::image("phase functions", format!("{name}, {light}"), scene));
        }
    }
    for (light, scene) in SCENES {
        for end in [0.0, 1e-6, 1e6, f32::INFINITY] {
            let scene = scene().map(|scene| scene.ending_at(end));
            rows.push(StressRow::image("ray length D", format!("{end:e}, {light}"), scene));
        }
        rows.push(StressRow::image(
            "ray length D",
            format!("0, 1e-6, 1, 1e6 and ∞ side by side, {light}"),
            mixed(scene()),
        ));
    }
    rows
}

fn vacuum(scene: Result<Scenario, ModelError>) -> Result<Scenario, ModelError> {
    scene?.ending_at(f32::INFINITY).in_medium(0.0, 0.0, Phase::Isotropic)
}

fn rayleigh() -> Result<Medium, ModelError> {
    Medium::homogeneous([0.05; 3], [0.01; 3], Phase::Rayleigh)
}

/// Coloured, and one channel that is neither scattered by the dust nor absorbed.
fn air() -> Result<Medium, ModelError> {
    let dust = Scattering { sigma_s: [0.03, 0.03, 0.0], phase: Phase::henyey_greenstein(0.76)? };
    let gas = Scattering { sigma_s: [0.01, 0.025, 0.07], phase: Phase::Rayleigh };
    Medium::new(vec![gas, dust], [0.0, 0.02, 0.0])
}

fn mixed(scene: Result<Scenario, ModelError>) -> Result<Scenario, ModelError> {
    let mut scene = scene?;
    let ends = [0.0, 1e-6, 1.0, 1e6, f32::INFINITY];
    let [width, _] = scenes::SIZE;
    for (index, end) in scene.distances.iter_mut().enumerate() {
        // Steps of 3 along a row and 1 down: neighbours differ in both directions.
        let (x, y) = (index % width as usize, index / width as usize);
        *end = ends[(3 * x + y) % ends.len()];
    }
    scene.max_distance = f64::INFINITY;
    Ok(scene)
}
