//! The stress matrix as text: one line a row under the heading of its group, a column a technique, and what a FAIL or
//! an `unsupported` means, and why a mode promises no error, below. At most 110 columns.

use std::fmt::Write;

use super::StressResult;
use super::cell::Cell;

/// Widest a row's name gets; longer ones are cut.
const NAME_WIDTH: usize = 64;
/// Widest a line gets.
const LINE_WIDTH: usize = 110;

/// The whole table.
pub fn table(results: &[StressResult], methods: &[&str]) -> String {
    let mut text = String::new();
    let widest = results.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
    // Columns are as wide as their ids, if they fit.
    let room = (LINE_WIDTH - 2 - widest.min(NAME_WIDTH)) / methods.len().max(1);
    let width = room.saturating_sub(2).clamp(9, 17);
    let name_width = widest.min(LINE_WIDTH.saturating_sub(2 + methods.len() * (width + 2))).max(20);
    let _ = write!(text, "{:<name_width$}  ", "");
    for method in methods {
        let _ = write!(text, "  {:<width$}", cut(method, width));
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    let mut group = "";
    for row in results {
        if row.group != group {
            group = row.group;
            let _ = writeln!(text, "{group}");
        }
        let mut line = format!("  {:<name_width$}", cut(&row.name, name_width));
        for (cell, _) in &row.cells {
            let _ = write!(line, "  {:<width$}", cut(&cell.short(), width));
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text.push_str(&remarks(results, methods));
    text
}

/// One line for every FAIL, and one a technique and reason for what is unsupported, was not run, or promises no error.
pub fn remarks(results: &[StressResult], methods: &[&str]) -> String {
    let mut text = String::new();
    let mut reasons: Vec<(&str, String, u32)> = Vec::new();
    for row in results {
        for ((cell, _), method) in row.cells.iter().zip(methods) {
            match cell {
                Cell::Fail(miss) => {
                    let _ = writeln!(text, "FAIL {method} on {}: {}: {miss}", row.group, row.name);
                }
                Cell::Unsupported(_) | Cell::NotRun(_) | Cell::Unpromised { .. } => {
                    let reason = match cell {
                        Cell::Unpromised { why, .. } => format!("no error is promised: {why}"),
                        _ => cell.to_string(),
                    };
                    match reasons.iter_mut().find(|(m, r, _)| m == method && *r == reason) {
                        Some((_, _, count)) => *count += 1,
                        None => reasons.push((method, reason, 1)),
                    }
                }
                Cell::Ok { .. } | Cell::Refused(_) => {}
            }
        }
    }
    for (method, reason, count) in reasons {
        let _ = writeln!(text, "{method}, {count} rows: {reason}");
    }
    text
}

/// How many cells there are of each kind.
pub fn summary(results: &[StressResult]) -> String {
    let cells = || results.iter().flat_map(|row| &row.cells).map(|(cell, _)| cell);
    let count = |is: fn(&Cell) -> bool| cells().filter(|cell| is(cell)).count();
    let unpromised = match count(|cell| matches!(cell, Cell::Unpromised { .. })) {
        0 => String::new(),
        some => format!("{some} without a promise, "),
    };
    format!(
        "{} rows, {} cells: {} ok, {unpromised}{} refused, {} unsupported, {} not run, {} FAIL",
        results.len(),
        cells().count(),
        count(|cell| matches!(cell, Cell::Ok { .. })),
        count(|cell| matches!(cell, Cell::Refused(_))),
        count(|cell| matches!(cell, Cell::Unsupported(_))),
        count(|cell| matches!(cell, Cell::NotRun(_))),
        count(Cell::has_failed),
    )
}

fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.into();
    }
    let kept: String = text.chars().take(width.saturating_sub(1)).collect();
    kept + "…"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(name: &str, cells: Vec<Cell>) -> StressResult {
        let cells = cells.into_iter().map(|cell| (cell, 1.0)).collect();
        StressResult { group: "group", name: name.into(), size: [3, 2], map_side: 5, cells }
    }

    #[test]
    fn four_techniques_fit_into_a_line_and_a_failure_says_why() {
        let long = "x".repeat(90);
        let cells = vec![
            Cell::Ok { error: 1e-7 },
            Cell::Unsupported("why".into()),
            Cell::fault("nan"),
            Cell::Ok { error: 0.0 },
        ];
        let results = [result(&long, cells.clone()), result("short", cells)];
        let methods = ["truth-shadow-map", "raymarch", "filtered-prefix", "minmax-mipmap"];
        let text = table(&results, &methods);
        let grid: Vec<&str> = text.lines().filter(|line| line.starts_with("  ")).collect();
        assert!(grid.iter().all(|line| line.chars().count() <= LINE_WIDTH), "{text}");
        assert!(text.contains("FAIL filtered-prefix on group: short: nan"), "{text}");
        assert!(text.contains("raymarch, 2 rows: unsupported: why"), "{text}");
        assert!(summary(&results).ends_with("8 cells: 4 ok, 0 refused, 2 unsupported, 0 not run, 2 FAIL"));
    }
    #[test]
    fn an_error_that_nobody_promised_is_shown_and_its_reason_told_once() {
        let off = |error| Cell::Unpromised { error, level: 0.01, why: "one fetch a pixel".into() };
        let results = [result("a", vec![off(0.2)]), result("b", vec![off(0.0)]), result("c", vec![off(0.5)])];
        let text = table(&results, &["m"]);
        assert!(text.contains("~ 2.0e-1") && !text.contains("FAIL"), "{text}");
        assert!(text.contains("m, 3 rows: no error is promised: one fetch a pixel\n"), "{text}");
        assert!(!results[0].has_failed());
        assert!(
            summary(&results)
                .ends_with("0 ok, 3 without a promise, 0 refused, 0 unsupported, 0 not run, 0 FAIL")
        );
    }
}
