//! The statements of an OBJ or MTL text: lines joined and without comments, each with the number of its first line.
//!
//! Source: the "Object Files" appendix of Wavefront's Advanced Visualizer manual. Departures, as people's files need
//! them: a line ends at LF, CR or both; a `#` begins a comment only at the start of a word and not within `1.#IND`; in
//! names (of materials, files, objects) it does only at the start of a line, and a backslash at their end continues
//! nothing; neither does one at the end of a comment.

use std::borrow::Cow;

/// The text of a file: UTF-8, or else Latin-1, in which every byte is a character.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().copied().map(char::from).collect()),
    }
}

/// Calls `statement` with every statement and the number of its line, from 1.
pub(super) fn each_statement<E>(
    text: &str,
    mut statement: impl FnMut(&str, usize) -> Result<(), E>,
) -> Result<(), E> {
    let mut joined = String::new();
    let mut first_line = 1;
    for (line_idx, line) in physical_lines(text).enumerate() {
        if joined.is_empty() {
            first_line = line_idx + 1;
            // The usual case copies nothing.
            match continued(line) {
                (part, false) => statement(part, first_line)?,
                (part, true) => {
                    joined.push_str(part);
                    joined.push(' ');
                }
            }
            continue;
        }
        let (part, continues) = continued(line);
        joined.push_str(part);
        if continues {
            joined.push(' ');
        } else {
            statement(&joined, first_line)?;
            joined.clear();
        }
    }
    if joined.is_empty() { Ok(()) } else { statement(&joined, first_line) }
}

/// Lines that end at LF, CR LF or CR.
fn physical_lines(text: &str) -> impl Iterator<Item = &str> {
    text.split('\n').flat_map(|line| {
        let line = line.strip_suffix('\r').unwrap_or(line);
        // Lines of old Macintosh files; rare, so most lines are one part.
        line.split('\r')
    })
}

/// A line without its comment, and whether the next line continues it.
fn continued(line: &str) -> (&str, bool) {
    let line = line.trim();
    match line.as_bytes().first() {
        // Most lines, and none of them a name.
        Some(b'v' | b'f') => {}
        Some(b'#') => return ("", false),
        _ if holds_a_name(line) => return (line, false),
        _ => {}
    }
    let line = match line.find('#') {
        None => line,
        Some(first) => without_comment(line, first),
    };
    match line.strip_suffix('\\') {
        Some(part) => (part, true),
        None => (line, false),
    }
}

fn holds_a_name(line: &str) -> bool {
    let end = line.find(char::is_whitespace).unwrap_or(line.len());
    matches!(&line[..end], "o" | "g" | "usemtl" | "mtllib" | "newmtl" | "call" | "csh")
        || line.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("map_"))
}

/// What stands before the comment; `first` is where the first `#` is. Numbers of Microsoft's C library hold one:
/// `1.#IND`, `-1.#QNAN`, `1.#INF000`.
fn without_comment(line: &str, first: usize) -> &str {
    let mut from = first;
    loop {
        let rest = &line[from + 1..];
        let is_number = line[..from].ends_with('.')
            && ["IND", "QNAN", "SNAN", "NAN", "INF"]
                .iter()
                .any(|word| rest.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word)));
        if !is_number {
            return line[..from].trim_end();
        }
        match rest.find('#') {
            Some(at) => from += 1 + at,
            None => return line,
        }
    }
}

/// A number as any exporter spells it: `-nan(ind)`, `1.#QNAN` and the like are NaN, `1.#INF` is infinite.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(number) = word.parse() {
        return Some(number);
    }
    let unsigned = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    if unsigned.starts_with("nan") || unsigned.starts_with("qnan") || unsigned.starts_with("snan") {
        return Some(f64::NAN);
    }
    let (_, kind) = unsigned.split_once(".#")?;
    if kind.starts_with("inf") {
        return Some(f64::INFINITY);
    }
    ["ind", "qnan", "snan", "nan"].iter().any(|word| kind.starts_with(word)).then_some(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(text: &str) -> Vec<(String, usize)> {
        let mut found = Vec::new();
        let collect = |statement: &str, line| {
            if !statement.trim().is_empty() {
                found.push((statement.split_whitespace().collect::<Vec<_>>().join(" "), line));
            }
            Ok::<_, ()>(())
        };
        each_statement(text, collect).unwrap();
        found
    }

    #[test]
    fn lines_join_and_comments_end_them_however_they_are_written() {
        for end in ["\n", "\r\n", "\r"] {
            let text = [
                "# D:\\houses\\",
                "v 1 2 3 # C:\\",
                "f 1 \\",
                "2 3",
                "o D:\\house\\",
                "usemtl Material #25",
                "f 4#x",
            ]
            .join(end);
            let expected = [
                ("v 1 2 3", 2),
                ("f 1 2 3", 3),
                ("o D:\\house\\", 5),
                ("usemtl Material #25", 6),
                ("f 4", 7),
            ];
            assert_eq!(statements(&text), expected.map(|(text, line)| (text.to_owned(), line)), "{end:?}");
        }
        assert_eq!(
            statements("v -1.#IND 1.#QNAN00 1.#INF # 1.#IND"),
            [("v -1.#IND 1.#QNAN00 1.#INF".to_owned(), 1)]
        );
        assert_eq!(statements("f 1 2 \\"), [("f 1 2".to_owned(), 1)]);
    }

    #[test]
    fn every_spelling_of_what_is_no_number_is_read() {
        for word in [
            "nan",
            "NaN",
            "-nan",
            "-nan(ind)",
            "nan(snan)",
            "1.#IND",
            "-1.#IND00",
            "1.#QNAN",
            "1.#SNAN",
            "QNAN",
        ] {
            assert!(number(word).unwrap().is_nan(), "{word}");
        }
        for word in ["inf", "-Infinity", "1.#INF", "-1.#INF000"] {
            assert!(number(word).unwrap().is_infinite(), "{word}");
        }
        assert_eq!(["1.5", "-.5", "+2", "1.e1"].map(|word| number(word).unwrap()), [1.5, -0.5, 2.0, 10.0]);
        assert_eq!(["x", "1,5", "", "1.#X"].map(number), [None; 4]);
    }

    #[test]
    fn latin_1_is_read_byte_by_byte() {
        assert_eq!(text(b"usemtl caf\xe9"), "usemtl caf\u{e9}");
        assert_eq!(text("usemtl caf\u{e9}".as_bytes()), "usemtl caf\u{e9}");
    }
}
