//! `plan --survey`: what techniques predict of themselves against what is measured, and what `auto` loses to the best of them.
//!
//! Every technique runs at every level on every shot; a plan for each level is held against the fastest of those runs that
//! reached it. Ratios are measured over predicted; the median of their distance from 1 and the worst row are printed, over all and
//! a technique each.

mod rows;
mod tables;
mod taken;

use scatter::{Budget, Estimate, Machine, Outlook, Quality, SceneSample, TECHNIQUES, Target, Technique};
use scatter_validate::{JudgedShot, MapJudgedShot, StagedShot};

use rows::{AutoRow, MapRow, Survey, SurveyRow, TimeRow};
use taken::{Taken, measured};

use crate::Verdict;
use crate::flags::Plan as Flags;
use crate::machine_file::machine_of;
use crate::output::{print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, check_options, load, method, raster_device, resolution, shots};

/// Timed runs, at least, whose median counts.
const TIMED_RUNS: u32 = 2;

/// Measures and prints.
pub fn run(flags: &Flags) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let methods = rendering.methods.iter().map(|id| method(id)).collect::<anyhow::Result<Vec<_>>>()?;
    let named: Vec<&'static dyn Technique> = methods
        .iter()
        .filter_map(|method| if let Method::Technique(technique) = method { Some(*technique) } else { None })
        .collect();
    let techniques = if named.is_empty() { TECHNIQUES.to_vec() } else { named };
    check_options(&rendering.set, &techniques)?;
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
        self.add_times(judged, first, machine, repeat)
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
        let rows = &self.rows[first..];
        let Some(taken) = Taken::for_budget(judged, Budget::Level(level), rows, machine, repeat)? else {
            return Ok(());
        };
        let Taken { method, setting, time_ms, p99, rel_rmse, plan_ms } = taken;
        let reaches = |p99: f64, rel_rmse: f64| p99.max(rel_rmse) <= level.error();
        let best = rows
            .iter()
            .filter(|row| reaches(row.p99, row.rel_rmse))
            .min_by(|a, b| a.time_ms.total_cmp(&b.time_ms));
        let own = (method, time_ms);
        let (best_method, best_ms) =
            best.map(|row| (row.method, row.time_ms)).filter(|best| best.1 < time_ms).unwrap_or(own);
        self.auto.push(AutoRow {
            shot: judged.shot().name().to_string(),
            size: judged.shot().camera().size(),
            threads: machine.threads(),
            level: level.to_string(),
            method: method.to_string(),
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

    /// Plans for times around what the rows of the shot, which start at `first`, took.
    fn add_times(
        &mut self,
        judged: &MapJudgedShot,
        first: usize,
        machine: &Machine,
        repeat: u32,
    ) -> anyhow::Result<()> {
        let rows = &self.rows[first..];
        let mut times: Vec<f64> = rows.iter().map(|row| row.time_ms).collect();
        times.sort_by(f64::total_cmp);
        let (Some(&least), Some(&middle)) = (times.first(), times.get(times.len() / 2)) else {
            return Ok(());
        };
        for budget_ms in [1.1 * least, (least * middle).sqrt(), 1.1 * middle] {
            let budget = Budget::Time(budget_ms);
            let Some(taken) = Taken::for_budget(judged, budget, rows, machine, repeat)? else { continue };
            let error = |row: &SurveyRow| row.p99.max(row.rel_rmse);
            let within = rows.iter().filter(|row| row.time_ms <= budget_ms);
            self.times.push(TimeRow {
                shot: judged.shot().name().to_string(),
                budget_ms,
                method: taken.method.to_string(),
                setting: taken.setting,
                time_ms: taken.time_ms,
                error: taken.p99.max(taken.rel_rmse),
                best_error: within.map(error).min_by(f64::total_cmp),
            });
        }
        Ok(())
    }
}
