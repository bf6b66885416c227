//! The report's section on the trade of speed for accuracy, and a page of it alone.

use super::Report;
use super::html::Page;
use crate::plot::Plot;

/// A section: a plot for every shot, then the tables.
pub struct TradeSection {
    /// What it is called.
    pub heading: String,
    /// How to read it.
    pub introduction: String,
    /// The plots, side by side where there is room.
    pub plots: Vec<Plot>,
    /// The tables with their titles, in plain text columns.
    pub tables: Vec<(String, String)>,
}

impl TradeSection {
    /// Appends the section to a page.
    pub(super) fn push(&self, page: &mut Page) {
        page.heading(&self.heading);
        page.paragraph(&self.introduction);
        page.graphics(self.plots.iter().map(Plot::inline_svg));
        for (title, table) in &self.tables {
            page.paragraph(title);
            page.preformatted(table);
        }
    }

    /// A page of this section alone, under the report's machine and settings.
    pub fn html(&self, report: &Report) -> String {
        let mut page = Page::new("Scatter: speed and accuracy");
        report.push_settings(&mut page);
        self.push(&mut page);
        page.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;
    use crate::tradeoff::charts::trade_plot;
    use crate::tradeoff::example_trade;

    #[test]
    fn the_page_has_its_plots_inline_and_its_tables_and_needs_nothing_from_elsewhere() {
        let section = TradeSection {
            heading: "Speed and accuracy".into(),
            introduction: "a & b".into(),
            plots: vec![trade_plot(&example_trade()), trade_plot(&example_trade())],
            tables: vec![("Time to each level".into(), "shot  <method>\n".into())],
        };
        let report = Report::new(Machine::this(), "xtask tradeoff".into(), "2026-01-02".into());
        let html = section.html(&report);
        assert_eq!(html.matches("<svg ").count(), 2);
        assert!(
            html.contains("a &amp; b")
                && html.contains("shot  &lt;method&gt;")
                && html.contains("2026-01-02")
        );
        for forbidden in ["<script", "http://", "https://", "<link", "url("] {
            assert!(!html.contains(forbidden), "{forbidden}");
        }
    }
}
