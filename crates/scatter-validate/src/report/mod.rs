//! The report: one HTML page with everything in it, to be read without scripts and without a network.
//!
//! [`Report`] collects what there is to say; each section is a function of its own that appends to the page.

mod base64;
mod html;
mod picture;
mod stress;
mod tradeoff;

use scatter_scene::{RadianceImage, encode_png};

use crate::machine::Machine;
use crate::matrix::{Pictures, RAYCAST_TRUTH, SHADOW_MAP_TRUTH};
use crate::row::{Row, Verdict};
use crate::table::{HEADER, cells};
use html::{Page, TableRow, Tone};
pub use picture::exposure;
pub use stress::{stress_grid, stress_page};
pub use tradeoff::TradeSection;

/// What a report says. Pictures become PNGs as they are added, so that no radiance image is held.
pub struct Report {
    machine: Machine,
    command_line: String,
    date: String,
    rows: Vec<Row>,
    sections: Vec<(String, Section)>,
    shots: Vec<ShotSection>,
}

/// What stands in a section that a command adds to the report.
#[derive(Debug, Clone)]
pub enum Section {
    /// Columns of plain text.
    Text(String),
    /// A fragment of HTML without scripts and addresses; its text is escaped already.
    Html(String),
}

/// The pictures of one shot, as data URIs.
struct ShotSection {
    shot: String,
    size: [u32; 2],
    entries: Vec<Entry>,
    /// What full red and full blue stand for, in radiance.
    scale: f64,
}

/// One technique on one shot, or the two truths.
struct Entry {
    title: String,
    detail: String,
    tone: Tone,
    /// Caption and data URI.
    pictures: [(String, String); 3],
}

impl Report {
    /// An empty report of a run on this machine.
    pub fn new(machine: Machine, command_line: String, date: String) -> Self {
        Self { machine, command_line, date, rows: Vec::new(), sections: Vec::new(), shots: Vec::new() }
    }

    /// Adds a section, after the table and before the shots.
    pub fn add_section(&mut self, heading: &str, section: Section) {
        self.sections.push((heading.to_string(), section));
    }

    /// Adds the rows and pictures of a shot.
    pub fn add(&mut self, rows: &[Row], pictures: &Pictures) {
        self.rows.extend_from_slice(rows);
        let (map_truth, ray_truth) = (&pictures.shadow_map_truth, &pictures.raycast_truth);
        let exposure = exposure(ray_truth);
        let scale = difference_scale(map_truth);
        let toned = |image: &RadianceImage| uri(image.size, &picture::tone_mapped(image, exposure));
        let signed = |truth: &RadianceImage, image: &RadianceImage| {
            uri(image.size, &picture::signed_difference(truth, image, scale))
        };
        let row_of = |method: &str| rows.iter().find(|row| row.method == method);
        let truths = Entry {
            title: "the truths".into(),
            detail: row_of(SHADOW_MAP_TRUTH).map_or(String::new(), |row| {
                format!("the shadow map's own error: {} % rel_rmse", &cells(row)[RAY_RMSE])
            }),
            tone: Tone::Dim,
            pictures: [
                (RAYCAST_TRUTH.into(), toned(ray_truth)),
                (SHADOW_MAP_TRUTH.into(), toned(map_truth)),
                (format!("{SHADOW_MAP_TRUTH} − {RAYCAST_TRUTH}"), signed(ray_truth, map_truth)),
            ],
        };
        let techniques = pictures.techniques.iter().map(|(method, image)| Entry {
            title: method.clone(),
            detail: row_of(method).map_or(String::new(), detail),
            tone: if row_of(method).is_some_and(Row::has_failed) { Tone::Bad } else { Tone::Dim },
            pictures: [
                (method.clone(), toned(image)),
                (format!("{method} − {SHADOW_MAP_TRUTH}"), signed(map_truth, image)),
                (format!("{method} − {RAYCAST_TRUTH}"), signed(ray_truth, image)),
            ],
        });
        let entries = [truths].into_iter().chain(techniques).collect();
        self.shots.push(ShotSection { shot: pictures.shot.clone(), size: map_truth.size, entries, scale });
    }

    /// The page.
    pub fn html(&self) -> String {
        let mut page = Page::new("Scatter: validation report");
        self.push_summary(&mut page);
        page.links(self.shots.iter().map(|shot| (shot.shot.as_str(), anchor(&shot.shot))));
        self.push_table(&mut page);
        for (heading, section) in &self.sections {
            page.heading(heading);
            match section {
                Section::Text(text) => page.preformatted(text),
                Section::Html(html) => page.fragment(html),
            }
        }
        if !self.shots.is_empty() {
            page.heading("Pictures");
            page.paragraph(
                "Differences: red is too bright, blue too dark, white equal. The colour is full at a tenth of the \
                 truth's mean and beyond, and follows the square root below; each shot has its scale. Magenta is not \
                 a finite number.",
            );
        }
        for shot in &self.shots {
            shot.push(&mut page);
        }
        self.push_settings(&mut page);
        page.finish()
    }

    fn push_summary(&self, page: &mut Page) {
        let failed = self.rows.iter().filter(|row| row.has_failed()).count();
        let unsupported = |row: &&Row| matches!(row.verdict, Some(Verdict::Unsupported(_)));
        let unsupported = self.rows.iter().filter(unsupported).count();
        let counted = |count: usize, one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
        let judged = if failed == 0 { "none".into() } else { failed.to_string() };
        let mut text = format!(
            "{} on {}: {judged} out of tolerance",
            counted(self.rows.len(), "row"),
            counted(self.shots.len(), "shot")
        );
        if unsupported > 0 {
            text += &format!(", {unsupported} unsupported");
        }
        text += &format!(". {}", self.date);
        page.summary(&text, if failed == 0 { Tone::Well } else { Tone::Bad });
    }

    fn push_settings(&self, page: &mut Page) {
        page.heading("Machine and settings");
        let cores = self.machine.cores.to_string();
        let settings = [
            ("date", self.date.as_str()),
            ("command line", &self.command_line),
            ("processor", &self.machine.cpu),
            ("cores", &cores),
            ("vector instructions", &self.machine.simd),
            ("maps by", self.machine.vulkan.as_deref().unwrap_or("ray casts")),
            ("system", &self.machine.os),
            ("compiler", &self.machine.rustc),
            ("scatter", &self.machine.version),
        ];
        page.definitions(settings);
    }

    fn push_table(&self, page: &mut Page) {
        page.heading("Techniques × shots");
        page.paragraph(
            "Errors are relative to the truth's mean, against the exact image for the same shadow map (the \
             technique's own error); /ray against the exact image for the triangles (with the shadow map's error). \
             The ratio is the marcher's time at the same quality level over the technique's.",
        );
        let mut last = None;
        let lines: Vec<TableRow> = self
            .rows
            .iter()
            .map(|row| {
                let starts_group = last.is_some_and(|last| last != &row.shot);
                last = Some(&row.shot);
                table_row(row, starts_group)
            })
            .collect();
        page.table(&HEADER, &lines);
        let remarks = crate::table::remarks(&self.rows);
        if !remarks.is_empty() {
            page.preformatted(&remarks);
        }
    }
}

impl ShotSection {
    fn push(&self, page: &mut Page) {
        page.anchor(&self.shot, &anchor(&self.shot));
        page.legend(self.scale, picture::signed_colour);
        for entry in &self.entries {
            page.entry(&entry.title, &entry.detail, entry.tone);
            let pictures = entry.pictures.iter().map(|(caption, uri)| (caption.as_str(), uri.as_str()));
            page.row(self.size, pictures);
        }
    }
}

/// The picture of an image's difference to the nearer one of the truths, as a PNG, and which one that is. Colours as in
/// the report.
pub fn difference_png(
    pictures: &Pictures,
    image: &RadianceImage,
) -> std::io::Result<(&'static str, Vec<u8>)> {
    let distance = |truth: &RadianceImage| -> f64 {
        let values = truth.pixels.iter().flatten().zip(image.pixels.iter().flatten());
        values.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum()
    };
    let (map_truth, ray_truth) = (&pictures.shadow_map_truth, &pictures.raycast_truth);
    let (name, truth) = if distance(ray_truth) < distance(map_truth) {
        (RAYCAST_TRUTH, ray_truth)
    } else {
        (SHADOW_MAP_TRUTH, map_truth)
    };
    let pixels = picture::signed_difference(truth, image, difference_scale(truth));
    Ok((name, encode_png(image.size, &pixels)?))
}

/// Column of the error against ray-cast truth.
const RAY_RMSE: usize = 7;

/// A row's figures in a sentence.
fn detail(row: &Row) -> String {
    let cells = cells(row);
    let options = row.options.iter().map(|(key, value)| format!("{key}={value}, ")).collect::<String>();
    format!(
        "{options}{} ms, rel_rmse {} %, p99 {} %, to the triangles {} %: {}",
        cells[2], cells[4], cells[5], cells[RAY_RMSE], cells[9]
    )
}

fn table_row(row: &Row, starts_group: bool) -> TableRow {
    let tone = match row.verdict {
        Some(Verdict::Ok) => Tone::Well,
        Some(Verdict::Fail(_)) => Tone::Bad,
        Some(Verdict::Unsupported(_)) | None => Tone::Dim,
    };
    let cells = Vec::from(cells(row));
    let last = cells.len().saturating_sub(1);
    let toned = |(column, text)| (text, if column == last { tone } else { Tone::Plain });
    TableRow { cells: cells.into_iter().enumerate().map(toned).collect(), names: 2, starts_group }
}

/// A shot's name as an address within the page.
fn anchor(shot: &str) -> String {
    let letters = shot.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("shot-{}", letters.collect::<String>())
}

fn uri(size: [u32; 2], pixels: &[u8]) -> String {
    // Only pixels that do not fit their size fail to encode; the caption is still shown then.
    let png = encode_png(size, pixels).unwrap_or_default();
    format!("data:image/png;base64,{}", base64::encode(&png))
}

/// A tenth of the reference's mean: what the coarsest quality level allows.
fn difference_scale(reference: &RadianceImage) -> f64 {
    let finite = || reference.pixels.iter().flatten().map(|&v| f64::from(v)).filter(|v| v.is_finite());
    let count = finite().count().max(1);
    0.1 * finite().sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    fn report() -> Report {
        let mut report =
            Report::new(Machine::this(), "xtask validate --shot <a&b>".into(), "2026-01-02".into());
        let image = |value: f32| RadianceImage { size: [3, 2], pixels: vec![[value; 3]; 6] };
        let pictures = Pictures {
            shot: "nave".into(),
            shadow_map_truth: image(1.0),
            raycast_truth: image(1.1),
            techniques: vec![("raymarch".into(), image(0.9))],
        };
        report.add(&[row("raymarch", "nave")], &pictures);
        report
    }

    #[test]
    fn the_page_needs_nothing_from_elsewhere_and_runs_nothing() {
        let html = report().html();
        assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
        for forbidden in ["<script", "http://", "https://", "<link", "url("] {
            assert!(!html.contains(forbidden), "{forbidden}");
        }
        // Two truths and their difference; one technique and two differences.
        assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 6);
        assert_eq!(html.matches("src=").count(), 6, "every picture is in the page");
        assert_eq!(html.matches("alt=\"").count(), 6, "every picture says what it is");
    }

    /// Tags that have no end.
    const EMPTY_TAGS: [&str; 2] = ["meta", "img"];

    #[test]
    fn every_tag_that_opens_closes_in_its_place() {
        let mut report = report();
        report.add_section("Text & more", Section::Text("a < b\n".into()));
        report.add_section("Grid", Section::Html("<p>as it <b>is</b></p>".into()));
        let html = report.html();
        let mut open: Vec<&str> = Vec::new();
        for tag in html.split('<').skip(1).filter_map(|rest| rest.split_once('>')).map(|(tag, _)| tag) {
            let name = tag.split_whitespace().next().unwrap_or("");
            match name.strip_prefix('/') {
                Some(name) => assert_eq!(open.pop(), Some(name)),
                None if name.starts_with('!') || EMPTY_TAGS.contains(&name) => {}
                None => open.push(name),
            }
        }
        assert!(open.is_empty(), "{open:?}");
        assert!(html.contains("Text &amp; more") && html.contains("<p>as it <b>is</b></p>"));
        assert!(html.find("as it").unwrap() < html.find("id=\"shot-nave\"").unwrap(), "before the shots");
        assert!(html.contains("href=\"#shot-nave\""));
    }

    #[test]
    fn a_failure_is_in_the_summary_in_the_table_and_spelled_out() {
        let mut report = report();
        let mut failed = row("raymarch", "nave");
        failed.verdict = Some(Verdict::Fail(vec!["1 < 2".into()]));
        report.rows.push(failed);
        let html = report.html();
        assert!(html.contains("<p class=\"summary bad\">2 rows on 1 shot: 1 out of tolerance"), "{html}");
        assert!(html.contains("<td class=\"bad\">FAIL</td>"));
        assert!(html.contains("FAIL raymarch on nave: 1 &lt; 2"));
    }

    #[test]
    fn the_picture_of_a_difference_is_to_the_nearer_truth() {
        let image = |value: f32| RadianceImage { size: [3, 2], pixels: vec![[value; 3]; 6] };
        let pictures = Pictures {
            shot: "nave".into(),
            shadow_map_truth: image(1.0),
            raycast_truth: image(2.0),
            techniques: Vec::new(),
        };
        for (value, truth) in [(1.1, SHADOW_MAP_TRUTH), (1.9, RAYCAST_TRUTH)] {
            let (name, png) = difference_png(&pictures, &image(value)).unwrap();
            assert_eq!(name, truth);
            assert!(png.starts_with(b"\x89PNG"));
        }
    }

    #[test]
    fn text_is_escaped() {
        let html = report().html();
        assert!(html.contains("--shot &lt;a&amp;b&gt;") && !html.contains("<a&b>"));
    }
}
