//! `stress`: every technique on every extreme; exit 1 if a number is wrong or a rule is broken.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use scatter::{TECHNIQUES, Technique};
use scatter_validate::report::stress_page;
use scatter_validate::stress::document::StressDocument;
use scatter_validate::stress::rows::all_rows;
use scatter_validate::stress::table::{summary, table};
use scatter_validate::stress::{StressResult, run as run_row};
use scatter_validate::{Contender, Machine};

use crate::Verdict;
use crate::output::{check_folder, print, print_json, stderr_line, write_text};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, method};

/// `stress`.
#[derive(Debug, Args)]
pub struct Stress {
    /// Technique by its id; repeatable [default: all, beside shadow-map truth]
    #[arg(long = "method", value_name = "ID")]
    pub methods: Vec<String>,
    /// Rows whose group or name contains this text; repeatable [default: all]
    #[arg(long = "row", value_name = "TEXT")]
    pub rows: Vec<String>,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Print one JSON document on stdout, everything else on stderr
    #[arg(long)]
    pub json: bool,
    /// Write the matrix as a self-contained HTML page into this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

/// Runs the matrix and prints it.
pub fn run(flags: &Stress) -> anyhow::Result<Verdict> {
    let contenders = contenders(&flags.methods)?;
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let machine = Machine::this();
    let wanted = |text: &str| flags.rows.iter().any(|row| text.contains(row.as_str()));
    let mut rows = all_rows();
    if !flags.rows.is_empty() {
        rows.retain(|row| wanted(row.group) || wanted(&row.name));
        anyhow::ensure!(!rows.is_empty(), "--row: no row has this text; leave it out to see all of them");
    }
    let progress = Progress::new(Some(rows.len() as u64), false);
    let (results, threads) = in_pool(flags.threads, |threads| {
        let mut results: Vec<StressResult> = Vec::new();
        for row in rows {
            progress.stage(&format!("{}: {}", row.group, row.name));
            results.push(run_row(row, &contenders));
            progress.step();
        }
        (results, threads)
    })?;
    drop(progress);
    let methods: Vec<&str> = contenders.iter().map(Contender::id).collect();
    if let Some(folder) = &flags.report {
        write_page(folder, &stress_page(&results, &methods, &machine))?;
    }
    let failed = results.iter().any(StressResult::has_failed);
    if flags.json {
        print_json(&StressDocument::new(&machine, &results, &contenders, threads))?;
    } else {
        print(&format!("{machine}\n"))?;
        print(
            "errors as shares of the unoccluded value: largest (truth), p99 or RMS at the finest setting\n\n",
        )?;
        print(&table(&results, &methods))?;
        print(&format!("{}\n", summary(&results)))?;
    }
    Ok(if failed { Verdict::OutOfTolerance } else { Verdict::Well })
}

/// The named techniques, or the reference and all of them. The reference is always there: it is what the others stand
/// beside.
fn contenders(ids: &[String]) -> anyhow::Result<Vec<Contender<'static>>> {
    if ids.is_empty() {
        return Ok(Contender::all(TECHNIQUES));
    }
    let mut techniques: Vec<&dyn Technique> = Vec::new();
    for id in ids {
        match method(id)? {
            Method::Technique(technique) => techniques.push(technique),
            Method::ShadowMapTruth => {}
            Method::RaycastTruth => anyhow::bail!(
                "--method {id}: it ignores shadow maps, and the extremes have no triangles; give another one"
            ),
        }
    }
    Ok(Contender::all(&techniques))
}

fn write_page(folder: &Path, page: &str) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let path = folder.join("stress.html");
    write_text(&path, page)?;
    stderr_line(&format!("wrote {}", path.display()));
    Ok(())
}
