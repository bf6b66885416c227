//! Plain text in aligned columns, two blanks between them.

use std::fmt::Write;

/// A header and a line a row; `is_name` says which columns stand to the left, the others stand to the right. A row's
/// missing cells are empty.
pub(crate) fn aligned(
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
    is_name: impl Fn(usize) -> bool,
) -> String {
    let mut lines: Vec<Vec<String>> = vec![header.iter().map(|&name| name.into()).collect()];
    lines.extend(rows);
    let width = |column: usize| {
        lines.iter().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let mut text = String::new();
    for line in &lines {
        let mut padded = String::new();
        for (column, (cell, &width)) in line.iter().zip(&widths).enumerate() {
            let _ = if is_name(column) {
                write!(padded, "{cell:<width$}  ")
            } else {
                write!(padded, "{cell:>width$}  ")
            };
        }
        text.push_str(padded.trim_end());
        text.push('\n');
    }
    text
}

/// A table as Markdown, with the same alignment.
pub(crate) fn markdown(
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
    is_name: impl Fn(usize) -> bool,
) -> String {
    let rule = (0..header.len()).map(|column| if is_name(column) { "---" } else { "---:" });
    let mut text = format!("| {} |\n| {} |\n", header.join(" | "), rule.collect::<Vec<_>>().join(" | "));
    for row in rows {
        let _ = writeln!(text, "| {} |", row.join(" | ").replace('\n', " "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Vec<String>> {
        [["nave", "12.3"], ["a", "4"]].map(|row| row.map(String::from).to_vec()).to_vec()
    }

    #[test]
    fn names_stand_to_the_left_and_numbers_to_the_right() {
        let text = aligned(&["shot", "ms"], rows(), |column| column == 0);
        assert_eq!(text, "shot    ms\nnave  12.3\na        4\n");
    }

    #[test]
    fn markdown_has_a_rule_under_its_header() {
        let text = markdown(&["shot", "ms"], rows(), |column| column == 0);
        assert_eq!(text, "| shot | ms |\n| --- | ---: |\n| nave | 12.3 |\n| a | 4 |\n");
    }
}
