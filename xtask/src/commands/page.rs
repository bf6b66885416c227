//! The pages that `--report DIR` writes: begun with what was typed and when, written whole or not at all.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Context;
use scatter_validate::Machine;
use scatter_validate::report::Report;

use crate::output::{stderr_line, write_text};

/// An empty page of this run.
pub fn begin(title: &'static str, machine: &Machine) -> Report {
    Report::new(title, machine.clone(), command_line(), utc_date(SystemTime::now()))
}

/// Writes a page into a folder, which is made if it does not exist.
pub fn write(report: &Report, folder: &Path, name: &str) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let path = folder.join(name);
    write_text(&path, &report.html())?;
    stderr_line(&format!("wrote {}", path.display()));
    Ok(())
}

/// What was typed, for the report.
fn command_line() -> String {
    let arguments: Vec<String> =
        std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect();
    format!("cargo xtask {}", arguments.join(" "))
}

/// The day in UTC, `YYYY-MM-DD` (Hinnant's days-to-civil algorithm, years from 1970).
fn utc_date(time: SystemTime) -> String {
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
