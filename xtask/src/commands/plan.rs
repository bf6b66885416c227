//! `plan`: a scene and a budget go in; the technique to take, its settings, predicted time and error come out; with `--check`
//! what was then measured.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Instant;

use anyhow::Context;
use scatter::{Budget, Machine, MapKindAdvice, Plan, Quality, Target, plan};
use scatter_validate::planned::measure_planned;
use scatter_validate::{JudgedShot, StagedShot};
use serde::Serialize;

use super::plan_survey;
use crate::Verdict;
use crate::auto::AutoPlanner;
use crate::flags::Plan as Flags;
use crate::machine_file::machine_of;
use crate::output::{print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{load, raster_device, resolution, shot};

/// Everything that `plan --json` prints.
#[derive(Debug, Serialize)]
struct Document {
    shot: String,
    machine: String,
    machine_is_built_in: bool,
    threads: usize,
    budget: String,
    passes: Vec<Pass>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<Measured>,
}

/// The plan of one light.
#[derive(Debug, Serialize)]
struct Pass {
    method: &'static str,
    level: Option<String>,
    overrides: BTreeMap<&'static str, String>,
    predicted: Prediction,
    keeps_budget: bool,
    plan_ms: f64,
    sampled_rays: usize,
    sentence: String,
    rejected: Vec<RejectedRow>,
    map: MapRow,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Prediction {
    time_ms: f64,
    p99: f64,
    rel_rmse: f64,
    memory_bytes: u64,
}

#[derive(Debug, Serialize)]
struct RejectedRow {
    method: &'static str,
    reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    predicted: Option<Prediction>,
}

#[derive(Debug, Serialize)]
struct MapRow {
    predicted_error: f64,
    side: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    wanted_side: Option<u32>,
    advice: &'static str,
}

/// What was measured: time of the frames after the plan.
#[derive(Debug, Serialize)]
struct Measured {
    time_ms: f64,
    p99: f64,
    rel_rmse: f64,
    memory_bytes: u64,
    /// rel_rmse of shadow-map truth against ray-cast truth.
    map_error: f64,
}

/// Plans, prints, checks.
pub fn run(flags: &Flags) -> anyhow::Result<Verdict> {
    if flags.survey {
        return plan_survey::run(flags);
    }
    let name = flags.shots.first().context("--shot: name the shot to plan for")?;
    if flags.shots.len() > 1 {
        anyhow::bail!("--shot: plan takes one shot; give the option once, or add --survey");
    }
    let budget = budget_of(flags)?;
    let machine = machine_of(flags.machine.as_deref())?;
    let raster = raster_device(&flags.rendering.maps)?;
    let source = shot(name)?;
    let progress = Progress::new(None);
    let document = in_pool(flags.rendering.threads, |threads| {
        progress.stage(&format!("{}: maps", source.label()));
        let shot = load(&source, &flags.rendering)?;
        let shot = StagedShot::with_source(shot, resolution(&flags.rendering), raster.as_ref())?;
        let machine = machine.with_threads(threads);
        document(flags, shot, budget, machine, &progress)
    })??;
    drop(progress);
    if document.machine_is_built_in {
        stderr_line("note: times are those of the built-in machine; cargo xtask calibrate measures this one");
    }
    if flags.rendering.json {
        print_json(&document)?
    } else {
        print(&text(&document))?
    }
    Ok(Verdict::Well)
}

/// `--error`, `--promise` or `--time`; the level of `--quality` where none is given.
fn budget_of(flags: &Flags) -> anyhow::Result<Budget> {
    Ok(match (&flags.error, flags.promise, flags.time) {
        (Some(text), ..) => match (text.parse::<Quality>(), text.parse::<f64>()) {
            (Ok(level), _) => Budget::Level(level),
            (_, Ok(error)) => Budget::Error(error),
            _ => anyhow::bail!("--error {text}: give preview, game, film, or a number in (0, 1)"),
        },
        (None, Some(error), _) => Budget::Promise(error),
        (None, None, Some(time)) => Budget::Time(time),
        (None, None, None) => Budget::Level(flags.rendering.quality),
    })
}

fn document(
    flags: &Flags,
    shot: StagedShot,
    budget: Budget,
    machine: Machine,
    progress: &Progress,
) -> anyhow::Result<Document> {
    progress.stage(&format!("{}: plan", shot.name()));
    let (name, threads) = (shot.name().to_string(), machine.threads());
    let (machine_name, machine_is_built_in) = (machine.name().to_string(), machine.is_built_in());
    let planner = AutoPlanner { budget, machine };
    let mut passes = Vec::new();
    for index in 0..shot.light_count() {
        let pass = shot.with_frame(index, shot.camera(), |frame| {
            let start = Instant::now();
            let plan = plan(frame, planner.of_light(shot.light_count()), &planner.machine)?;
            anyhow::Ok(Pass::of(&plan, start.elapsed().as_secs_f64() * 1e3))
        })?;
        passes.push(pass.with_context(|| name.clone())?);
    }
    let measured = if flags.check {
        let judged = JudgedShot::new(shot, &mut |truth| progress.stage(&format!("{name}: {truth}")))?;
        progress.stage(&format!("{name}: check"));
        let (measurement, _) = measure_planned(judged.shot(), &planner, flags.rendering.repeat.max(3))?;
        let figures = judged.by_map().figures(&measurement)?;
        let of = |stage: &str| measurement.time_ms.get(stage).copied().unwrap_or_default();
        Some(Measured {
            time_ms: of("total") - of("plan"),
            p99: figures.p99,
            rel_rmse: figures.rel_rmse,
            memory_bytes: measurement.memory_bytes,
            map_error: judged.map_error()?.rel_rmse,
        })
    } else {
        None
    };
    Ok(Document {
        shot: name,
        machine: machine_name,
        machine_is_built_in,
        threads,
        budget: budget.to_string(),
        passes,
        measured,
    })
}

impl Pass {
    fn of(plan: &Plan, plan_ms: f64) -> Self {
        let prediction = |estimate: &scatter::Estimate| Prediction {
            time_ms: estimate.time_ms,
            p99: estimate.error.p99,
            rel_rmse: estimate.error.rel_rmse,
            memory_bytes: estimate.memory_bytes,
        };
        let rejected = plan.rejected.iter().map(|own| RejectedRow {
            method: own.id,
            reason: own.reason.clone(),
            predicted: own.estimate.as_ref().map(prediction),
        });
        Self {
            method: plan.technique.info().id,
            level: match plan.target {
                Target::Quality(level) => Some(level.to_string()),
                Target::Error(_) => None,
            },
            overrides: plan.overrides.iter().cloned().collect(),
            predicted: prediction(&plan.estimate),
            keeps_budget: plan.keeps_budget,
            plan_ms,
            sampled_rays: plan.sampled_rays,
            sentence: plan.sentence.clone(),
            rejected: rejected.collect(),
            map: MapRow {
                predicted_error: plan.map.error,
                side: plan.map.side,
                wanted_side: plan.map.wanted_side,
                advice: match plan.map.kind {
                    MapKindAdvice::Keep => "one",
                    MapKindAdvice::Cascades => "cascades",
                    MapKindAdvice::NoneSuffices => "none suffices",
                },
            },
        }
    }
}

fn text(document: &Document) -> String {
    let mut text = format!("{}, {} thread(s)\n", document.shot, document.threads);
    for pass in &document.passes {
        let _ = writeln!(text, "{}", pass.sentence);
        let Prediction { time_ms, p99, rel_rmse, memory_bytes } = pass.predicted;
        let _ = writeln!(
            text,
            "  predicted {time_ms:.1} ms, p99 {:.3} %, rel_rmse {:.3} %, {:.1} MB; planned in {:.2} ms from {} rays",
            100.0 * p99,
            100.0 * rel_rmse,
            1e-6 * memory_bytes as f64,
            pass.plan_ms,
            pass.sampled_rays
        );
        for own in &pass.rejected {
            let _ = writeln!(text, "  not {:<16} {}", own.method, own.reason);
        }
    }
    if let Some(Measured { time_ms, p99, rel_rmse, memory_bytes, map_error }) = document.measured {
        let _ = writeln!(
            text,
            "  measured  {time_ms:.1} ms, p99 {:.3} %, rel_rmse {:.3} %, {:.1} MB; the map itself is off by {:.2} %",
            100.0 * p99,
            100.0 * rel_rmse,
            1e-6 * memory_bytes as f64,
            100.0 * map_error
        );
    }
    text
}
