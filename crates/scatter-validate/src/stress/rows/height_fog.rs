//! Height fog: thin and thick, eyes far above and below its base, rays along it and out of it, tilted and upside down; and
//! the laws that bind it to a uniform medium.

use glam::DVec3;
use scatter_core::{Camera, ModelError, Phase};

use super::laws;
use crate::checks::{cascades, coloured_glass};
use crate::scenario::Scenario;
use crate::stress::row::{Law, ROUNDING, Relation, StressRow};
use crate::stress::scenes::{self, EYE, SCENES, SIZE, SUN};

const GROUP: &str = "height fog";

/// Above the eye and the lamps the fog is thin, on the ground it is dense.
const SCALE: f64 = 1.1;

/// Rows of height fog.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        let mut row = |name: &str, scene: Result<Scenario, ModelError>| {
            rows.push(StressRow::image(GROUP, format!("{name}, {light}"), scene));
        };
        row("on the ground", scene().and_then(|s| s.in_fog(DVec3::Y, 0.0, SCALE)));
        row("tilted up", scene().and_then(|s| s.in_fog(DVec3::new(0.6, 1.0, -0.5), 0.3, SCALE)));
        row("upside down", scene().and_then(|s| s.in_fog(DVec3::NEG_Y, -4.0, 2.0)));
        row("a scale height of 1e12: a uniform medium", scene().and_then(|s| s.in_fog(DVec3::Y, 0.0, 1e12)));
        // The eye is 1.6 above the ground: 40 scale heights.
        row(
            "a density that grows by e^40 along rays",
            scene()
                .and_then(|s| s.in_medium(4.0, 1.0, Phase::Isotropic)?.in_fog(DVec3::Y, 0.0, EYE.y / 40.0)),
        );
        row(
            "the eye 95 scale heights up",
            scene()
                .and_then(|s| s.in_medium(9.0, 1.0, Phase::Isotropic)?.in_fog(DVec3::Y, 0.0, EYE.y / 95.0)),
        );
        row(
            "the eye 30 scale heights below the base",
            scene()
                .and_then(|s| s.in_medium(1e-13, 0.0, Phase::Isotropic)?.in_fog(DVec3::Y, EYE.y + 30.0, 1.0)),
        );
        for depth in [1e-9, 1e-3, 1e4] {
            let sigma = depth / 30.0;
            row(
                &format!("optical depths of {depth:e} at the base"),
                scene().and_then(|s| s.in_medium(sigma, 0.0, Phase::Isotropic)?.in_fog(DVec3::Y, 0.7, 3.0)),
            );
        }
        row("1e5 units from the origin", scene().and_then(far_away));
        row(
            "straight up from below the base",
            scene().and_then(|s| {
                let camera = looking(EYE, EYE + DVec3::Y, DVec3::Z)?;
                s.seen_by(camera).in_fog(DVec3::Y, 3.0, 0.8)
            }),
        );
        row(
            "a row of rays exactly along it",
            scene().and_then(|s| {
                // The image has an odd number of rows.
                let camera = looking(EYE, EYE + DVec3::NEG_Z, DVec3::Y)?;
                s.seen_by(camera).in_fog(DVec3::Y, 1.0, 0.4)
            }),
        );
    }
    rows.push(StressRow::image(GROUP, "the sun in view", sun_in_view()));
    rows.push(StressRow::image(
        GROUP,
        "through coloured glass, sun",
        scenes::sun()
            .and_then(|s| Scenario { glass: Some(coloured_glass()), ..s }.in_fog(DVec3::Y, 0.0, SCALE)),
    ));
    rows.push(StressRow::image(
        GROUP,
        "three cascades",
        cascades().and_then(|s| s.in_fog(DVec3::Y, 0.0, SCALE)),
    ));
    rows.push(StressRow::image(
        GROUP,
        "endless rays, up, down and along, sun",
        scenes::sun().and_then(|s| {
            let camera = looking(EYE, EYE + DVec3::NEG_Z, DVec3::Y)?;
            s.seen_by(camera).ending_at(f32::INFINITY).in_fog(DVec3::Y, 1.0, 0.9)
        }),
    ));
    rows.push(law("lengths × 1e4, σ / 1e4, sun", || laws::scaled(in_fog(scenes::sun()?)?, 1e4)));
    rows.push(law("lengths × 1e4, σ / 1e4, point", || laws::scaled(in_fog(scenes::point()?)?, 1e4)));
    rows.push(law("mirrored, sun", || laws::mirrored(in_fog(scenes::sun()?)?)));
    rows.push(law("the base 1 higher, σ × exp(−1/scale), sun", || base_moved(scenes::sun()?)));
    rows.push(law("the base 1 higher, σ × exp(−1/scale), point", || base_moved(scenes::point()?)));
    rows
}

fn law(name: &str, relation: impl FnOnce() -> Result<Relation, ModelError>) -> StressRow {
    StressRow::relation(GROUP, name, relation())
}

fn in_fog(scene: Scenario) -> Result<Scenario, ModelError> {
    scene.in_fog(DVec3::new(0.1, 1.0, 0.2), 0.2, SCALE)
}

fn looking(eye: DVec3, target: DVec3, up: DVec3) -> Result<Camera, ModelError> {
    Camera::perspective(eye.to_array(), target.to_array(), up.to_array(), 60.0, SIZE)
}

/// The base goes with the world.
fn far_away(scene: Scenario) -> Result<Scenario, ModelError> {
    scene.in_fog(DVec3::Y, 0.0, SCALE)?.moved(DVec3::new(1e5, -3.7e4, 9.1e4))
}

/// The eye looks into the sun, and the fog below it grows towards the ground.
fn sun_in_view() -> Result<Scenario, ModelError> {
    let eye = EYE - 3.0 * SUN.normalize();
    let camera = looking(eye, eye - SUN, DVec3::Z)?;
    scenes::sun()?.in_medium(0.3, 0.02, Phase::henyey_greenstein(0.8)?)?.seen_by(camera).in_fog(
        DVec3::Y,
        1.0,
        2.0,
    )
}

/// One density, written in two ways.
fn base_moved(scene: Scenario) -> Result<Relation, ModelError> {
    let (sigma_s, sigma_a, scale) = (0.4f64, 0.1, SCALE);
    let fog = |factor: f64, base: f64| {
        let medium = scene.clone().in_medium(factor * sigma_s, factor * sigma_a, Phase::Rayleigh)?;
        medium.in_fog(DVec3::Y, base, scale)
    };
    let (first, second) = (fog(1.0, 0.5)?, fog((-1.0 / scale).exp(), 1.5)?);
    Ok(Relation { first, second, law: Law::Same, factor: 1.0, reference_tolerance: ROUNDING })
}
