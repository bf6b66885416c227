//! A table of texts: printed in aligned columns, as Markdown, or put into a page.

use std::fmt::{self, Display, Formatter, Write};

/// A header and a line a row; a row's missing cells are empty.
#[derive(Debug, Clone)]
pub struct Columns {
    header: Vec<&'static str>,
    rows: Vec<Vec<String>>,
    groups: usize,
    is_name: fn(usize) -> bool,
}

impl Columns {
    /// A table whose first `groups` columns say what neighbouring lines are about. `is_name` says which columns stand to
    /// the left, the others stand to the right.
    pub(crate) fn new(
        header: &[&'static str],
        groups: usize,
        rows: impl IntoIterator<Item = Vec<String>>,
        is_name: fn(usize) -> bool,
    ) -> Self {
        Self { header: header.to_vec(), rows: rows.into_iter().collect(), groups, is_name }
    }

    /// As a Markdown table, with the same alignment.
    pub fn markdown(&self) -> String {
        let rule = (0..self.header.len()).map(|column| if self.is_name(column) { "---" } else { "---:" });
        let rule = rule.collect::<Vec<_>>().join(" | ");
        let mut text = format!("| {} |\n| {rule} |\n", self.header.join(" | "));
        for row in &self.rows {
            let _ = writeln!(text, "| {} |", row.join(" | ").replace('\n', " "));
        }
        text
    }

    /// Names of the columns.
    pub(crate) fn header(&self) -> &[&'static str] {
        &self.header
    }

    /// The lines.
    pub(crate) fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// How many columns from the left say what neighbouring lines are about.
    pub(crate) fn groups(&self) -> usize {
        self.groups
    }

    /// Whether a column stands to the left.
    pub(crate) fn is_name(&self, column: usize) -> bool {
        (self.is_name)(column)
    }
}

impl Display for Columns {
    /// Plain text, two blanks between columns.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let header: Vec<String> = self.header.iter().map(|&name| name.into()).collect();
        let lines = || std::iter::once(&header).chain(&self.rows);
        let width = |column: usize| {
            lines().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..header.len()).map(width).collect();
        for line in lines() {
            let mut padded = String::new();
            for (column, (cell, &width)) in line.iter().zip(&widths).enumerate() {
                if self.is_name(column) {
                    write!(padded, "{cell:<width$}  ")?;
                } else {
                    write!(padded, "{cell:>width$}  ")?;
                }
            }
            writeln!(f, "{}", padded.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Columns {
        let rows = [["nave", "12.3"], ["a", "4"]].map(|row| row.map(String::from).to_vec());
        Columns::new(&["shot", "ms"], 1, rows, |column| column == 0)
    }

    #[test]
    fn names_stand_to_the_left_and_numbers_to_the_right() {
        assert_eq!(table().to_string(), "shot    ms\nnave  12.3\na        4\n");
    }

    #[test]
    fn markdown_has_a_rule_under_its_header() {
        assert_eq!(table().markdown(), "| shot | ms |\n| --- | ---: |\n| nave | 12.3 |\n| a | 4 |\n");
    }
}
