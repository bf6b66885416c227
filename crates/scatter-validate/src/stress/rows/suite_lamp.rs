//! The suite of lamp integrals `K = ∫ e^{−σ(x+d)}/d² dx` with ten published digits: albedo 1, isotropic, intensity 4π/σ.
//!
//! A lit part that does not begin at the eye is cut out by a cube map: its one texel a face stores the depth at which
//! the ray, coming nearer along the face's axis, enters the light. The ray's own end closes it.

use std::f64::consts::PI;

use glam::DVec3;
use scatter_core::{Camera, Light, ModelError, Phase};

use crate::scenario::{Scenario, Shadow};
use crate::stress::row::{Expectation, ROUNDING, StressRow};
use crate::stress::scenes;

const GROUP: &str = "lamp, known integrals";

/// σ, distance of the lamp, its angle off the ray, start and end of the light, K.
pub const KNOWN: [(f64, f64, f64, f64, f64, f64); 9] = [
    (0.1, 10.0, 0.5, 0.0, 20.0, 0.110_030_205_1),
    (1.0, 10.0, 0.5, 0.0, 20.0, 3.241_860_946e-6),
    (1e-6, 10.0, 0.5, 0.0, 20.0, 0.466_783_426_4),
    (1e-6, 10.0, 1e-4, 0.0, 20.0, 3_141.361_225),
    (0.1, 10.0, 0.01, 0.0, 30.0, 11.150_669_07),
    (0.3, 10.0, 3.1, 0.0, 50.0, 6.395_084_486e-4),
    (0.01, 10.0, 0.001, 0.0, 9.0, 0.814_327_842_3),
    (0.5, 4.0, 0.7, 3.0, 3.001, 9.254_041_844e-6),
    (5.0, 10.0, 1.0, 8.0, 9.0, 6.230_838_964e-40),
];

/// A row a value.
pub fn rows() -> Vec<StressRow> {
    KNOWN
        .iter()
        .map(|&(sigma, distance, angle, start, end, known)| {
            let name = format!("σ = {sigma:e}, D = {distance}, angle {angle}, light on [{start}, {end}]");
            let scene = scene(sigma, distance, angle, start, end);
            // The depths of ray and map are f32: 6e-8 of 10 units, against the whole ray of which the tolerance is a
            // share, and where the ray passes the lamp fast, against the lamp's distance of the ray.
            let passes_at = distance * f64::sin(angle);
            let tolerance = ROUNDING + 1.2e-7 * (1.0 + if start > 0.0 { end / passes_at } else { 0.0 });
            StressRow::expecting(GROUP, name, scene, Expectation::Value(known), tolerance)
        })
        .collect()
}

/// One pixel; the ray rises by `TILT` over the face −Y, so that its depth on that face falls.
fn scene(sigma: f64, distance: f64, angle: f64, start: f64, end: f64) -> Result<Scenario, ModelError> {
    /// 15°: the light's part of the ray stays on the face in both rows that begin late.
    const TILT: f64 = 15.0 * PI / 180.0;
    let view = DVec3::new(TILT.cos(), TILT.sin(), 0.0);
    let aside = DVec3::new(-TILT.sin(), TILT.cos(), 0.0);
    let lamp = distance * (angle.cos() * view + angle.sin() * aside);
    let camera = Camera::perspective([0.0; 3], view.to_array(), [0.0, 0.0, 1.0], 30.0, [1, 1])?;
    let mut scene = scenes::point()?.in_medium(sigma, 0.0, Phase::Isotropic)?;
    scene.camera = camera;
    scene.light = Light::point(lamp.to_array(), [4.0 * PI / sigma; 3], 0.0)?;
    scene.distances = vec![end as f32];
    scene.max_distance = end;
    scene.shadow = if start == 0.0 {
        Shadow::None
    } else {
        let depth = (lamp - start * view).y;
        Shadow::Cube { side: 1, texels: vec![depth as f32; 6] }
    };
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::row::Trial;

    #[test]
    fn the_brute_force_image_has_the_published_values() {
        for (row, known) in rows().into_iter().zip(KNOWN) {
            let Trial::Image(trial) = row.trial else { panic!("{}: not an image", row.name) };
            let found = trial.scenario.expected().radiance[0][0];
            // Half a unit of the tenth digit. Where the light begins is an f32 depth of up to 10, 5e-7, at a slope of
            // sin 15°: 2e-6 of the way, against the length of the lit part and in the exponent.
            let (sigma, length) = (known.0, known.4 - known.3);
            let tolerance = if known.3 == 0.0 { 5e-10 } else { 2e-6 * (1.0 / length + 2.0 * sigma) };
            assert!((found / known.5 - 1.0).abs() < tolerance, "{}: {found:e} {:e}", row.name, known.5);
        }
    }
}
