//! What a plan takes, and how a technique's setting is measured.

use std::time::Instant;

use anyhow::Context;
use scatter::{Budget, Machine, Target, Technique, plan};
use scatter_validate::MapJudgedShot;
use scatter_validate::measure::{Outcome, Renderer, measure};

use super::rows::SurveyRow;

/// What a plan took, and what was measured of it.
pub struct Taken {
    pub method: &'static str,
    pub setting: String,
    pub time_ms: f64,
    pub p99: f64,
    pub rel_rmse: f64,
    pub plan_ms: f64,
}

impl Taken {
    /// Plans and measures; `None` where the frame is refused. A preset that has its row is not measured again: its time would
    /// differ by noise.
    pub fn for_budget(
        judged: &MapJudgedShot,
        budget: Budget,
        rows: &[SurveyRow],
        machine: &Machine,
        repeat: u32,
    ) -> anyhow::Result<Option<Self>> {
        let shot = judged.shot();
        let (plan, elapsed) = shot.with_frame(0, shot.camera(), |frame| {
            let start = Instant::now();
            (plan(frame, budget, machine), start.elapsed())
        })?;
        let plan = plan.with_context(|| shot.name().to_string())?;
        let plan_ms = elapsed.as_secs_f64() * 1e3;
        let overrides: Vec<_> = plan.overrides.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let setting = match (plan.target, overrides.as_slice()) {
            (Target::Quality(level), []) => level.to_string(),
            (_, overrides) => {
                overrides.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
            }
        };
        let method = plan.technique.info().id;
        let found = match rows.iter().find(|row| row.method == method && row.level == setting) {
            Some(row) => Some([row.time_ms, row.p99, row.rel_rmse]),
            None => measured(judged, plan.technique, plan.target, &overrides, repeat)?,
        };
        Ok(found.map(|[time_ms, p99, rel_rmse]| Self { method, setting, time_ms, p99, rel_rmse, plan_ms }))
    }
}

/// Time \[ms\], p99 and relative RMSE; `None` where the frame is refused.
pub fn measured(
    judged: &MapJudgedShot,
    technique: &dyn Technique,
    target: Target,
    overrides: &[(&str, &str)],
    repeat: u32,
) -> anyhow::Result<Option<[f64; 3]>> {
    let shot = judged.shot();
    let mut renderer = Renderer::configured(technique, target, overrides, shot)??;
    Ok(match measure(shot, &mut renderer, repeat)? {
        Outcome::Unsupported(_) => None,
        Outcome::Measured(measurement) => {
            let figures = judged.figures(&measurement)?;
            Some([measurement.total_ms().unwrap_or(f64::NAN), figures.p99, figures.rel_rmse])
        }
    })
}
