//! The stress matrix as a coloured grid: one page of its own, or a fragment of a report. Colour is never alone: every
//! cell says its verdict in words.

use std::fmt::Write;

use super::html::escaped;
use crate::machine::Machine;
use crate::stress::StressResult;
use crate::stress::cell::Cell;
use crate::stress::table::{remarks, summary};

/// Inline style of the grid; the fragment carries it along.
const STYLE: &str = "
.stress { border-collapse: collapse; font-size: .85rem; }
.stress th, .stress td { border: 1px solid #8886; padding: .1rem .5rem; text-align: left; font-weight: normal; }
.stress thead th { position: sticky; top: 0; background: Canvas; font-weight: 600; }
.stress .group { font-weight: 600; padding-top: .8rem; border-left: 0; border-right: 0; }
.stress td { white-space: nowrap; color: #111; print-color-adjust: exact; }
.stress .ok { background: #b7dfb9; } .stress .near { background: #e6e6a0; } .stress .fail { background: #e98a80; }
.stress .unsupported { background: #ccc; } .stress .refused { background: #b9d3ee; } .stress .not-run { background: #eee; }
.scroll { overflow-x: auto; }
@media print { .stress { font-size: 7px; } .stress thead th { position: static; } }
";

const PAGE_STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 1rem auto; padding: 0 1rem; max-width: 80rem; }
h1 { font-size: 1.5rem; } pre { white-space: pre-wrap; font: 13px/1.4 ui-monospace, monospace; }
@media print { body { max-width: none; font-size: 11px; } }
";

/// A page with the matrix alone.
pub fn stress_page(results: &[StressResult], methods: &[&str], machine: &Machine) -> String {
    let mut page = String::new();
    let _ = write!(
        page,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Scatter: stress matrix</title>\n<style>{PAGE_STYLE}</style>\n</head>\n<body>\n\
         <h1>Scatter: stress matrix</h1>\n<p>{}</p>\n",
        escaped(&machine.to_string())
    );
    page.push_str(&stress_grid(results, methods));
    page.push_str("</body>\n</html>\n");
    page
}

/// The matrix as a fragment of a page.
pub fn stress_grid(results: &[StressResult], methods: &[&str]) -> String {
    let mut grid = format!("<style>{STYLE}</style>\n<p>{}</p>\n", escaped(&summary(results)));
    grid.push_str(
        "<p>Numbers are errors as shares of the pixel’s unoccluded value: the largest one of shadow-map truth, p99 or \
         RMS of a technique at its finest setting. <b>unsupported</b> was said before any work, <b>refused</b> is bad \
         input that the model itself turns down.</p>\n",
    );
    grid.push_str(
        "<div class=\"scroll\"><table class=\"stress\">\n<thead><tr><th scope=\"col\">extreme</th>",
    );
    for method in methods {
        let _ = write!(grid, "<th scope=\"col\">{}</th>", escaped(method));
    }
    grid.push_str("</tr></thead>\n<tbody>\n");
    let mut group = "";
    for row in results {
        if row.group != group {
            group = row.group;
            let span = methods.len() + 1;
            let _ = writeln!(
                grid,
                "<tr><th class=\"group\" colspan=\"{span}\" scope=\"colgroup\">{}</th></tr>",
                escaped(group)
            );
        }
        let _ = write!(grid, "<tr><th scope=\"row\">{}</th>", escaped(&row.name));
        for (cell, _) in &row.cells {
            let _ = write!(
                grid,
                "<td class=\"{}\" title=\"{}\">{}</td>",
                class(cell),
                escaped(&cell.to_string()),
                escaped(&cell.short())
            );
        }
        grid.push_str("</tr>\n");
    }
    grid.push_str("</tbody>\n</table></div>\n");
    let remarks = remarks(results, methods);
    if !remarks.is_empty() {
        let _ = writeln!(grid, "<pre>{}</pre>", escaped(&remarks));
    }
    grid
}

/// The colour of a cell. An error of a thousandth and more is within what techniques promise, and worth seeing.
fn class(cell: &Cell) -> &'static str {
    match cell {
        Cell::Ok { error } if *error < 1e-3 => "ok",
        Cell::Ok { .. } => "near",
        Cell::Unsupported(_) => "unsupported",
        Cell::Refused(_) => "refused",
        Cell::NotRun(_) => "not-run",
        Cell::Fail(_) => "fail",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_needs_nothing_from_elsewhere_and_says_every_verdict_in_words() {
        let cells = vec![
            (Cell::Ok { error: 1e-7 }, 1.0),
            (Cell::Unsupported("<why> & how".into()), 1.0),
            (Cell::fault("a NaN"), 1.0),
        ];
        let row =
            StressResult { group: "maps", name: "1x1 <texel>".into(), size: [3, 2], map_side: 1, cells };
        let page = stress_page(&[row], &["a", "b", "c"], &Machine::this());
        for forbidden in ["<script", "http://", "https://", "<link", "url(", "<why>", "<texel>"] {
            assert!(!page.contains(forbidden), "{forbidden}");
        }
        for word in ["class=\"ok\"", ">unsupported<", ">FAIL<", "FAIL c on maps: 1x1 &lt;texel&gt;: a NaN"] {
            assert!(page.contains(word), "{word}: {page}");
        }
    }
}
