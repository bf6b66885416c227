//! The bits of HTML that reports are made of: one page, inline style, light and dark, phone and print.

use std::fmt::Write;

use crate::columns::Columns;

/// How a text is coloured; the words themselves say the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Well,
    Bad,
    Dim,
}

impl Tone {
    /// Of a verdict in a table; of everything else none.
    fn of(text: &str) -> Self {
        match text {
            "ok" => Self::Well,
            "-" | "not reached" => Self::Dim,
            _ if text.starts_with("unsupported") => Self::Dim,
            _ if text.starts_with("FAIL") => Self::Bad,
            _ => Self::Plain,
        }
    }

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

const STYLE: &str = include_str!("style.css");

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

    /// A section's heading, which links can name.
    pub(super) fn heading(&mut self, text: &str) {
        let _ = writeln!(self.text, "<h2 id=\"{}\">{}</h2>", anchor(text), escaped(text));
    }

    /// A heading of the third order, which links can name.
    pub(super) fn subheading(&mut self, text: &str) {
        let _ = writeln!(self.text, "<h3 id=\"{}\">{}</h3>", anchor(text), escaped(text));
    }

    /// Links to headings.
    pub(super) fn links<'t>(&mut self, headings: impl IntoIterator<Item = &'t str>) {
        self.text.push_str("<nav>");
        for heading in headings {
            let _ = write!(self.text, "<a href=\"#{}\">{}</a> ", anchor(heading), escaped(heading));
        }
        self.text.push_str("</nav>\n");
    }

    /// A table whose lines are grouped by its first columns; it scrolls sideways where it does not fit.
    pub(super) fn table(&mut self, table: &Columns) {
        let (groups, width) = (table.groups(), table.header().len() - table.groups());
        let class = |column: usize| if table.is_name(column + groups) { "name" } else { "" };
        self.text.push_str("<div class=\"scroll\"><table class=\"figures\">\n<thead><tr>");
        for (column, title) in table.header()[groups..].iter().enumerate() {
            let class = class(column);
            let _ = write!(self.text, "<th scope=\"col\" class=\"{class}\">{}</th>", escaped(title));
        }
        self.text.push_str("</tr></thead>\n<tbody>\n");
        let mut group: &[String] = &[];
        for row in table.rows() {
            let (of_group, cells) = row.split_at(groups.min(row.len()));
            if of_group != group {
                group = of_group;
                let _ = writeln!(
                    self.text,
                    "<tr><th class=\"group\" colspan=\"{width}\" scope=\"rowgroup\"><span>{}</span></th></tr>",
                    escaped(&group.join(", "))
                );
            }
            let is_wrong = cells.iter().any(|cell| Tone::of(cell) == Tone::Bad);
            self.text.push_str(if is_wrong { "<tr class=\"wrong\">" } else { "<tr>" });
            for column in 0..width {
                let text = cells.get(column).map_or("", String::as_str);
                let class = format!("{} {}", class(column), Tone::of(text).class());
                let (open, close) = if column == 0 { ("th scope=\"row\"", "th") } else { ("td", "td") };
                let _ = write!(self.text, "<{open} class=\"{}\">{}</{close}>", class.trim(), escaped(text));
            }
            self.text.push_str("</tr>\n");
        }
        self.text.push_str("</tbody>\n</table></div>\n");
    }

    /// What is written by `content` is folded away until somebody opens it; on paper it is open.
    pub(super) fn folded(&mut self, summary: &str, content: impl FnOnce(&mut Self)) {
        let _ = writeln!(self.text, "<details><summary>{}</summary>", escaped(summary));
        content(self);
        self.text.push_str("</details>\n");
    }

    /// A title with small print beside it, and up to three pictures under it: caption and data URI.
    pub(super) fn pictures<'t>(
        &mut self,
        (title, detail, tone): (&str, &str, Tone),
        [width, height]: [u32; 2],
        pictures: impl IntoIterator<Item = (&'t str, &'t str)>,
    ) {
        let (title, detail, class) = (escaped(title), escaped(detail), tone.class());
        let _ = writeln!(
            self.text,
            "<div class=\"entry\"><h4>{title} <small class=\"{class}\">{detail}</small></h4>\n<div class=\"pictures\">"
        );
        for (caption, uri) in pictures {
            let caption = escaped(caption);
            let _ = writeln!(
                self.text,
                "<figure><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" alt=\"{caption}\">\
                 <figcaption>{caption}</figcaption></figure>"
            );
        }
        self.text.push_str("</div></div>\n");
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

    /// Small print.
    pub(super) fn note(&mut self, text: &str) {
        let _ = writeln!(self.text, "<p class=\"note\">{}</p>", escaped(text));
    }

    /// Colours with their meanings.
    pub(super) fn legend(&mut self, colours: impl IntoIterator<Item = ([u8; 3], String)>) {
        self.text.push_str("<div class=\"legend\">");
        for ([r, g, b], meaning) in colours {
            let meaning = escaped(&meaning);
            let _ = write!(self.text, "<span><i style=\"background:rgb({r},{g},{b})\"></i>{meaning}</span>");
        }
        self.text.push_str("</div>\n");
    }

    /// The whole page.
    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</body>\n</html>\n");
        self.text
    }
}

/// A heading as an address within the page.
fn anchor(heading: &str) -> String {
    heading.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
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
