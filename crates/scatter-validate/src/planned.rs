//! A shot whose techniques a planner chooses: a pass a light, each with what the planner took for it.
//!
//! The matrix names no technique and knows no planner: it is given one.

use std::collections::BTreeMap;
use std::time::Instant;

use scatter_core::{Frame, OptionError, Target, Technique, VolumetricShadow};

use crate::judge_error::JudgeError;
use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::staged_shot::StagedShot;

/// Chooses a technique and its options for a frame.
pub trait Planner {
    /// The choice for one light's frame of a shot with so many lights; an error says why there is none.
    fn plan(&self, frame: &Frame<'_>, light_count: usize) -> Result<PlannedPass, String>;
}

/// What a planner took.
pub struct PlannedPass {
    /// The technique.
    pub technique: &'static dyn Technique,
    /// What it is configured for.
    pub target: Target,
    /// Options over its own choice.
    pub overrides: Vec<(&'static str, String)>,
    /// The technique so configured.
    pub instance: Box<dyn VolumetricShadow>,
}

/// What planned passes are.
pub struct Choice {
    /// The ids of the techniques, ` / ` between those of different lights.
    pub method: String,
    /// The values of all options.
    pub options: BTreeMap<String, String>,
    /// Those that the planner set.
    pub overrides: BTreeMap<String, String>,
}

/// What `requested` says of rows that a planner chose.
pub const AUTO: &str = "auto";

/// Plans every light's frame and renders the shot; `plan` is the planner's share of the time's `total`, one call a light.
pub fn measure_planned(
    shot: &StagedShot,
    planner: &dyn Planner,
    repeat: u32,
) -> Result<(Measurement, Choice), JudgeError> {
    let count = shot.light_count();
    let (mut instances, mut ids, mut plan_ms) = (Vec::new(), Vec::new(), 0.0);
    let [mut options, mut overrides] = [BTreeMap::new(), BTreeMap::new()];
    for (index, facts) in shot.facts()?.iter().enumerate() {
        // A frame is checked once, whoever renders it, and no technique's time has that in it.
        let (pass, elapsed) = shot.with_frame(index, shot.camera(), |frame| {
            let start = Instant::now();
            (planner.plan(frame, count), start.elapsed())
        })?;
        plan_ms += elapsed.as_secs_f64() * 1e3;
        let pass = pass.map_err(|reason| JudgeError::Plan { shot: shot.name().to_string(), reason })?;
        let pairs: Vec<_> = pass.overrides.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let resolved: Result<_, OptionError> = pass.technique.resolved(pass.target, &pairs, facts);
        join(&mut options, resolved?);
        join(&mut overrides, pass.overrides);
        ids.push(pass.technique.info().id);
        instances.push(pass.instance);
    }
    let mut renderer = Renderer::PerLight(instances);
    let mut measurement = match measure(shot, &mut renderer, repeat)? {
        Outcome::Measured(measurement) => *measurement,
        // Plans are made of what supports the frame.
        Outcome::Unsupported(unsupported) => {
            return Err(JudgeError::Plan { shot: shot.name().to_string(), reason: unsupported.to_string() });
        }
    };
    *measurement.time_ms.entry("total".into()).or_default() += plan_ms;
    measurement.time_ms.insert("plan".into(), plan_ms);
    ids.dedup();
    Ok((measurement, Choice { method: ids.join(" / "), options, overrides }))
}

/// Adds one light's values to those of the lights before it.
fn join(all: &mut BTreeMap<String, String>, own: Vec<(&'static str, String)>) {
    for (key, value) in own {
        match all.get_mut(key) {
            None => {
                all.insert(key.to_string(), value);
            }
            Some(values) if values.rsplit(" / ").next() != Some(value.as_str()) => {
                values.push_str(" / ");
                values.push_str(&value);
            }
            Some(_) => {}
        }
    }
}
