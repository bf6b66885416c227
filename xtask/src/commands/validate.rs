//! `validate`: every technique on every shot, against both truths.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Context;
use scatter::{TECHNIQUES, Technique};
use scatter_validate::report::Report;
use scatter_validate::{Document, Machine, Matrix, Row, Settings, Tolerances, table};

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
    let raster = raster_device(rendering)?;
    let methods = rendering.methods.iter().map(|id| method(id)).collect::<anyhow::Result<Vec<Method>>>()?;
    let techniques: Vec<&dyn Technique> = if methods.is_empty() {
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
    let machine = Machine::this();
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
            let result = matrix.run(shot, &mut |stage| progress.stage(stage))?;
            if let Some(report) = &mut report {
                report.add(&result.rows, &result.pictures);
            }
            rows.extend(result.rows);
            progress.step();
        }
        anyhow::Ok(rows)
    })??;
    drop(progress);
    if let (Some(report), Some(folder)) = (&report, &flags.report) {
        write_report(report, folder)?;
    }
    let failed = rows.iter().filter(|row| row.has_failed()).count();
    if rendering.json {
        print_json(&Document { machine: &machine, rows: &rows })?;
    } else {
        print(&format!("{machine}\n"))?;
        if let Some(device) = &raster {
            print(&format!("maps by raster on {}\n", device.info()))?;
        }
        print(&heading(flags))?;
        print(&table(&rows))?;
        print(&format!("{} rows, {failed} out of tolerance\n", rows.len()))?;
    }
    Ok(if failed == 0 { Verdict::Well } else { Verdict::OutOfTolerance })
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
