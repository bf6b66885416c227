//! `validate`: every technique on every shot, against both truths.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Context;
use scatter::{TECHNIQUES, Technique};
use scatter_validate::regression::Comparison;
use scatter_validate::report::{Report, Section};
use scatter_validate::{Document, Machine, Matrix, Regression, Row, Settings, Tolerances, maps_table, table};
use serde::Serialize;

use super::foreign::Foreign;

use crate::Verdict;
use crate::flags::Validate;
use crate::output::{check_folder, print, print_json, stderr_line, write_text};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, at_size, baseline, check_options, map_size, method, raster_device, shots};

/// Measures, prints and judges.
pub fn run(flags: &Validate) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    if flags.mutants {
        return super::mutants::run(flags);
    }
    let foreign = Foreign::of(flags)?;
    let earlier = flags.baseline.as_deref().map(read_baseline).transpose()?;
    let raster = raster_device(rendering)?;
    let methods = rendering.methods.iter().map(|id| method(id)).collect::<anyhow::Result<Vec<Method>>>()?;
    let techniques: Vec<&dyn Technique> = if methods.is_empty() && foreign.is_none() {
        TECHNIQUES.to_vec()
    } else {
        let chosen = methods.iter().filter_map(|method| match method {
            Method::Technique(technique) => Some(*technique),
            _ => None,
        });
        chosen.collect()
    };
    check_options(rendering, &techniques)?;
    let sources = shots(&flags.shots)?;
    if let Some(folder) = &flags.report {
        check_folder(folder)?;
    }
    let machine = Machine::this().drawing_on(raster.as_ref());
    let mut report = flags
        .report
        .is_some()
        .then(|| Report::new(machine.clone(), command_line(), utc_date(SystemTime::now())));
    let progress = Progress::new(Some(sources.len() as u64), true);
    let tolerances = Tolerances::built_in().context("tolerances.toml")?;
    let rows = in_pool(rendering.threads, |threads| {
        let settings = Settings {
            quality: rendering.quality,
            overrides: rendering.set.clone(),
            map_size: map_size(rendering),
            raster: raster.clone(),
            repeat: rendering.repeat,
            threads,
        };
        let matrix = Matrix {
            techniques,
            map_row: methods.is_empty() || methods.iter().any(|m| matches!(m, Method::ShadowMapTruth)),
            raycast_row: methods.iter().any(|m| matches!(m, Method::RaycastTruth)),
            baseline: baseline(),
            settings,
            tolerances,
        };
        let mut rows: Vec<Row> = Vec::new();
        for source in &sources {
            progress.stage(&format!("{}: loading", source.label()));
            let shot = at_size(source.load()?, rendering)?;
            if let Some(foreign) = &foreign {
                foreign.check_size(&shot)?;
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
    if let (Some(report), Some(folder)) = (&mut report, &flags.report) {
        if !maps.is_empty() {
            report.add_section("Maps by both sources", Section::Text(maps.clone()));
        }
        if let (Some(comparison), Some(path)) = (&comparison, &flags.baseline) {
            let heading = format!("Against {}", path.display());
            report.add_section(&heading, Section::Text(comparison.text()));
        }
        write_report(report, folder)?;
    }
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
    Ok(if failed == 0 && worse == 0 { Verdict::Well } else { Verdict::OutOfTolerance })
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
    let n = map_size(rendering);
    format!(
        "level {} ({} %), shadow map {n}x{n}; errors against {}, /ray against {}\n\n",
        rendering.quality,
        100.0 * rendering.quality.error(),
        scatter_validate::SHADOW_MAP_TRUTH,
        scatter_validate::RAYCAST_TRUTH,
    )
}

fn write_report(report: &Report, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let path = folder.join("report.html");
    write_text(&path, &report.html())?;
    stderr_line(&format!("wrote {}", path.display()));
    Ok(())
}

/// What was typed, for the report.
pub(super) fn command_line() -> String {
    let arguments: Vec<String> =
        std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect();
    format!("cargo xtask {}", arguments.join(" "))
}

/// The day in UTC, `YYYY-MM-DD` (Hinnant's days-to-civil algorithm, years from 1970).
pub(super) fn utc_date(time: SystemTime) -> String {
    let days = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    // Days since 1 March 0000, in 400-year eras of 146,097 days.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn days_become_dates() {
        let date = |days: u64| utc_date(UNIX_EPOCH + Duration::from_secs(days * 86_400));
        // 2000 was a leap year, 2026 is none; 11,016 days from 1970 to 29 February 2000.
        assert_eq!([date(0), date(11_016), date(11_017)], ["1970-01-01", "2000-02-29", "2000-03-01"]);
        assert_eq!(date(20_512), "2026-02-28");
        assert_eq!(date(20_513), "2026-03-01");
    }
}
