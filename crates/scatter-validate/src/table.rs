//! The table that `validate` prints: aligned plain text within 120 columns, units in the header.

use std::fmt::Write;

use crate::columns::Columns;
use crate::figures::Figures;
use crate::row::{Row, TwinDistance, Verdict};

/// One line a row under a header; what a FAIL or an `unsupported` means follows below.
pub fn table(rows: &[Row]) -> String {
    columns(rows).to_string() + &remarks(rows)
}

/// The lines alone: names to the left, numbers to the right.
pub(crate) fn columns(rows: &[Row]) -> Columns {
    let lines = rows.iter().map(|row| Vec::from(cells(row)));
    Columns::new(&HEADER, 1, lines, |column| column < 2 || column == COLUMNS - 1)
}

/// What a FAIL, a miss or an `unsupported` means, a line each.
pub(crate) fn remarks(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        if let Some(twin) = &row.twin {
            let TwinDistance { method, figures: f } = twin;
            let _ = writeln!(
                text,
                "twin: {} on {}: rel_rmse {:.1e}, p99 {:.1e} from {method}",
                row.method, row.shot, f.rel_rmse, f.p99
            );
        }
        match &row.verdict {
            Some(Verdict::Fail(reasons)) => {
                for reason in reasons {
                    let _ = writeln!(text, "FAIL {} on {}: {reason}", row.method, row.shot);
                }
            }
            Some(Verdict::Misses(what)) => {
                let _ = writeln!(text, "misses: {} on {}: {what}", row.method, row.shot);
            }
            Some(Verdict::Unsupported(reason)) => {
                let _ = writeln!(text, "unsupported: {} on {}: {reason}", row.method, row.shot);
            }
            _ => {}
        }
    }
    text
}

const COLUMNS: usize = 10;
/// Names of the columns, with units. Errors are against shadow-map truth, `/ray` against ray-cast truth.
const HEADER: [&str; COLUMNS] = [
    "shot",
    "method",
    "time ms",
    "ratio",
    "rel_rmse %",
    "p99 %",
    "bias %",
    "rmse/ray %",
    "non-fin",
    "verdict",
];

/// A row's cells as text.
pub(crate) fn cells(row: &Row) -> [String; COLUMNS] {
    let of = |figures: Option<Figures>, pick: fn(Figures) -> f64| {
        figures.map_or_else(|| "-".to_string(), |figures| percent(pick(figures)))
    };
    let non_finite = [row.errors.shadow_map, row.errors.raycast].into_iter().flatten().map(|f| f.non_finite);
    // A technique that cannot do the shot, and an image that another program made, took no time.
    let was_timed = row.time_ms.contains_key("total");
    [
        row.shot.clone(),
        method(row),
        match was_timed {
            false => "-".into(),
            true if row.emulated => format!("({})", milliseconds(row.total_ms())),
            true => milliseconds(row.total_ms()),
        },
        row.ratio.map_or_else(|| "-".into(), |ratio| format!("{ratio:.2}")),
        of(row.errors.shadow_map, |f| f.rel_rmse),
        of(row.errors.shadow_map, |f| f.p99),
        of(row.errors.shadow_map, |f| f.bias),
        of(row.errors.raycast, |f| f.rel_rmse),
        non_finite.max().map_or_else(|| "-".into(), |count| count.to_string()),
        match (&row.verdict, &row.note) {
            (None, Some(note)) => note.clone(),
            (verdict, _) => word(verdict.as_ref()).into(),
        },
    ]
}

/// A verdict in one word.
fn word(verdict: Option<&Verdict>) -> &'static str {
    match verdict {
        None => "-",
        Some(Verdict::Ok) => "ok",
        Some(Verdict::Fail(_)) => "FAIL",
        Some(Verdict::Misses(_)) => "misses",
        Some(Verdict::Unsupported(_)) => "unsupported",
    }
}

/// The method with the options that it ran with, where they were not its own choice.
fn method(row: &Row) -> String {
    let name = match &row.requested {
        Some(requested) => format!("{requested}: {}", row.method),
        None => row.method.clone(),
    };
    row.overrides.iter().fold(name, |text, (key, value)| format!("{text} {key}={value}"))
}

/// A fraction as a number of percent, three digits.
pub(crate) fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    match percent.abs() {
        _ if percent == 0.0 => "0".into(),
        size if !(0.001..1e5).contains(&size) => format!("{percent:.1e}"),
        size if size < 0.1 => format!("{percent:.4}"),
        size if size < 10.0 => format!("{percent:.2}"),
        _ => format!("{percent:.1}"),
    }
}

/// Milliseconds, three digits.
pub(crate) fn milliseconds(time: f64) -> String {
    if time < 10.0 {
        format!("{time:.2}")
    } else if time < 100.0 {
        format!("{time:.1}")
    } else {
        format!("{time:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::{figures, row};

    #[test]
    fn columns_are_aligned_and_the_widest_line_fits() {
        // As long as names of shots and methods are.
        let mut long = row("truth-height-field", "sibenik-clerestory");
        long.errors.shadow_map = Some(figures(123.456, 1e9));
        long.errors.raycast = Some(figures(123.456, 0.0));
        long.ratio = Some(123.456);
        long.verdict = Some(Verdict::Unsupported("a reason".into()));
        let rows = [row("raymarch", "nave"), long];
        let text = table(&rows);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[3], "unsupported: truth-height-field on sibenik-clerestory: a reason");
        let columns: Vec<usize> = lines[..3].iter().map(|line| line.chars().count()).collect();
        assert!(columns.iter().all(|&width| width <= 120), "{columns:?}");
        let method = lines[0].find("method").unwrap();
        assert!(lines[1][method..].starts_with("raymarch") && lines[2][method..].starts_with("truth-height"));
    }

    #[test]
    fn a_time_that_is_not_the_hardware_s_stands_in_brackets() {
        let [mut timed, mut emulated] = [row("minmax-mipmap", "nave"), row("minmax-mipmap@gpu", "nave")];
        for row in [&mut timed, &mut emulated] {
            row.time_ms.insert("total".into(), 12.0);
        }
        emulated.emulated = true;
        assert_eq!([&timed, &emulated].map(|row| cells(row)[2].clone()), ["12.0", "(12.0)"]);
    }

    #[test]
    fn percentages_keep_three_digits_at_every_size() {
        let text = [0.0, 1e-7, 1.234e-4, 0.034_56, 0.5, 12.3].map(percent);
        assert_eq!(text, ["0", "1.0e-5", "0.0123", "3.46", "50.0", "1230.0"]);
    }
}
