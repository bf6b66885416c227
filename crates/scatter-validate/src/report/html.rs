//! The bits of HTML that reports are made of: one page, inline style, light and dark, phone and print.

use std::fmt::Write;

/// How a text is coloured; the words themselves say the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Well,
    Bad,
    Dim,
}

/// A line of a [`Page::table`].
pub(super) struct TableRow {
    /// Text and colour of each cell.
    pub cells: Vec<(String, Tone)>,
    /// How many cells, from the left, are names; the others are numbers.
    pub names: usize,
    /// Whether a line is drawn above.
    pub starts_group: bool,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Well => "well",
            Self::Bad => "bad",
            Self::Dim => "dim",
        }
    }
}

/// A page that is being written.
pub(super) struct Page {
    text: String,
}

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8886; --shade: #8882; --well: #1a7f37; --bad: #c62828; --dim: #707070; }
@media (prefers-color-scheme: dark) { :root { --well: #57d576; --bad: #ff8a80; --dim: #a0a0a0; } }
body { font: 16px/1.5 system-ui, sans-serif; margin: 1rem auto; padding: 0 1rem; max-width: 80rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; border-top: 1px solid var(--line); padding-top: 1rem; }
pre { overflow-x: auto; font: 13px/1.4 ui-monospace, monospace; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0 1rem; }
dt { font-weight: 600; } dd { margin: 0; overflow-wrap: anywhere; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(18rem, 100%), 1fr)); gap: 1rem; }
.graphics { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(24rem, 100%), 1fr)); gap: 1rem; }
.graphics svg { break-inside: avoid; }
figure { margin: 0; } figcaption { font-size: .85rem; }
img { box-sizing: border-box; width: 100%; height: auto; image-rendering: pixelated; border: 1px solid var(--line); }
.legend { display: flex; max-width: 30rem; } .legend span { flex: 1; height: 1rem; }
.ends { display: flex; max-width: 30rem; justify-content: space-between; font-size: .85rem; margin-bottom: 1rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 .3rem; } h3 small { font-weight: normal; color: var(--dim); }
h1, h2, h3 { line-height: 1.3; break-after: avoid; overflow-wrap: anywhere; }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1rem; } .summary { font-size: 1.1rem; }
.scroll { overflow-x: auto; }
.figures { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; white-space: nowrap; }
.figures th, .figures td { padding: .15rem .6rem; text-align: right; border-bottom: 1px solid var(--line); }
.figures th { font-weight: 600; } .figures .name, .figures td:last-child, .figures th:last-child { text-align: left; }
.figures tbody tr:hover { background: var(--shade); } .figures .first td { border-top: 2px solid var(--line); }
.well { color: var(--well); } .bad { color: var(--bad); font-weight: 600; } .dim { color: var(--dim); }
.row { display: grid; grid-template-columns: repeat(3, 1fr); gap: .6rem; break-inside: avoid; }
@media (max-width: 45rem) { .row { grid-template-columns: 1fr 1fr; } .row figure:first-child { grid-column: 1 / -1; } }
@media print { :root { font-size: 11px; } body { max-width: none; margin: 0; padding: 0; font-size: 11px; } pre, .figures { font-size: 8px; }
  .figures th, .figures td { padding: .05rem .3rem; } .scroll { overflow: visible; } nav { display: none; }
  figure { break-inside: avoid; } .row { grid-template-columns: repeat(3, 1fr); }
  .row figure:first-child { grid-column: auto; } .legend span { print-color-adjust: exact; } }
";

impl Page {
    /// A page with a title.
    pub(super) fn new(title: &str) -> Self {
        let title = escaped(title);
        let mut text = String::new();
        let _ = writeln!(
            text,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>"
        );
        Self { text }
    }

    /// A section's heading.
    pub(super) fn heading(&mut self, text: &str) {
        let _ = writeln!(self.text, "<h2>{}</h2>", escaped(text));
    }

    /// A paragraph.
    pub(super) fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.text, "<p>{}</p>", escaped(text));
    }

    /// Text as it is, in columns.
    pub(super) fn preformatted(&mut self, text: &str) {
        let _ = writeln!(self.text, "<pre>{}</pre>", escaped(text));
    }

    /// Names and values.
    pub(super) fn definitions<'t>(&mut self, pairs: impl IntoIterator<Item = (&'t str, &'t str)>) {
        self.text.push_str("<dl>\n");
        for (name, value) in pairs {
            let _ = writeln!(self.text, "<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value));
        }
        self.text.push_str("</dl>\n");
    }

    /// A section's heading that links can name.
    pub(super) fn anchor(&mut self, text: &str, id: &str) {
        let _ = writeln!(self.text, "<h2 id=\"{}\">{}</h2>", escaped(id), escaped(text));
    }

    /// Links to [`Self::anchor`]s: text and id.
    pub(super) fn links<'t>(&mut self, links: impl IntoIterator<Item = (&'t str, String)>) {
        self.text.push_str("<nav>");
        for (text, id) in links {
            let _ = write!(self.text, "<a href=\"#{}\">{}</a> ", escaped(&id), escaped(text));
        }
        self.text.push_str("</nav>\n");
    }

    /// A table that scrolls sideways where it does not fit.
    pub(super) fn table(&mut self, header: &[&str], rows: &[TableRow]) {
        self.text.push_str("<div class=\"scroll\"><table class=\"figures\">\n<thead><tr>");
        let names = rows.first().map_or(0, |row| row.names);
        for (column, title) in header.iter().enumerate() {
            let class = if column < names { " class=\"name\"" } else { "" };
            let _ = write!(self.text, "<th scope=\"col\"{class}>{}</th>", escaped(title));
        }
        self.text.push_str("</tr></thead>\n<tbody>\n");
        for row in rows {
            self.text.push_str(if row.starts_group { "<tr class=\"first\">" } else { "<tr>" });
            for (column, (text, tone)) in row.cells.iter().enumerate() {
                let name = if column < row.names { "name " } else { "" };
                let class = format!("{name}{}", tone.class());
                let _ = write!(self.text, "<td class=\"{}\">{}</td>", class.trim_end(), escaped(text));
            }
            self.text.push_str("</tr>\n");
        }
        self.text.push_str("</tbody>\n</table></div>\n");
    }

    /// A heading of the third order with small print beside it.
    pub(super) fn entry(&mut self, title: &str, detail: &str, tone: Tone) {
        let (title, detail) = (escaped(title), escaped(detail));
        let _ = writeln!(self.text, "<h3>{title} <small class=\"{}\">{detail}</small></h3>", tone.class());
    }

    /// Up to three pictures in a row: caption and data URI.
    pub(super) fn row<'t>(&mut self, size: [u32; 2], pictures: impl IntoIterator<Item = (&'t str, &'t str)>) {
        let [width, height] = size;
        self.text.push_str("<div class=\"row\">\n");
        for (caption, uri) in pictures {
            let caption = escaped(caption);
            let _ = writeln!(
                self.text,
                "<figure><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" alt=\"{caption}\">\
                 <figcaption>{caption}</figcaption></figure>"
            );
        }
        self.text.push_str("</div>\n");
    }

    /// Inline SVG elements side by side.
    pub(super) fn graphics(&mut self, graphics: impl IntoIterator<Item = String>) {
        self.text.push_str("<div class=\"graphics\">\n");
        self.text.extend(graphics);
        self.text.push_str("</div>\n");
    }

    /// The one sentence that says how it went.
    pub(super) fn summary(&mut self, text: &str, tone: Tone) {
        let _ = writeln!(self.text, "<p class=\"summary {}\">{}</p>", tone.class(), escaped(text));
    }

    /// HTML as it is; whoever made it has escaped it.
    pub(super) fn fragment(&mut self, html: &str) {
        self.text.push_str(html);
        self.text.push('\n');
    }

    /// A signed colour scale from −`scale` to `scale`.
    pub(super) fn legend(&mut self, scale: f64, colour: impl Fn(f64) -> [u8; 3]) {
        self.text.push_str("<div class=\"legend\">");
        for step in -10..=10 {
            let [r, g, b] = colour(f64::from(step) / 10.0);
            let _ = write!(self.text, "<span style=\"background:rgb({r},{g},{b})\"></span>");
        }
        let _ = writeln!(
            self.text,
            "</div>\n<div class=\"ends\"><span>−{scale:.3e}</span><span>0</span><span>{scale:.3e}</span></div>"
        );
    }

    /// The whole page.
    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</body>\n</html>\n");
        self.text
    }
}

/// Text with the five characters that mean something in HTML replaced.
pub(super) fn escaped(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut escaped, c| {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(c),
        }
        escaped
    })
}
