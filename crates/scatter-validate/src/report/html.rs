//! The bits of HTML that reports are made of: one page, inline style, light and dark, phone and print.

use std::fmt::Write;

/// A page that is being written.
pub(super) struct Page {
    text: String,
}

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8886; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 1rem auto; padding: 0 1rem; max-width: 80rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; border-top: 1px solid var(--line); padding-top: 1rem; }
pre { overflow-x: auto; font: 13px/1.4 ui-monospace, monospace; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0 1rem; }
dt { font-weight: 600; } dd { margin: 0; overflow-wrap: anywhere; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(18rem, 100%), 1fr)); gap: 1rem; }
.graphics { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(24rem, 100%), 1fr)); gap: 1rem; }
.graphics svg { break-inside: avoid; }
figure { margin: 0; } figcaption { font-size: .85rem; }
img { width: 100%; image-rendering: pixelated; border: 1px solid var(--line); }
.legend { display: flex; max-width: 30rem; } .legend span { flex: 1; height: 1rem; }
.ends { display: flex; max-width: 30rem; justify-content: space-between; font-size: .85rem; margin-bottom: 1rem; }
@media print { body { max-width: none; font-size: 11px; } pre { font-size: 8px; } figure { break-inside: avoid; }
  .legend span { print-color-adjust: exact; } }
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

    /// Pictures side by side: caption (escaped already) and data URI.
    pub(super) fn pictures<'t>(&mut self, pictures: impl IntoIterator<Item = (String, &'t str)>) {
        self.text.push_str("<div class=\"pictures\">\n");
        for (caption, uri) in pictures {
            let _ = writeln!(
                self.text,
                "<figure><img src=\"{uri}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>"
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
