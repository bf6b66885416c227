//! `tradeoff`: time against error for every setting of every technique; how time grows with resolution; how much the
//! error flickers in motion.

use std::path::Path;
use std::time::SystemTime;

use anyhow::{Context, bail};
use scatter::{TECHNIQUES, Technique};
use scatter_scene::Shot;
use scatter_validate::matrix::MatrixError;
use scatter_validate::plot::{Plot, svg_file};
use scatter_validate::report::{Report, TradeSection};
use scatter_validate::tradeoff::charts::{scaling_plot, trade_plot};
use scatter_validate::tradeoff::tables::{
    level_markdown, level_table, motion_table, rung_table, scaling_table,
};
use scatter_validate::tradeoff::{
    LevelRow, Limits, MOTION_FRAMES, Motion, MotionRow, Rung, Scaling, ScalingRow, ShotTrade, Slope, Sweep,
    level_rows, slopes,
};
use scatter_validate::{Machine, SHADOW_MAP_TRUTH, Settings};
use serde::Serialize;

use super::validate::{command_line, utc_date};
use crate::Verdict;
use crate::flags::Tradeoff;
use crate::output::{check_folder, check_writable, print, print_json, stderr_line, write_text};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{
    Method, ShotSource, at_size, baseline, check_options, map_size, method, raster_device, shots,
};

/// Longest frame of a setting beyond which finer ones are left out with `--quick` \[ms\].
const QUICK_FRAME_MS: f64 = 150.0;

/// Measures, prints, draws.
pub fn run(flags: &Tradeoff) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let techniques = techniques(flags)?;
    check_options(rendering, &techniques)?;
    let sources = shots(&flags.shots)?;
    if let Some(path) = &flags.plot {
        check_writable(path)?;
    }
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let job = Job { flags, techniques, sources, machine: Machine::this() };
    let settings = Settings {
        quality: rendering.quality,
        overrides: rendering.set.clone(),
        map_size: map_size(rendering),
        raster: raster_device(rendering)?,
        repeat: rendering.repeat,
        threads: 0,
    };
    if flags.scaling {
        job.scaling(settings)
    } else if flags.motion {
        job.motion(settings)
    } else {
        job.sweep(settings)
    }
}

/// What the three kinds of work share.
struct Job<'a> {
    flags: &'a Tradeoff,
    techniques: Vec<&'static dyn Technique>,
    sources: Vec<ShotSource>,
    machine: Machine,
}

#[derive(Serialize)]
struct SweepDocument<'a> {
    machine: &'a Machine,
    rows: Vec<&'a Rung>,
    levels: &'a [LevelRow],
}

#[derive(Serialize)]
struct ScalingDocument<'a> {
    machine: &'a Machine,
    rows: &'a [ScalingRow],
    slopes: &'a [Slope],
}

#[derive(Serialize)]
struct MotionDocument<'a> {
    machine: &'a Machine,
    rows: &'a [MotionRow],
}

impl Job<'_> {
    fn sweep(&self, settings: Settings) -> anyhow::Result<Verdict> {
        let mut limits = Limits::default();
        if self.flags.rendering.quick {
            limits.frame_ms = QUICK_FRAME_MS;
        }
        let techniques = self.techniques.clone();
        let (trades, threads): (Vec<ShotTrade>, usize) =
            self.on_every_shot(settings, |settings, shot, progress| {
                let (techniques, baseline) = (techniques.clone(), baseline());
                Sweep { techniques, baseline, settings, limits }.run(shot, progress)
            })?;
        let levels: Vec<LevelRow> = trades.iter().flat_map(level_rows).collect();
        let map_errors: Vec<(String, f64)> =
            trades.iter().map(|trade| (trade.shot.clone(), trade.map_error.rel_rmse)).collect();
        let plots = || trades.iter().map(|trade| (trade.shot.as_str(), trade_plot(trade))).collect();
        self.write_plot(plots)?;
        let rungs: Vec<String> = trades.iter().map(rung_table).collect();
        let level_text = level_table(&levels, &map_errors);
        self.write_report(TradeSection {
            heading: "Time to each quality level".into(),
            introduction: format!("{}. {LEVELS_MEAN} {RUNGS_MEAN}", self.heading(threads)),
            plots: plots().into_iter().map(|(_, plot)| plot).collect(),
            tables: [("Time to each level".to_string(), level_text.clone())]
                .into_iter()
                .chain(
                    trades
                        .iter()
                        .zip(&rungs)
                        .map(|(trade, table)| (format!("All settings on {}", trade.shot), table.clone())),
                )
                .collect(),
        })?;
        if self.flags.rendering.json {
            let rows = trades.iter().flat_map(|trade| &trade.rungs).collect();
            print_json(&SweepDocument { machine: &self.machine, rows, levels: &levels })?;
        } else if self.flags.markdown {
            print(&level_markdown(&levels, &map_errors))?;
        } else {
            print(&format!("{}\n{}\n\n{RUNGS_MEAN}\n\n", self.machine, self.heading(threads)))?;
            for table in &rungs {
                print(&format!("{table}\n"))?;
            }
            print(&format!("{LEVELS_MEAN}\n\n{level_text}"))?;
        }
        let failed = trades.iter().flat_map(|trade| &trade.rungs).any(|rung| rung.row.has_failed());
        Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
    }

    fn scaling(&self, settings: Settings) -> anyhow::Result<Verdict> {
        let quality = settings.quality;
        let techniques = self.techniques.clone();
        let (rows, threads): (Vec<Vec<ScalingRow>>, usize) =
            self.on_every_shot(settings, |settings, shot, progress| {
                let (techniques, baseline) = (techniques.clone(), baseline());
                Scaling { techniques, baseline, settings }.run(shot, progress)
            })?;
        let rows = rows.concat();
        let slopes = slopes(&rows);
        let baseline = baseline().map(|baseline| baseline.technique.info().id);
        let plots = || {
            let mut shots: Vec<&str> = rows.iter().map(|row| row.row.shot.as_str()).collect();
            shots.dedup();
            shots.into_iter().map(|shot| (shot, scaling_plot(shot, &rows, baseline))).collect()
        };
        self.write_plot(plots)?;
        let table = scaling_table(&rows, &slopes);
        let meaning = format!(
            "Level {quality}: image and shadow map at 1/4, 0.35, 1/2, 0.71 and 1 of their full sides, one thread; \
             the marcher's steps grow with the side. Slope: of log time over the log of the side, least squares."
        );
        self.write_report(TradeSection {
            heading: "Time over resolution".into(),
            introduction: format!("{}. {meaning}", self.heading(threads)),
            plots: plots().into_iter().map(|(_, plot)| plot).collect(),
            tables: vec![("Times and slopes".into(), table.clone())],
        })?;
        if self.flags.rendering.json {
            print_json(&ScalingDocument { machine: &self.machine, rows: &rows, slopes: &slopes })?;
        } else {
            print(&format!("{}\n{}\n{meaning}\n\n{table}", self.machine, self.heading(threads)))?;
        }
        Ok(Verdict::Well)
    }

    fn motion(&self, settings: Settings) -> anyhow::Result<Verdict> {
        let quality = settings.quality;
        let techniques = self.techniques.clone();
        let map_row = self.flags.rendering.methods.iter().any(|id| id == SHADOW_MAP_TRUTH);
        let (rows, threads): (Vec<Vec<MotionRow>>, usize) =
            self.on_every_shot(settings, |settings, shot, progress| {
                let (techniques, baseline) = (techniques.clone(), baseline());
                Motion { techniques, baseline, settings, frames: MOTION_FRAMES, map_row }.run(shot, progress)
            })?;
        let rows = rows.concat();
        let table = motion_table(&rows);
        let meaning = format!(
            "Level {quality}: {MOTION_FRAMES} frames, the camera panned by 0.3 pixels a frame and the light turned by \
             0.02 degrees. Flicker: RMS of the second difference over time, of the error image against shadow-map \
             truth and of that truth itself, over its mean; truth-shadow-map (where it is asked for by --method): of the shadow \
             map's own error against ray-cast truth, and of that."
        );
        self.write_report(TradeSection {
            heading: "Flicker in motion".into(),
            introduction: format!("{}. {meaning}", self.heading(threads)),
            plots: Vec::new(),
            tables: vec![("Flicker".into(), table.clone())],
        })?;
        if self.flags.rendering.json {
            print_json(&MotionDocument { machine: &self.machine, rows: &rows })?;
        } else {
            print(&format!("{}\n{}\n{meaning}\n\n{table}", self.machine, self.heading(threads)))?;
        }
        let failed = rows.iter().any(|row| row.non_finite > 0);
        Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
    }

    /// Loads one shot after the other and measures it, in a pool of the threads that were asked for; with how many
    /// there are.
    fn on_every_shot<R: Send>(
        &self,
        settings: Settings,
        measure: impl Fn(Settings, Shot, &mut dyn FnMut(&str)) -> Result<R, MatrixError> + Sync,
    ) -> anyhow::Result<(Vec<R>, usize)> {
        let rendering = &self.flags.rendering;
        let progress = Progress::new(Some(self.sources.len() as u64), true);
        in_pool(rendering.threads, |threads| {
            let settings = Settings { threads, ..settings };
            let mut results = Vec::new();
            for source in &self.sources {
                progress.stage(&format!("{}: loading", source.label()));
                let shot = at_size(source.load()?, rendering)?;
                results.push(measure(settings.clone(), shot, &mut |stage| progress.stage(stage))?);
                progress.step();
            }
            Ok((results, threads))
        })?
    }

    /// The settings in a line.
    fn heading(&self, threads: usize) -> String {
        let rendering = &self.flags.rendering;
        let size = match (rendering.size, rendering.quick) {
            (Some([width, height]), _) => format!("{width}x{height}"),
            (None, true) => "small images".into(),
            (None, false) => "images of the shots' own sizes".into(),
        };
        let n = map_size(rendering);
        let repeat = rendering.repeat;
        format!("{size}, shadow map {n}x{n}, all: {threads} threads, median of {repeat}")
    }

    fn write_plot<'s>(&self, plots: impl Fn() -> Vec<(&'s str, Plot)>) -> anyhow::Result<()> {
        let Some(path) = &self.flags.plot else { return Ok(()) };
        let (mut plots, wanted) = (plots(), &self.flags.plot_shots);
        if let Some(missing) = wanted.iter().find(|name| plots.iter().all(|(shot, _)| shot != name)) {
            let known: Vec<&str> = plots.iter().map(|(shot, _)| *shot).collect();
            bail!("--plot-shot {missing}: not among the measured shots, which are {}", known.join(", "));
        }
        plots.retain(|(shot, _)| wanted.is_empty() || wanted.iter().any(|name| name == shot));
        let plots: Vec<Plot> = plots.into_iter().map(|(_, plot)| plot).collect();
        write_text(path, &svg_file(&plots, 2))?;
        stderr_line(&format!("wrote {}", path.display()));
        Ok(())
    }

    fn write_report(&self, section: TradeSection) -> anyhow::Result<()> {
        let Some(folder) = &self.flags.report else { return Ok(()) };
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
        let report = Report::new(self.machine.clone(), command_line(), utc_date(SystemTime::now()));
        write_page(&folder.join("tradeoff.html"), &section.html(&report))
    }
}

const RUNGS_MEAN: &str = "Settings: errors against truth-shadow-map, /ray against truth-raycast; level: the finest that \
                          is reached; *: on the Pareto front, no setting of any technique is both faster on one thread \
                          and more exact.";
const LEVELS_MEAN: &str = "Time to each quality level (p99 and rel_rmse both within it): a technique's cheapest setting \
                           that reaches it, ms on one thread, in brackets the marcher's time at its own cheapest over \
                           it; the map's error: rel_rmse of truth-shadow-map against truth-raycast, below which more \
                           accuracy is of no use.";

fn write_page(path: &Path, html: &str) -> anyhow::Result<()> {
    write_text(path, html)?;
    stderr_line(&format!("wrote {}", path.display()));
    Ok(())
}

/// All techniques, or those that are named. References have no settings; in motion the shadow map's own error is
/// worth a row.
fn techniques(flags: &Tradeoff) -> anyhow::Result<Vec<&'static dyn Technique>> {
    if flags.rendering.methods.is_empty() {
        return Ok(TECHNIQUES.to_vec());
    }
    let mut techniques = Vec::new();
    for id in &flags.rendering.methods {
        match method(id)? {
            Method::Technique(technique) => techniques.push(technique),
            Method::ShadowMapTruth if flags.motion => {}
            _ => bail!("--method {id}: a reference has no settings to choose from; name a technique"),
        }
    }
    Ok(techniques)
}
