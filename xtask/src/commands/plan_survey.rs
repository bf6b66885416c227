//! `plan --survey`: what techniques predict of themselves against what is measured, and what `auto` loses to the best of them.
//!
//! Every technique runs at every level on every shot; a plan for each level is held against the fastest of those runs that
//! reached it. Ratios are measured over predicted; the median of their distance from 1 and the worst row are printed, over all and
//! a technique each.

use std::fmt::Write;

use anyhow::Context;
use scatter::{
    Budget, Estimate, Machine, Outlook, Quality, SceneSample, TECHNIQUES, Target, Technique, plan,
};
use scatter_validate::measure::{Outcome, Renderer, measure};
use scatter_validate::{JudgedShot, MapJudgedShot, StagedShot};
use serde::Serialize;

use crate::Verdict;
use crate::flags::Plan as Flags;
use crate::machine_file::machine_of;
use crate::output::{print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, check_options, load, method, raster_device, resolution, shots};

/// Below it errors are rounding, whose ratio says nothing.
const ROUNDING: f64 = 1e-3;
/// Timed runs, at least, whose median counts.
const TIMED_RUNS: u32 = 2;

/// A technique at a level on a shot.
#[derive(Debug, Clone, Serialize)]
struct SurveyRow {
    shot: String,
    size: [u32; 2],
    threads: usize,
    method: &'static str,
    level: String,
    time_ms: f64,
    predicted_ms: f64,
    p99: f64,
    predicted_p99: f64,
    rel_rmse: f64,
    predicted_rel_rmse: f64,
}

/// What `auto` took for a level.
#[derive(Debug, Clone, Serialize)]
struct AutoRow {
    shot: String,
    size: [u32; 2],
    threads: usize,
    level: String,
    method: String,
    setting: String,
    time_ms: f64,
    best_method: &'static str,
    best_ms: f64,
    p99: f64,
    rel_rmse: f64,
    reached: bool,
    plan_ms: f64,
}

/// What a shot's map itself is off by: rel_rmse of shadow-map truth against ray-cast truth.
#[derive(Debug, Clone, Serialize)]
struct MapRow {
    shot: String,
    side: u32,
    error: f64,
    predicted_error: f64,
}

#[derive(Debug, Default, Serialize)]
struct Survey {
    rows: Vec<SurveyRow>,
    auto: Vec<AutoRow>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    maps: Vec<MapRow>,
}

/// Measures and prints.
pub fn run(flags: &Flags) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let methods = rendering.methods.iter().map(|id| method(id)).collect::<anyhow::Result<Vec<_>>>()?;
    let named: Vec<&'static dyn Technique> = methods
        .iter()
        .filter_map(|method| if let Method::Technique(technique) = method { Some(*technique) } else { None })
        .collect();
    let techniques = if named.is_empty() { TECHNIQUES.to_vec() } else { named };
    check_options(rendering, &techniques)?;
    let machine = machine_of(flags.machine.as_deref())?;
    let raster = raster_device(&rendering.maps)?;
    let sources = shots(&flags.shots)?;
    let progress = Progress::new(Some(sources.len() as u64));
    let survey = in_pool(rendering.threads, |threads| {
        let machine = machine.with_threads(threads);
        let mut survey = Survey::default();
        for source in &sources {
            progress.stage(&format!("{}: maps and truth", source.label()));
            let shot = load(source, rendering)?;
            let shot = StagedShot::with_source(shot, resolution(rendering), raster.as_ref())?;
            // A plan is one light's; several lights are several plans.
            if shot.light_count() != 1 {
                stderr_line(&format!("note: {}: several lights; left out of the survey", shot.name()));
                continue;
            }
            if flags.check {
                let judged = JudgedShot::new(shot, &mut |truth| {
                    progress.stage(&format!("{}: {truth}", source.label()));
                })?;
                survey.add_map(&judged)?;
                progress.step();
                continue;
            }
            let judged = MapJudgedShot::new(shot)?;
            survey.add(&judged, &techniques, &machine, rendering.repeat.max(TIMED_RUNS), &progress)?;
            progress.step();
        }
        anyhow::Ok(survey)
    })??;
    drop(progress);
    if rendering.json {
        print_json(&survey)?
    } else {
        print(&if flags.check { survey.map_text() } else { survey.text() })?
    }
    Ok(Verdict::Well)
}

impl Survey {
    fn add(
        &mut self,
        judged: &MapJudgedShot,
        techniques: &[&'static dyn Technique],
        machine: &Machine,
        repeat: u32,
        progress: &Progress,
    ) -> anyhow::Result<()> {
        let shot = judged.shot();
        let first = self.rows.len();
        for &technique in techniques {
            let id = technique.info().id;
            progress.stage(&format!("{}: {id}", shot.name()));
            let mut before: Option<(Vec<(&'static str, String)>, SurveyRow)> = None;
            for level in Quality::ALL {
                let target = Target::Quality(level);
                let (estimate, facts) = shot.with_frame(0, shot.camera(), |frame| {
                    let sample = SceneSample::of(frame);
                    let estimate: Option<Estimate> =
                        technique.estimate(target, &[], &Outlook { frame, sample: &sample, machine }).ok();
                    (estimate, sample.facts)
                })?;
                let Some(estimate) = estimate else { continue };
                // Levels that are the same setting are one measurement.
                let options = technique.resolved(target, &[], &facts)?;
                let same = before.as_ref().filter(|(own, _)| *own == options);
                let found = match same {
                    Some((_, row)) => Some([row.time_ms, row.p99, row.rel_rmse]),
                    None => measured(judged, technique, target, &[], repeat)?,
                };
                let Some([time_ms, p99, rel_rmse]) = found else { continue };
                let row = SurveyRow {
                    shot: shot.name().to_string(),
                    size: shot.camera().size(),
                    threads: machine.threads(),
                    method: id,
                    level: level.to_string(),
                    time_ms,
                    predicted_ms: estimate.time_ms,
                    p99,
                    predicted_p99: estimate.error.p99,
                    rel_rmse,
                    predicted_rel_rmse: estimate.error.rel_rmse,
                };
                before = Some((options, row.clone()));
                self.rows.push(row);
            }
        }
        progress.stage(&format!("{}: auto", shot.name()));
        for level in Quality::ALL {
            self.add_plan(judged, level, first, machine, repeat)?;
        }
        Ok(())
    }

    /// What the map itself is off by, and what the sample says of it.
    fn add_map(&mut self, judged: &JudgedShot) -> anyhow::Result<()> {
        let shot = judged.shot();
        let (side, predicted_error) = shot.with_frame(0, shot.camera(), |frame| {
            let sample = SceneSample::of(frame);
            (sample.facts.shadow_map_side, sample.map_error(1.0))
        })?;
        let error = judged.map_error()?.rel_rmse;
        self.maps.push(MapRow { shot: shot.name().to_string(), side, error, predicted_error });
        Ok(())
    }

    /// The plan for a level beside the rows of the shot, which start at `first`.
    fn add_plan(
        &mut self,
        judged: &MapJudgedShot,
        level: Quality,
        first: usize,
        machine: &Machine,
        repeat: u32,
    ) -> anyhow::Result<()> {
        let shot = judged.shot();
        let start = std::time::Instant::now();
        let plan = shot.with_frame(0, shot.camera(), |frame| plan(frame, Budget::Level(level), machine))?;
        let plan = plan.with_context(|| shot.name().to_string())?;
        let plan_ms = start.elapsed().as_secs_f64() * 1e3;
        let overrides: Vec<_> = plan.overrides.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let setting = match (plan.target, overrides.as_slice()) {
            (Target::Quality(level), []) => level.to_string(),
            (_, overrides) => {
                overrides.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
            }
        };
        let rows = &self.rows[first..];
        // A preset that has its row is not measured again: its time would differ by noise.
        let id = plan.technique.info().id;
        let row = rows.iter().find(|row| row.method == id && row.level == setting);
        let found = match row {
            Some(row) => Some([row.time_ms, row.p99, row.rel_rmse]),
            None => measured(judged, plan.technique, plan.target, &overrides, repeat)?,
        };
        let Some([time_ms, p99, rel_rmse]) = found else { return Ok(()) };
        let reaches = |p99: f64, rel_rmse: f64| p99.max(rel_rmse) <= level.error();
        let best = rows
            .iter()
            .filter(|row| reaches(row.p99, row.rel_rmse))
            .min_by(|a, b| a.time_ms.total_cmp(&b.time_ms));
        let own = (id, time_ms);
        let (best_method, best_ms) =
            best.map(|row| (row.method, row.time_ms)).filter(|best| best.1 < time_ms).unwrap_or(own);
        self.auto.push(AutoRow {
            shot: shot.name().to_string(),
            size: shot.camera().size(),
            threads: machine.threads(),
            level: level.to_string(),
            method: id.to_string(),
            setting,
            time_ms,
            best_method,
            best_ms,
            p99,
            rel_rmse,
            reached: reaches(p99, rel_rmse),
            plan_ms,
        });
        Ok(())
    }

    /// The maps' own errors.
    fn map_text(&self) -> String {
        let mut text =
            String::from("shot                               map side    off by  predicted  ratio\n");
        for MapRow { shot, side, error, predicted_error } in &self.maps {
            let [off, predicted] = [error, predicted_error].map(|error| 100.0 * error);
            let ratio = off / predicted;
            let _ = writeln!(text, "{shot:<34} {side:>8}  {off:>6.2} %   {predicted:>6.2} %  {ratio:>5.2}");
        }
        text
    }

    fn text(&self) -> String {
        let mut text = String::from(
            "measured over predicted       rows  time: median off, worst      p99: median off, worst\n",
        );
        let ids: Vec<&str> = TECHNIQUES.iter().map(|technique| technique.info().id).collect();
        for id in ids.iter().copied().map(Some).chain([None]) {
            let of = |row: &&SurveyRow| id.is_none_or(|id| row.method == id);
            let rows: Vec<&SurveyRow> = self.rows.iter().filter(of).collect();
            if rows.is_empty() {
                continue;
            }
            let times = rows.iter().map(|row| (row.time_ms / row.predicted_ms, *row)).collect();
            let seen = |row: &&&SurveyRow| row.p99.max(row.predicted_p99) > ROUNDING;
            let errors: Vec<_> =
                rows.iter().filter(seen).map(|row| (row.p99 / row.predicted_p99, *row)).collect();
            let _ = writeln!(
                text,
                "{:<28} {:>5}  {}  {}",
                id.unwrap_or("all"),
                rows.len(),
                spread(times),
                spread(errors)
            );
        }
        text.push_str("\nauto                               level    took                           ms  best                 ms  ratio  plan ms  p99 %\n");
        for row in &self.auto {
            let _ = writeln!(
                text,
                "{:<34} {:<8} {:<22} {:>10.1}  {:<15} {:>8.1}  {:>5.2}  {:>7.2}  {:.3}{}",
                row.shot,
                row.level,
                format!("{} {}", row.method, row.setting),
                row.time_ms,
                row.best_method,
                row.best_ms,
                row.time_ms / row.best_ms,
                row.plan_ms,
                100.0 * row.p99,
                if row.reached { "" } else { "  MISSED" }
            );
        }
        let mut ratios: Vec<f64> = self.auto.iter().map(|row| row.time_ms / row.best_ms).collect();
        ratios.sort_by(f64::total_cmp);
        if let (Some(median), Some(worst)) = (ratios.get(ratios.len() / 2), ratios.last()) {
            let missed = self.auto.iter().filter(|row| !row.reached).count();
            let _ = writeln!(
                text,
                "auto over the best: median {median:.2}, worst {worst:.2}; {missed} of {} levels missed",
                ratios.len()
            );
        }
        text
    }
}

/// The median distance of ratios from 1, as a factor, and the row that is farthest.
fn spread(mut ratios: Vec<(f64, &SurveyRow)>) -> String {
    let off = |ratio: f64| ratio.max(1.0 / ratio);
    ratios.retain(|(ratio, _)| ratio.is_finite() && *ratio > 0.0);
    ratios.sort_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let (Some((median, _)), Some((worst, row))) = (ratios.get(ratios.len() / 2), ratios.last()) else {
        return "-".into();
    };
    let percent = 100.0 * (off(*median) - 1.0);
    format!("{percent:>4.0} %, {worst:.2} ({} {})", row.shot, row.level)
}

/// Time \[ms\], p99 and relative RMSE; `None` where the frame is refused.
fn measured(
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
