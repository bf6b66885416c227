//! `tradeoff`: time against error for every setting of every technique; how time grows with resolution; how much the
//! error flickers in motion.

use anyhow::bail;
use scatter::{TECHNIQUES, Technique};
use scatter_validate::plot::{Plot, svg_file};
use scatter_validate::report::{Section, TradeSection};
use scatter_validate::tradeoff::charts::{scaling_plot, trade_plot};
use scatter_validate::tradeoff::tables::{
    level_table, motion_table, rung_table, scaling_table, winner_table,
};
use scatter_validate::tradeoff::{
    LevelRow, MOTION_FRAMES, Motion, MotionRow, Rung, Scaling, ScalingRow, Slope, Winner, level_rows, slopes,
    winners,
};
use scatter_validate::{Machine, SHADOW_MAP_TRUTH};
use serde::Serialize;

use super::page;
use super::sweep::{HEADING, Job, LEVELS_MEAN, RUNGS_MEAN, WINNERS_MEAN, map_errors};
use crate::Verdict;
use crate::flags::{Device, Tradeoff};
use crate::gpu;
use crate::output::{check_folder, check_writable, print, print_json, stderr_line, write_text};
use crate::select::{Method, baseline, check_options, method, raster_device, shots};

/// Measures, prints, draws.
pub fn run(flags: &Tradeoff) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let techniques = techniques(flags)?;
    gpu::choose(&rendering.on, techniques.iter().any(|technique| technique.info().id.ends_with("@gpu")))?;
    if let Some(id) = gpu::emulated(&techniques).first() {
        bail!(
            "tradeoff of {id}: a software driver stands for the GPU, and its times are not a GPU's; run it on a machine with a card, or \
             `validate --device gpu` for the errors"
        );
    }
    check_options(&rendering.set, &techniques)?;
    let sources = shots(&flags.shots)?;
    if let Some(path) = &flags.plot {
        check_writable(path)?;
    }
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let job = Job::new(rendering.clone(), techniques, sources, raster_device(&rendering.maps)?);
    let run = Run { flags, job, machine: Machine::this() };
    if flags.scaling {
        run.scaling()
    } else if flags.motion {
        run.motion()
    } else {
        run.sweep()
    }
}

/// What the three kinds of work share.
struct Run<'a> {
    flags: &'a Tradeoff,
    job: Job,
    machine: Machine,
}

#[derive(Serialize)]
struct SweepDocument<'a> {
    machine: &'a Machine,
    rows: Vec<&'a Rung>,
    levels: &'a [LevelRow],
    winners: Vec<Winner>,
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

impl Run<'_> {
    fn sweep(&self) -> anyhow::Result<Verdict> {
        let (trades, threads) = self.job.sweep()?;
        let levels: Vec<LevelRow> = trades.iter().flat_map(level_rows).collect();
        let level_table = level_table(&levels, &map_errors(&trades));
        self.write_plot(|| trades.iter().map(|trade| (trade.shot.as_str(), trade_plot(trade))).collect())?;
        self.write_report(HEADING, || self.job.section(&trades, threads))?;
        if self.flags.rendering.json {
            let rows = trades.iter().flat_map(|trade| &trade.rungs).collect();
            print_json(&SweepDocument {
                machine: &self.machine,
                rows,
                levels: &levels,
                winners: winners(&levels),
            })?;
        } else if self.flags.winners {
            let table = winner_table(&levels);
            print(&if self.flags.markdown {
                table.markdown()
            } else {
                format!("{WINNERS_MEAN}\n\n{table}")
            })?;
        } else if self.flags.markdown {
            print(&level_table.markdown())?;
        } else {
            print(&format!("{}\n{}\n\n{RUNGS_MEAN}\n\n", self.machine, self.job.heading(threads)))?;
            for trade in &trades {
                print(&format!("{}\n", rung_table(trade)))?;
            }
            print(&format!("{LEVELS_MEAN}\n\n{level_table}\n"))?;
            print(&format!("{WINNERS_MEAN}\n\n{}", winner_table(&levels)))?;
        }
        let failed = trades.iter().flat_map(|trade| &trade.rungs).any(|rung| rung.row.has_failed());
        Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
    }

    fn scaling(&self) -> anyhow::Result<Verdict> {
        let quality = self.job.settings.quality;
        let techniques = self.job.techniques.clone();
        let (rows, threads): (Vec<Vec<ScalingRow>>, usize) =
            self.job.on_every_shot(|settings, shot, progress| {
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
        self.write_report("Time over resolution", || TradeSection {
            introduction: format!("{}. {meaning}", self.job.heading(threads)),
            plots: plots().into_iter().map(|(_, plot)| plot).collect(),
            table: table.clone(),
            meaning_of_details: String::new(),
            details: Vec::new(),
        })?;
        if self.flags.rendering.json {
            print_json(&ScalingDocument { machine: &self.machine, rows: &rows, slopes: &slopes })?;
        } else {
            print(&format!("{}\n{}\n{meaning}\n\n{table}", self.machine, self.job.heading(threads)))?;
        }
        Ok(Verdict::Well)
    }

    fn motion(&self) -> anyhow::Result<Verdict> {
        let quality = self.job.settings.quality;
        let techniques = self.job.techniques.clone();
        let map_row = self.flags.rendering.methods.iter().any(|id| id == SHADOW_MAP_TRUTH);
        let (rows, threads): (Vec<Vec<MotionRow>>, usize) =
            self.job.on_every_shot(|settings, shot, progress| {
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
        self.write_report("Flicker in motion", || TradeSection {
            introduction: format!("{}. {meaning}", self.job.heading(threads)),
            plots: Vec::new(),
            table: table.clone(),
            meaning_of_details: String::new(),
            details: Vec::new(),
        })?;
        if self.flags.rendering.json {
            print_json(&MotionDocument { machine: &self.machine, rows: &rows })?;
        } else {
            print(&format!("{}\n{}\n{meaning}\n\n{table}", self.machine, self.job.heading(threads)))?;
        }
        let failed = rows.iter().any(|row| row.non_finite > 0);
        Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
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

    fn write_report(&self, heading: &str, section: impl FnOnce() -> TradeSection) -> anyhow::Result<()> {
        let Some(folder) = &self.flags.report else { return Ok(()) };
        let mut report = page::begin("Scatter: speed and accuracy", &self.machine);
        report.add_section(heading, Section::Trade(section()));
        page::write(&report, folder, "tradeoff.html")
    }
}

/// All techniques, or those that are named. References have no settings; in motion the shadow map's own error is
/// worth a row.
fn techniques(flags: &Tradeoff) -> anyhow::Result<Vec<&'static dyn Technique>> {
    if flags.rendering.methods.is_empty() {
        return Ok(match flags.rendering.on.device {
            Device::Cpu => TECHNIQUES.to_vec(),
            Device::Gpu => gpu::techniques().to_vec(),
        });
    }
    let mut techniques = Vec::new();
    for id in &flags.rendering.methods {
        match method(&gpu::id_on(flags.rendering.on.device, id))? {
            Method::Technique(technique) => techniques.push(technique),
            Method::ShadowMapTruth if flags.motion => {}
            _ => bail!(
                "--method {id}: a reference, and auto, has no settings to choose from; name a technique"
            ),
        }
    }
    Ok(techniques)
}
