//! `stress`: every technique on every extreme; exit 1 if a number is wrong or a rule is broken.

use scatter::{TECHNIQUES, Technique};
use scatter_validate::report::{Section, StressSection};
use scatter_validate::stress::document::StressDocument;
use scatter_validate::stress::row::StressRow;
use scatter_validate::stress::rows::all_rows;
use scatter_validate::stress::table::{summary, table};
use scatter_validate::stress::{StressResult, run as run_row};
use scatter_validate::{ByHand, Contender, Machine, WithOptions};

use super::page;
use crate::Verdict;
use crate::flags::{Device, Stress};
use crate::gpu;
use crate::output::{check_folder, print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, method, options_by_hand};

/// Runs the matrix and prints it.
pub fn run(flags: &Stress) -> anyhow::Result<Verdict> {
    let ids: Vec<String> = flags.methods.iter().map(|id| gpu::id_on(flags.on.device, id)).collect();
    let is_on_gpu = flags.on.device == Device::Gpu || ids.iter().any(|id| id.ends_with("@gpu"));
    let techniques = techniques(&ids, flags.on.device)?;
    let by_hand = options_by_hand(&flags.set, &techniques)?;
    gpu::choose(&flags.on, is_on_gpu)?;
    if is_on_gpu {
        match gpu::adapter() {
            Ok(adapter) => stderr_line(&format!("gpu: {adapter}")),
            Err(none) => return Ok(skipped(&none, &ids)),
        }
        gpu::warm_up();
    }
    let modes = modes(&techniques, &by_hand);
    let contenders = Contender::of_modes(&modes);
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let machine = Machine::this();
    let rows = rows(&flags.rows)?;
    let (results, threads) = run_rows(rows, &contenders, flags.threads)?;
    let methods: Vec<&str> = contenders.iter().map(Contender::id).collect();
    if let Some(folder) = &flags.report {
        let mut report = page::begin("Scatter: stress matrix", &machine);
        report.add_section(HEADING, section(results.clone(), &contenders));
        page::write(&report, folder, "stress.html")?;
    }
    let failed = results.iter().any(StressResult::has_failed);
    if flags.json {
        print_json(&StressDocument::new(&machine, &results, &contenders, threads))?;
    } else {
        print(&format!("{machine}\n"))?;
        print(
            "errors as shares of the unoccluded value: largest (truth), p99 or RMS at the finest setting\n",
        )?;
        print(&format!("{}\n", options_line(&contenders)))?;
        print(&table(&results, &methods))?;
        print(&format!("{}\n", summary(&results)))?;
    }
    Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
}

/// What the matrix is called on a page.
pub const HEADING: &str = "Stress matrix";

/// All rows, or those whose group or name contains one of the texts.
pub fn rows(texts: &[String]) -> anyhow::Result<Vec<StressRow>> {
    let wanted = |text: &str| texts.iter().any(|row| text.contains(row.as_str()));
    let mut rows = all_rows();
    if !texts.is_empty() {
        rows.retain(|row| wanted(row.group) || wanted(&row.name));
        anyhow::ensure!(!rows.is_empty(), "--row: no row has this text; leave it out to see all of them");
    }
    Ok(rows)
}

/// Runs rows in a pool of their own, and says how many threads it had.
pub fn run_rows(
    rows: Vec<StressRow>,
    contenders: &[Contender<'_>],
    threads: Option<u32>,
) -> anyhow::Result<(Vec<StressResult>, usize)> {
    let progress = Progress::new(Some(rows.len() as u64));
    in_pool(threads, |threads| {
        let results = rows.into_iter().map(|row| {
            progress.stage(&format!("{}: {}", row.group, row.name));
            let result = run_row(row, contenders);
            progress.step();
            result
        });
        (results.collect(), threads)
    })
}

/// The matrix as a section of a page.
pub fn section(results: Vec<StressResult>, contenders: &[Contender<'_>]) -> Section {
    Section::Stress(StressSection {
        results,
        methods: contenders.iter().map(Contender::id).collect(),
        modes: labels(contenders),
    })
}

/// Each technique with its options by hand.
pub fn modes<'a>(techniques: &[&'a dyn Technique], by_hand: &'a [ByHand]) -> Vec<WithOptions<'a>> {
    techniques.iter().zip(by_hand).map(|(technique, by_hand)| WithOptions::new(*technique, by_hand)).collect()
}

/// Those that have options by hand, with these.
pub fn labels(contenders: &[Contender<'_>]) -> Vec<String> {
    contenders.iter().filter(|by| !by.by_hand().is_empty()).map(Contender::label).collect()
}

/// What stands above a table of modes; nothing without one.
pub fn options_line(contenders: &[Contender<'_>]) -> String {
    match labels(contenders) {
        labels if labels.is_empty() => String::new(),
        labels => format!("{}; ~: off by so much where the mode promises no error\n", labels.join(", ")),
    }
}

/// Without an adapter no extreme is rendered: said, counted, and a failure where techniques were asked for by name or the
/// environment says `SCATTER_GPU=required`.
fn skipped(none: &str, ids: &[String]) -> Verdict {
    let count = if ids.is_empty() { gpu::techniques().len() } else { ids.len() };
    stderr_line(&format!("{count} techniques, {count} skipped: SKIPPED: {none}"));
    let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
    if required || !ids.is_empty() { Verdict::OutOfTolerance } else { Verdict::Well }
}

/// The named techniques, or all of them. The reference is always there besides: it is what the others stand beside.
fn techniques(ids: &[String], device: Device) -> anyhow::Result<Vec<&'static dyn Technique>> {
    if ids.is_empty() {
        return Ok(match device {
            Device::Cpu => TECHNIQUES.to_vec(),
            Device::Gpu => gpu::techniques().to_vec(),
        });
    }
    let mut techniques: Vec<&dyn Technique> = Vec::new();
    for id in ids {
        match method(id)? {
            Method::Technique(technique) => techniques.push(technique),
            Method::ShadowMapTruth => {}
            Method::Auto => anyhow::bail!("--method {id}: extremes are for techniques; name one"),
            Method::HeightFieldTruth => anyhow::bail!(
                "--method {id}: it judges interpolated maps alone, which extremes are not; give another one"
            ),
            Method::RaycastTruth => anyhow::bail!(
                "--method {id}: it ignores shadow maps, and the extremes have no triangles; give another one"
            ),
        }
    }
    Ok(techniques)
}
