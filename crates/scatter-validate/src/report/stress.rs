//! The stress matrix as a coloured grid. Colour is never alone: every cell says its verdict in words.

use std::fmt::Write;

use super::html::{Page, Tone, escaped};
use crate::stress::StressResult;
use crate::stress::cell::Cell;
use crate::stress::table::{remarks, summary};

/// The matrix, or some of its rows.
#[derive(Debug, Clone)]
pub struct StressSection {
    /// The rows.
    pub results: Vec<StressResult>,
    /// Ids of the columns.
    pub methods: Vec<&'static str>,
    /// Those of them that have options by hand, with these: `filtered-prefix with fetch=bilinear`.
    pub modes: Vec<String>,
}

/// What the colours mean: class of a cell, and words.
const KEY: [(&str, &str); 7] = [
    ("ok", "ok, error below 1e-3"),
    ("near", "ok, error of 1e-3 and more"),
    ("unpromised", "~: off by so much in a mode that promises no error"),
    ("unsupported", "unsupported: said before any work"),
    ("refused", "refused: bad input that the model itself turns down"),
    ("not-run", "not run: cannot be tried here"),
    ("fail", "FAIL: a wrong number or a broken rule"),
];

impl StressSection {
    /// What came out, in a sentence, with its colour.
    pub(super) fn summary(&self) -> (String, Tone) {
        let tone = if self.results.iter().any(StressResult::has_failed) { Tone::Bad } else { Tone::Well };
        (summary(&self.results), tone)
    }

    /// Appends the grid to a page, under its heading.
    pub(super) fn push(&self, page: &mut Page) {
        let (summary, tone) = self.summary();
        page.summary(&summary, tone);
        page.paragraph(
            "Every extreme of the model for every technique, against closed forms. Numbers are errors as shares of the \
             pixel’s unoccluded value: the largest one of shadow-map truth, p99 or RMS of a technique at its finest \
             setting.",
        );
        if !self.modes.is_empty() {
            page.paragraph(&format!("Options by hand: {}.", self.modes.join("; ")));
        }
        page.fragment(&self.grid());
        let remarks = remarks(&self.results, &self.methods);
        if !remarks.is_empty() {
            page.preformatted(&remarks);
        }
    }

    /// Key and grid, as HTML.
    fn grid(&self) -> String {
        let mut grid = String::from("<div class=\"key\">");
        for (class, meaning) in KEY {
            let _ = write!(grid, "<span class=\"{class}\">{meaning}</span>");
        }
        grid.push_str(
            "</div>\n<div class=\"scroll\"><table class=\"stress\">\n<thead><tr><th scope=\"col\">extreme</th>",
        );
        for method in &self.methods {
            let _ = write!(grid, "<th scope=\"col\">{}</th>", escaped(method));
        }
        grid.push_str("</tr></thead>\n<tbody>\n");
        let mut group = "";
        for row in &self.results {
            if row.group != group {
                group = row.group;
                let span = self.methods.len() + 1;
                let _ = writeln!(
                    grid,
                    "<tr><th class=\"group\" colspan=\"{span}\" scope=\"rowgroup\">{}</th></tr>",
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
        grid
    }
}

/// The colour of a cell. An error of a thousandth and more is within what techniques promise, and worth seeing.
fn class(cell: &Cell) -> &'static str {
    match cell {
        Cell::Ok { error } if *error < 1e-3 => "ok",
        Cell::Ok { .. } => "near",
        Cell::Unpromised { .. } => "unpromised",
        Cell::Unsupported(_) => "unsupported",
        Cell::Refused(_) => "refused",
        Cell::NotRun(_) => "not-run",
        Cell::Fail(_) => "fail",
    }
}
