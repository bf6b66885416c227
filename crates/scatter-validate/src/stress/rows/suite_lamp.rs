//! The suite of lamp integrals `K = ∫ e^{−σ(x+d)}/d² dx` with ten published digits: albedo 1, isotropic, intensity 4π/σ.
//!
//! A lit part that does not begin at the eye is cut out by a cube map: its one texel a face stores the depth at which
//! the ray, coming nearer along the face's axis, enters the light. The ray's own end closes it.

use std::f64::consts::PI;

use glam::DVec3;
use scatter_core::{Camera, Light, ModelError, Phase};

use crate::closed_form::PUBLISHED;
use crate::scenario::{Scenario, Shadow};
use crate::stress::row::{Expectation, ROUNDING, StressRow};
use crate::stress::scenes;

const GROUP: &str = "lamp, known integrals";

/// A row a value.
pub fn rows() -> Vec<StressRow> {
    PUBLISHED
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
        for (row, known) in rows().into_iter().zip(PUBLISHED) {
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
