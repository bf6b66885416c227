//! `validate`: every technique on every shot, against both truths.

use std::path::Path;

use anyhow::{Context, bail};
use scatter::{Budget, TECHNIQUES, Technique};
use scatter_scene::RasterDevice;
use scatter_validate::regression::Comparison;
use scatter_validate::report::{Report, Section};
use scatter_validate::stress::StressResult;
use scatter_validate::stress::row::StressRow;
use scatter_validate::{
    Contender, Document, HEIGHT_FIELD_TRUTH, Machine, Matrix, Regression, Row, Settings, Tolerances,
    maps_table, table,
};
use serde::Serialize;

use super::foreign::Foreign;
use super::sweep::{self, Job};
use super::{light_curves, page, stress};
use crate::Verdict;
use crate::auto::AutoPlanner;
use crate::flags::{Device, Rendering, Validate};
use crate::gpu;
use crate::machine_file::machine_of;
use crate::output::{check_folder, print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{
    Method, ShotSource, baseline, check_options, load, method, options_by_hand, raster_device, resolution,
    shots,
};

/// Measures, prints and judges.
pub fn run(flags: &Validate) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    if flags.mutants {
        return super::mutants::run(flags);
    }
    let foreign = Foreign::of(flags)?;
    let earlier = flags.baseline.as_deref().map(read_baseline).transpose()?;
    let raster = raster_device(&rendering.maps)?;
    let ids: Vec<_> = rendering.methods.iter().map(|id| gpu::id_on(rendering.on.device, id)).collect();
    let is_on_gpu = rendering.on.device == Device::Gpu || ids.iter().any(|id| id.ends_with("@gpu"));
    gpu::choose(&rendering.on, is_on_gpu)?;
    if is_on_gpu {
        match gpu::adapter() {
            Ok(adapter) => stderr_line(&format!("gpu: {adapter}")),
            Err(none) => return skipped(&none, &ids, &flags.shots),
        }
    }
    let methods = ids.iter().map(|id| method(id)).collect::<anyhow::Result<Vec<Method>>>()?;
    if methods.iter().any(|m| matches!(m, Method::HeightFieldTruth)) {
        bail!(
            "--method {HEIGHT_FIELD_TRUTH}: techniques are judged by the map's nearest texels; compare one with it by render --compare"
        );
    }
    let techniques: Vec<&'static dyn Technique> = if methods.is_empty() && foreign.is_none() {
        match rendering.on.device {
            Device::Cpu => TECHNIQUES.to_vec(),
            Device::Gpu => gpu::techniques().to_vec(),
        }
    } else {
        let chosen = methods.iter().filter_map(|method| match method {
            Method::Technique(technique) => Some(*technique),
            _ => None,
        });
        chosen.collect()
    };
    check_options(&rendering.set, &techniques)?;
    let sources = shots(&flags.shots)?;
    let stress_rows = stress::rows(&flags.rows)?;
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let machine = Machine::this().drawing_on(raster.as_ref());
    let mut report = flags.report.is_some().then(|| begin(flags, &machine));
    let progress = Progress::new(Some(sources.len() as u64));
    let tolerances = Tolerances::built_in().context("tolerances.toml")?;
    let mut plots = Vec::new();
    let rows = in_pool(rendering.threads, |threads| {
        let settings = Settings {
            quality: rendering.quality,
            overrides: rendering.set.clone(),
            resolution: resolution(rendering),
            raster: raster.clone(),
            repeat: rendering.repeat,
            threads,
        };
        let planner = AutoPlanner {
            budget: Budget::Level(rendering.quality),
            machine: machine_of(flags.machine.as_deref())?.with_threads(threads),
        };
        let is_planned = foreign.is_none()
            && ((methods.is_empty() && rendering.on.device == Device::Cpu)
                || methods.iter().any(|m| matches!(m, Method::Auto)));
        let matrix = Matrix {
            techniques: techniques.clone(),
            map_row: methods.is_empty() || methods.iter().any(|m| matches!(m, Method::ShadowMapTruth)),
            raycast_row: methods.iter().any(|m| matches!(m, Method::RaycastTruth)),
            baseline: baseline(),
            planner: (is_planned && rendering.set.is_empty()).then_some(&planner as _),
            twins: gpu::twins(),
            emulated: gpu::emulated(&techniques),
            settings,
            tolerances,
        };
        let mut rows: Vec<Row> = Vec::new();
        for source in &sources {
            progress.stage(&format!("{}: loading", source.label()));
            let shot = load(source, rendering)?;
            if let Some(foreign) = &foreign {
                foreign.check_size(&shot)?;
            }
            if report.is_some() && light_curves::has_occluders(&shot) {
                progress.stage(&format!("{}: light over depth", source.label()));
                plots.extend(light_curves::plot(&shot)?);
            }
            let images = foreign.as_ref().map(|foreign| foreign.image().clone());
            let result = matrix.run_beside(shot, images.as_slice(), &mut |stage| progress.stage(stage))?;
            if let Some(foreign) = &foreign {
                foreign.write_difference(&result.pictures)?;
            }
            if let Some(report) = &mut report {
                report.add(&result.rows, &result.pictures);
            }
            rows.extend(result.rows);
            progress.step();
        }
        anyhow::Ok(rows)
    })??;
    drop(progress);
    let failed = rows.iter().filter(|row| row.has_failed()).count();
    let comparison =
        earlier.as_ref().map(|earlier| earlier.compare(&rows)).transpose().with_context(|| {
            flags.baseline.as_ref().map_or(String::new(), |path| path.display().to_string())
        })?;
    let maps = maps_table(&rows);
    if rendering.json {
        let document = Document { machine: &machine, rows: &rows };
        match &comparison {
            Some(baseline) => print_json(&ComparedDocument { document, baseline })?,
            None => print_json(&document)?,
        }
    } else {
        print(&format!("{machine}\n"))?;
        print(&heading(flags))?;
        print(&table(&rows))?;
        if !maps.is_empty() {
            print(&format!("\n{maps}\n"))?;
        }
        print(&format!("{} rows, {failed} out of tolerance\n", rows.len()))?;
    }
    let worse = comparison.as_ref().map_or(0, Comparison::worse_count);
    if let (Some(comparison), Some(path)) = (&comparison, &flags.baseline) {
        let text = format!("\nagainst {}:\n{}", path.display(), comparison.text());
        // Stdout is the document's where there is one.
        if rendering.json { stderr_line(text.trim()) } else { print(&text)? }
    }
    let mut measured_well = true;
    if let (Some(mut report), Some(folder)) = (report, &flags.report) {
        if !maps.is_empty() {
            report.add_section("Maps by both sources", Section::Text(maps));
        }
        if !plots.is_empty() {
            report.add_section(light_curves::HEADING, light_curves::section(plots));
        }
        if let (Some(comparison), Some(path)) = (&comparison, &flags.baseline) {
            let heading = format!("Against {}", path.display());
            report.add_section(&heading, Section::Text(comparison.text()));
        }
        // References and images of other programs have nothing to trade, and no extremes of their own.
        if !techniques.is_empty() {
            measured_well =
                add_measurements(&mut report, rendering, techniques, sources, raster, stress_rows)?;
        }
        page::write(&report, folder, "report.html")?;
    }
    Ok(if failed == 0 && worse == 0 && measured_well { Verdict::Well } else { Verdict::OutOfTolerance })
}

/// The document with what the comparison with an earlier run found.
#[derive(Serialize)]
struct ComparedDocument<'a> {
    #[serde(flatten)]
    document: Document<'a>,
    baseline: &'a Comparison,
}

/// An earlier run's document.
fn read_baseline(path: &Path) -> anyhow::Result<Regression> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{}: cannot be read; give what validate --json printed", path.display()))?;
    Regression::parse(&text).with_context(|| path.display().to_string())
}

fn heading(flags: &Validate) -> String {
    let rendering = &flags.rendering;
    let maps = resolution(rendering);
    format!(
        "level {} ({} %), shadow map {maps}; errors against {}, /ray against {}\n\n",
        rendering.quality,
        100.0 * rendering.quality.error(),
        scatter_validate::SHADOW_MAP_TRUTH,
        scatter_validate::RAYCAST_TRUTH,
    )
}

/// Without an adapter no row of the GPU is measured: said, counted, and a failure where the rows were asked for by name or the
/// environment says `SCATTER_GPU=required`.
fn skipped(none: &str, ids: &[String], shots: &[String]) -> anyhow::Result<Verdict> {
    let methods = if ids.is_empty() { gpu::techniques().len() } else { ids.len() };
    let count = methods * crate::select::shots(shots)?.len();
    stderr_line(&format!("{count} rows, {count} skipped, 0 out of tolerance: SKIPPED: {none}"));
    let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
    Ok(if required || !ids.is_empty() { Verdict::OutOfTolerance } else { Verdict::Well })
}

/// A page that says how its techniques were run.
fn begin(flags: &Validate, machine: &Machine) -> Report {
    let rendering = &flags.rendering;
    let mut report = page::begin("Scatter: validation report", machine);
    let level = rendering.quality;
    report.add_setting("quality level", format!("{level}: errors up to {} %", 100.0 * level.error()));
    let maps = resolution(rendering);
    report.add_setting("shadow map", format!("{maps} texels"));
    let runs =
        if rendering.repeat == 1 { "one run".into() } else { format!("median of {}", rendering.repeat) };
    report.add_setting("times", format!("{runs} after one to warm up"));
    report
}

/// Adds what a table at one level cannot say: time against error for every setting, on small images whatever the size
/// of the shots, and the extremes. Whether all of it is as it should be.
fn add_measurements(
    report: &mut Report,
    rendering: &Rendering,
    techniques: Vec<&'static dyn Technique>,
    sources: Vec<ShotSource>,
    raster: Option<RasterDevice>,
    stress_rows: Vec<StressRow>,
) -> anyhow::Result<bool> {
    let by_hand = options_by_hand(&rendering.set, &techniques)?;
    let modes = stress::modes(&techniques, &by_hand);
    let contenders = Contender::of_modes(&modes);
    // Options by hand would make every setting the same.
    let repeat = rendering.repeat.max(SWEEP_REPEAT);
    let quick = Rendering { quick: true, repeat, set: Vec::new(), ..rendering.clone() };
    let job = Job::new(quick, techniques, sources, raster);
    stderr_line("for the report: time against error of every setting");
    let (trades, threads) = job.sweep()?;
    report.add_section(sweep::HEADING, Section::Trade(job.section(&trades, threads)));
    stderr_line("for the report: the stress matrix");
    let (results, _) = stress::run_rows(stress_rows, &contenders, rendering.threads)?;
    let failed = results.iter().any(StressResult::has_failed)
        || trades.iter().flat_map(|trade| &trade.rungs).any(|rung| rung.row.has_failed());
    report.add_section(stress::HEADING, stress::section(results, &contenders));
    Ok(!failed)
}

/// Timed runs of a setting: as many as `tradeoff` takes by itself. With one, a plot's points lie where chance puts them.
const SWEEP_REPEAT: u32 = 3;
