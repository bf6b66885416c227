//! The report's section on the trade of speed for accuracy, on its growth with resolution, or on flicker.

use super::html::Page;
use crate::columns::Columns;
use crate::plot::Plot;

/// A plot for every shot, a table, and what stands behind it.
#[derive(Debug, Clone)]
pub struct TradeSection {
    /// How to read it.
    pub introduction: String,
    /// The plots, side by side where there is room.
    pub plots: Vec<Plot>,
    /// The table that the section is about.
    pub table: Columns,
    /// How to read the details.
    pub meaning_of_details: String,
    /// Tables with their titles, folded away.
    pub details: Vec<(String, Columns)>,
}

impl TradeSection {
    /// Appends the section to a page, under its heading.
    pub(super) fn push(&self, page: &mut Page) {
        page.paragraph(&self.introduction);
        page.graphics(self.plots.iter().map(Plot::inline_svg));
        page.table(&self.table);
        if !self.details.is_empty() {
            page.paragraph(&self.meaning_of_details);
        }
        for (title, table) in &self.details {
            page.folded(title, |page| page.table(table));
        }
    }
}
