//! How much a technique's error flickers while the camera pans by fractions of a pixel and the light turns slowly.
//!
//! Every frame has maps and truths of its own. The flicker of an image sequence is the RMS of its second difference
//! over time ([`SecondDifference`]) over the truth's mean; a technique's is that of its error image, beside the truth's
//! own. The shadow map's error flickers too, for all techniques alike: shadow-map truth can have a row for it.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use scatter_core::{Camera, Light, ModelError, Target, Technique};
use scatter_scene::{RadianceImage, Shot};
use serde::Serialize;

use super::flicker::SecondDifference;
use crate::baseline::Baseline;
use crate::judge_error::JudgeError;
use crate::judged_shot::{MapJudgedShot, against};
use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::options::at_level;
use crate::settings::{Options, Settings, pairs};
use crate::staged_shot::{StageError, StagedShot};
use crate::truths::{SHADOW_MAP_TRUTH, raycast_truth};

/// Frames of a sequence.
pub const MOTION_FRAMES: u32 = 16;
/// Pan a frame, to the right \[pixels\]: no simple fraction, so that no two frames sample alike.
const PAN_PIXELS: f64 = 0.3;
/// Turn a frame \[degrees\]: a day in five minutes at sixty frames a second.
const TURN_DEGREES: f64 = 0.02;

/// What is measured on every shot.
pub struct Motion<'a> {
    /// The techniques.
    pub techniques: Vec<&'a dyn Technique>,
    /// The one that runs at the cheapest value of its knob that reaches the level on the first frame.
    pub baseline: Option<Baseline<'a>>,
    /// How techniques are run; the quality is the level that they are configured for.
    pub settings: Settings,
    /// Frames of the sequence, 3 or more.
    pub frames: u32,
    /// Whether shadow-map truth gets a row: how the shadow map's own error flickers, against ray-cast truth.
    pub map_row: bool,
}

/// One technique on one shot in motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionRow {
    /// The shot's name.
    pub shot: String,
    /// The technique's id; that of shadow-map truth for the shadow map's own error.
    pub method: String,
    /// The level that it is configured for; none for a reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<String>,
    /// The values of all options that it ran with; none for a reference.
    pub options: BTreeMap<String, String>,
    /// Those that were set by hand or searched for; the others follow from the level.
    pub overrides: BTreeMap<String, String>,
    /// `[width, height]` of the images.
    pub size: [u32; 2],
    /// Texels along a side of the shadow map.
    pub shadow_map: u32,
    /// How many cascades each sun has, of so many texels a side each; none where all lights have one map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cascades: Option<u32>,
    /// Frames of the sequence.
    pub frames: u32,
    /// Whether the light turned too; one with glass before it stays.
    pub light_turned: bool,
    /// Relative RMSE, mean over the frames: against shadow-map truth, that truth's own against ray-cast truth.
    pub rel_rmse: f64,
    /// RMS of the error image's second difference over time, over the truth's mean.
    pub flicker: f64,
    /// The same of the truth itself.
    pub truth_flicker: f64,
    /// NaN and infinite values in all frames.
    pub non_finite: u64,
    /// Why it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unsupported: Option<String>,
}

/// One technique on its way through the sequence.
struct Runner<'a> {
    technique: &'a dyn Technique,
    renderer: Renderer<'a>,
    resolved: BTreeMap<String, String>,
    overrides: Options,
    unsupported: Option<String>,
    error: ErrorSequence,
}

/// Error images over time.
#[derive(Default)]
struct ErrorSequence {
    differences: SecondDifference,
    rel_rmse_sum: f64,
    non_finite: u64,
}

impl Motion<'_> {
    /// Runs all techniques through the sequence on one shot. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<Vec<MotionRow>, JudgeError> {
        let Settings { resolution, .. } = self.settings;
        let camera = shot.camera.clone();
        progress(&format!("{}: maps", shot.name));
        let staged = StagedShot::with_source(shot, resolution, self.settings.raster.as_ref())?;
        let (name, cascades) = (staged.name().to_string(), staged.cascades());
        let lights: Vec<(Light, bool)> =
            staged.lights().map(|(light, glass)| (light.clone(), glass)).collect();
        let mut judged = MapJudgedShot::new(staged)?;
        let mut runners: Vec<Runner<'_>> = Vec::new();
        let (mut map_error, mut truth_mean) = (ErrorSequence::default(), 0.0);
        let [mut map_truth_differences, mut ray_truth_differences] =
            [(); 2].map(|()| SecondDifference::default());
        for frame in 0..self.frames {
            progress(&format!("{name}: frame {} of {}", frame + 1, self.frames));
            if frame > 0 {
                let (camera, lights) = at_frame(&camera, &lights, frame)
                    .map_err(|source| StageError::Model { shot: name.clone(), source })?;
                judged.restage(camera, &lights, resolution)?;
            }
            let (staged, map_truth) = (judged.shot(), judged.truth());
            map_truth_differences.push(values(&map_truth.image));
            if self.map_row {
                let ray_truth = raycast_truth(staged)?;
                map_error.push(staged, &ray_truth, map_truth)?;
                ray_truth_differences.push(values(&ray_truth.image));
            }
            truth_mean += values(&map_truth.image).sum::<f64>() / (3 * map_truth.image.pixels.len()) as f64;
            if frame == 0 {
                runners = self.runners(&judged, progress)?;
            }
            for runner in runners.iter_mut().filter(|runner| runner.unsupported.is_none()) {
                match measure(staged, &mut runner.renderer, 1)? {
                    Outcome::Measured(image) => runner.error.push(staged, map_truth, &image)?,
                    Outcome::Unsupported(unsupported) => runner.unsupported = Some(unsupported.reason.into()),
                }
            }
        }
        let mean = truth_mean / f64::from(self.frames.max(1));
        let row = |method: &str, error: &ErrorSequence, truth: &SecondDifference| MotionRow {
            shot: name.clone(),
            method: method.into(),
            level: None,
            options: Default::default(),
            overrides: Default::default(),
            size: camera.size(),
            shadow_map: resolution.side,
            cascades,
            frames: self.frames,
            light_turned: lights.iter().any(|(_, has_glass)| !has_glass),
            rel_rmse: error.rel_rmse_sum / f64::from(self.frames.max(1)),
            flicker: relative(error.differences.rms(), mean),
            truth_flicker: relative(truth.rms(), mean),
            non_finite: error.non_finite,
            unsupported: None,
        };
        let map_row = self.map_row.then(|| row(SHADOW_MAP_TRUTH, &map_error, &ray_truth_differences));
        let mut rows: Vec<MotionRow> = map_row.into_iter().collect();
        rows.extend(runners.into_iter().map(|runner| MotionRow {
            level: Some(self.settings.quality.to_string()),
            options: runner.resolved,
            overrides: runner.overrides.into_iter().collect(),
            unsupported: runner.unsupported,
            ..row(runner.technique.info().id, &runner.error, &map_truth_differences)
        }));
        Ok(rows)
    }

    /// All techniques, configured for the first frame: they keep their options, as an engine would have it.
    fn runners(
        &self,
        judged: &MapJudgedShot,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Vec<Runner<'_>>, JudgeError> {
        let (shot, quality) = (judged.shot(), self.settings.quality);
        let mut runners = Vec::new();
        for &technique in &self.techniques {
            progress(&format!("{}: options of {}", shot.name(), technique.info().id));
            let level = (&self.settings, quality);
            let options = at_level(technique, self.baseline.as_ref(), level, judged)?;
            let target = Target::Quality(quality);
            let renderer = Renderer::configured(technique, target, &pairs(&options), shot)??;
            let resolved = Renderer::resolved(technique, target, &pairs(&options), shot)??;
            let error = ErrorSequence::default();
            runners.push(Runner {
                technique,
                renderer,
                resolved,
                overrides: options,
                unsupported: None,
                error,
            });
        }
        Ok(runners)
    }
}

impl ErrorSequence {
    fn push(
        &mut self,
        shot: &StagedShot,
        reference: &Measurement,
        test: &Measurement,
    ) -> Result<(), JudgeError> {
        let figures = against(shot, reference, test)?;
        self.rel_rmse_sum += figures.rel_rmse;
        self.non_finite += figures.non_finite;
        let pairs = values(&test.image).zip(values(&reference.image));
        self.differences.push(pairs.map(|(test, reference)| test - reference));
        Ok(())
    }
}

/// Camera and lights of a frame.
fn at_frame(
    camera: &Camera,
    lights: &[(Light, bool)],
    frame: u32,
) -> Result<(Camera, Vec<Light>), ModelError> {
    let turns = f64::from(frame) * TURN_DEGREES;
    let lights = lights.iter().map(|(light, has_glass)| match has_glass {
        // Its glass would have to turn with it.
        true => Ok(light.clone()),
        false => turned(light, camera, turns),
    });
    Ok((pan(camera, f64::from(frame) * PAN_PIXELS), lights.collect::<Result<_, _>>()?))
}

/// The camera panned to the right by `pixels`: the image moves to the left as a whole, without parallax.
pub fn pan(camera: &Camera, pixels: f64) -> Camera {
    camera.shifted(pixels, 0.0)
}

/// The light turned by `degrees`: a sun and a cone around the camera's axis that is most across their direction, a
/// lamp around the eye.
pub fn turned(light: &Light, camera: &Camera, degrees: f64) -> Result<Light, ModelError> {
    let axes = [camera.up(), camera.right(), camera.forward()];
    let turn = |vector: DVec3| {
        let across = |axis: &DVec3| axis.dot(vector).abs();
        let axis = axes.into_iter().min_by(|a, b| across(a).total_cmp(&across(b))).unwrap_or(camera.up());
        (DQuat::from_axis_angle(axis, degrees.to_radians()) * vector).to_array()
    };
    match light {
        Light::Directional(sun) => Light::directional(turn(sun.direction()), sun.irradiance()),
        Light::Point(lamp) => {
            let p_from_eye = DVec3::from_array(turn(lamp.position() - camera.eye()));
            Light::point((camera.eye() + p_from_eye).to_array(), lamp.intensity(), lamp.radius())
        }
        Light::Spot(spot) => {
            let [inner, outer] = [spot.cos_inner().acos(), spot.outer()].map(f64::to_degrees);
            let lamp = spot.lamp();
            Light::spot(
                lamp.position().to_array(),
                turn(spot.direction()),
                lamp.intensity(),
                // Degrees from a cosine are off by rounding; inner must not exceed outer.
                inner.min(outer),
                outer,
                lamp.radius(),
            )
        }
    }
}

fn values(image: &RadianceImage) -> impl Iterator<Item = f64> + '_ {
    image.pixels.iter().flatten().map(|&value| f64::from(value))
}

/// No flicker is 0 even of a black image.
fn relative(flicker: f64, mean: f64) -> f64 {
    if flicker == 0.0 { 0.0 } else { flicker / mean }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::perspective([1.0, 2.0, 3.0], [0.0, 1.0, -4.0], [0.0, 1.0, 0.0], 60.0, [8, 6]).unwrap()
    }

    #[test]
    fn every_light_turns_by_the_angle_that_is_asked_for() {
        let degrees = 0.37;
        let angle = |a: DVec3, b: DVec3| a.normalize().angle_between(b.normalize()).to_degrees();
        // Along each axis of the camera, where a fixed axis of rotation would not turn it.
        for direction in [camera().up(), camera().right(), -camera().forward(), DVec3::new(0.3, -1.0, 0.2)] {
            let sun = Light::directional(direction.to_array(), [1.0, 2.0, 3.0]).unwrap();
            let spot = Light::spot([5.0; 3], direction.to_array(), [1.0; 3], 20.0, 20.0, 0.1).unwrap();
            let (Light::Directional(sun), Light::Spot(spot)) =
                (turned(&sun, &camera(), degrees).unwrap(), turned(&spot, &camera(), degrees).unwrap())
            else {
                unreachable!("turning keeps the kind")
            };
            assert!(angle(sun.direction(), direction) > 0.5 * degrees);
            assert!(angle(sun.direction(), direction) < degrees * 1.000_001);
            assert!(angle(spot.direction(), direction) > 0.5 * degrees);
            assert_eq!((sun.irradiance(), spot.lamp().radius()), ([1.0, 2.0, 3.0], 0.1));
        }
        let lamp = Light::point([4.0, 2.5, -6.0], [1.0; 3], 0.0).unwrap();
        let moved = turned(&lamp, &camera(), degrees).unwrap().position().unwrap() - camera().eye();
        let before = lamp.position().unwrap() - camera().eye();
        assert!((moved.length() - before.length()).abs() < 1e-12 && angle(moved, before) > 0.5 * degrees);
    }

    #[test]
    fn a_pan_of_one_pixel_shows_the_neighbour() {
        let (still, moved) =
            (camera().pixel_ray(5, 2).direction, pan(&camera(), 1.0).pixel_ray(4, 2).direction);
        assert!((still - moved).length() < 1e-14);
    }

    #[test]
    fn a_light_behind_glass_stays() {
        let sun = Light::directional([0.3, -1.0, 0.2], [1.0; 3]).unwrap();
        let (_, lights) = at_frame(&camera(), &[(sun.clone(), true), (sun.clone(), false)], 9).unwrap();
        assert!(lights[0] == sun && lights[1] != sun);
    }
}
