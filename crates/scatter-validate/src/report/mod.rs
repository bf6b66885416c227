//! The report: one HTML page with everything in it, to be read without scripts and without a network.
//!
//! [`Report`] collects what there is to say; each section is a file of its own that appends to the page. `validate`,
//! `tradeoff` and `stress` make their pages of the same sections.

mod base64;
mod html;
mod picture;
mod shot;
mod stress;
mod tradeoff;

use crate::machine::Machine;
use crate::matrix::Pictures;
use crate::plot::TransmittancePlot;
use crate::row::{Row, Verdict};
use crate::table::{columns, remarks};
use html::{Page, Tone};
pub use picture::exposure;
use shot::ShotSection;
pub use shot::difference_png;
pub use stress::StressSection;
pub use tradeoff::TradeSection;

/// What a report says. Pictures become PNGs as they are added, so that no radiance image is held.
pub struct Report {
    title: &'static str,
    machine: Machine,
    command_line: String,
    date: String,
    settings: Vec<(&'static str, String)>,
    rows: Vec<Row>,
    sections: Vec<(String, Section)>,
    shots: Vec<ShotSection>,
}

/// What stands in a section that a command adds to the report.
#[derive(Debug, Clone)]
pub enum Section {
    /// Columns of plain text; stands behind the table of techniques and shots.
    Text(String),
    /// Time against error; stands behind the pictures.
    Trade(TradeSection),
    /// What is left of the light over depth, a plot a shot, and how to read it; stands behind the pictures.
    Transmittance(String, Vec<TransmittancePlot>),
    /// The stress matrix; stands behind the pictures.
    Stress(StressSection),
}

const TABLE: &str = "Techniques × shots";
const PICTURES: &str = "Pictures";
const SETTINGS: &str = "Machine and settings";

impl Report {
    /// An empty report of a run on this machine.
    pub fn new(title: &'static str, machine: Machine, command_line: String, date: String) -> Self {
        Self {
            title,
            machine,
            command_line,
            date,
            settings: Vec::new(),
            rows: Vec::new(),
            sections: Vec::new(),
            shots: Vec::new(),
        }
    }

    /// Adds a setting of the run, to stand beside machine and command line.
    pub fn add_setting(&mut self, name: &'static str, value: String) {
        self.settings.push((name, value));
    }

    /// Adds a section.
    pub fn add_section(&mut self, heading: &str, section: Section) {
        self.sections.push((heading.to_string(), section));
    }

    /// Adds the rows and pictures of a shot.
    pub fn add(&mut self, rows: &[Row], pictures: &Pictures) {
        self.rows.extend_from_slice(rows);
        self.shots.push(ShotSection::new(rows, pictures));
    }

    /// The page.
    pub fn html(&self) -> String {
        let mut page = Page::new(self.title);
        self.push_summary(&mut page);
        page.links(self.headings());
        if !self.rows.is_empty() {
            self.push_table(&mut page);
        }
        for (heading, section) in &self.sections {
            if let Section::Text(text) = section {
                page.heading(heading);
                page.preformatted(text);
            }
        }
        if !self.shots.is_empty() {
            self.push_pictures(&mut page);
        }
        for (heading, section) in &self.sections {
            match section {
                Section::Text(_) => continue,
                Section::Trade(section) => {
                    page.heading(heading);
                    section.push(&mut page);
                }
                Section::Transmittance(introduction, plots) => {
                    page.heading(heading);
                    page.paragraph(introduction);
                    page.graphics(plots.iter().map(TransmittancePlot::inline_svg));
                }
                Section::Stress(section) => {
                    page.heading(heading);
                    section.push(&mut page);
                }
            }
        }
        self.push_settings(&mut page);
        page.finish()
    }

    /// All headings of the second order, as they stand on the page.
    fn headings(&self) -> impl Iterator<Item = &str> {
        let of = |is_text: bool| {
            let sections = self.sections.iter();
            sections.filter(move |(_, section)| matches!(section, Section::Text(_)) == is_text)
        };
        let table = (!self.rows.is_empty()).then_some(TABLE);
        let pictures = (!self.shots.is_empty()).then_some(PICTURES);
        let texts = of(true).map(|(heading, _)| heading.as_str());
        let others = of(false).map(|(heading, _)| heading.as_str());
        table.into_iter().chain(texts).chain(pictures).chain(others).chain([SETTINGS])
    }

    fn push_summary(&self, page: &mut Page) {
        page.note(&format!("{}, {}", self.date, self.machine.cpu));
        if !self.rows.is_empty() {
            let failed = self.rows.iter().filter(|row| row.has_failed()).count();
            let unsupported = |row: &&Row| matches!(row.verdict, Some(Verdict::Unsupported(_)));
            let unsupported = self.rows.iter().filter(unsupported).count();
            let counted =
                |count: usize, one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
            let judged = if failed == 0 { "none".into() } else { failed.to_string() };
            let mut text = format!(
                "{} on {}: {judged} out of tolerance",
                counted(self.rows.len(), "row"),
                counted(self.shots.len(), "shot")
            );
            if unsupported > 0 {
                text += &format!(", {unsupported} unsupported");
            }
            page.summary(&text, if failed == 0 { Tone::Well } else { Tone::Bad });
        }
        // On a page of the matrix alone it follows at once.
        let sections = self.sections.iter().filter(|_| !self.rows.is_empty());
        for (heading, section) in sections {
            if let Section::Stress(section) = section {
                let (text, tone) = section.summary();
                page.summary(&format!("{heading}: {text}"), tone);
            }
        }
    }

    fn push_pictures(&self, page: &mut Page) {
        page.heading(PICTURES);
        page.paragraph(
            "Of each shot the exact image for the triangles (truth-raycast), the exact image for the shadow map \
             (truth-shadow-map), and what each technique makes of that map, all at one exposure. Beside them the \
             differences: to the shadow map's truth is the technique's own error, to the ray casts' it has the map's \
             error too. Between the colours of the legend the square root of the difference is mixed in. Magenta is not \
             a finite number.",
        );
        page.links(self.shots.iter().map(|shot| shot.shot.as_str()));
        for shot in &self.shots {
            shot.push(page);
        }
    }

    fn push_settings(&self, page: &mut Page) {
        page.heading(SETTINGS);
        let cores = self.machine.cores.to_string();
        let machine = [
            ("processor", self.machine.cpu.as_str()),
            ("cores", &cores),
            ("vector instructions", &self.machine.simd),
            ("maps by", self.machine.vulkan.as_deref().unwrap_or("ray casts")),
            ("system", &self.machine.os),
            ("compiler", &self.machine.rustc),
            ("scatter", &self.machine.version),
        ];
        let run = [("date", self.date.as_str()), ("command line", &self.command_line)];
        let settings = self.settings.iter().map(|(name, value)| (*name, value.as_str()));
        page.definitions(run.into_iter().chain(settings).chain(machine));
    }

    fn push_table(&self, page: &mut Page) {
        page.heading(TABLE);
        page.paragraph(
            "Errors against the exact image for the same shadow map, the technique's own: rel_rmse is the root mean square \
             over the truth's mean, p99 what 99 % of the pixels stay below (each relative to its own value), bias that \
             of the mean. rmse/ray is against the exact image for the triangles, with the shadow map's error in it. The \
             ratio is the marcher's time at the same quality level over the technique's: above 1 the technique is \
             faster.",
        );
        page.table(&columns(&self.rows));
        let remarks = remarks(&self.rows);
        if !remarks.is_empty() {
            page.preformatted(&remarks);
        }
    }
}

#[cfg(test)]
mod tests {
    use scatter_scene::RadianceImage;

    use super::*;
    use crate::row::tests::row;
    use crate::stress::StressResult;
    use crate::stress::cell::Cell;
    use crate::tradeoff::charts::trade_plot;

    use crate::tradeoff::tables::{level_table, rung_table};
    use crate::tradeoff::{example_trade as trade, level_rows};

    fn report() -> Report {
        let command_line = "xtask validate --shot <a&b>".into();
        let mut report = Report::new("Scatter: a test", Machine::this(), command_line, "2026-01-02".into());
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

    /// With every kind of section.
    fn full_report() -> Report {
        let mut report = report();
        let trade = trade();
        let section = TradeSection {
            introduction: "time & <error>".into(),
            plots: vec![trade_plot(&trade), trade_plot(&trade)],
            table: level_table(&level_rows(&trade), &[]),
            meaning_of_details: "all of them".into(),
            details: vec![("All settings".into(), rung_table(&trade))],
        };
        report.add_section("Speed and accuracy", Section::Trade(section));
        let cells = vec![
            (Cell::Ok { error: 1e-7 }, 1.0),
            (Cell::Unsupported("<why> & how".into()), 1.0),
            (Cell::fault("a NaN"), 1.0),
        ];
        let result =
            StressResult { group: "maps", name: "1x1 <texel>".into(), size: [3, 2], map_side: 1, cells };
        let section = StressSection {
            results: vec![result],
            methods: vec!["a", "b", "c"],
            modes: vec!["b with k=v".into()],
        };
        report.add_section("Stress matrix", Section::Stress(section));
        report.add_section("Text & more", Section::Text("a < b\n".into()));
        report.add_setting("level", "game".into());
        report
    }

    #[test]
    fn the_page_needs_nothing_from_elsewhere_and_runs_nothing() {
        let html = full_report().html();
        assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
        for forbidden in
            ["<script", "http:", "https:", "<link", "url(", "@import", "<why>", "<texel>", "<error>"]
        {
            assert!(!html.contains(forbidden), "{forbidden}");
        }
        // Two truths and their difference; one technique and two differences.
        assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 6);
        assert_eq!(html.matches("src=").count(), 6, "every picture is in the page");
        assert_eq!(html.matches("alt=\"").count(), 6, "every picture says what it is");
        for reference in html.split("href=\"").skip(1) {
            let address = reference.split('"').next().unwrap().strip_prefix('#').expect("within the page");
            assert_eq!(html.matches(&format!(" id=\"{address}\"")).count(), 1, "{address}");
        }
    }

    #[test]
    fn the_page_has_its_plots_its_tables_and_its_grid_in_words() {
        let html = full_report().html();
        assert_eq!(html.matches("<svg ").count(), 2);
        for word in [
            "<th class=\"group\" colspan=\"9\" scope=\"rowgroup\"><span>nave</span>",
            "<td class=\"dim\">not reached</td>",
            "<summary>All settings</summary>",
            "class=\"ok\"",
            ">unsupported<",
            ">FAIL<",
            "FAIL c on maps: 1x1 &lt;texel&gt;: a NaN",
            "<p class=\"summary bad\">Stress matrix: 1 rows, 3 cells",
            "<dt>level</dt><dd>game</dd>",
            "2026-01-02",
        ] {
            assert!(html.contains(word), "{word}: {html}");
        }
    }

    /// Tags that have no end.
    const EMPTY_TAGS: [&str; 2] = ["meta", "img"];

    #[test]
    fn every_tag_that_opens_closes_in_its_place() {
        let html = full_report().html();
        let mut open: Vec<&str> = Vec::new();
        for tag in html.split('<').skip(1).filter_map(|rest| rest.split_once('>')).map(|(tag, _)| tag) {
            let name = tag.split_whitespace().next().unwrap_or("");
            match name.strip_prefix('/') {
                Some(name) => assert_eq!(open.pop(), Some(name)),
                None if name.starts_with('!') || tag.ends_with('/') || EMPTY_TAGS.contains(&name) => {}
                None => open.push(name),
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn sections_stand_in_the_order_of_the_links_above_them() {
        let html = full_report().html();
        let headings: Vec<&str> =
            html.split("<h2 ").skip(1).filter_map(|rest| rest.split(['>', '<']).nth(1)).collect();
        let expected = [TABLE, "Text &amp; more", PICTURES, "Speed and accuracy", "Stress matrix", SETTINGS];
        assert_eq!(headings, expected);
        let links = html.split("<nav>").nth(1).and_then(|rest| rest.split("</nav>").next()).unwrap();
        let links: Vec<&str> =
            links.split("<a ").skip(1).filter_map(|rest| rest.split(['>', '<']).nth(1)).collect();
        assert_eq!(links, expected);
    }

    #[test]
    fn a_failure_is_in_the_summary_in_the_table_and_spelled_out() {
        let mut report = report();
        let mut failed = row("raymarch", "nave");
        failed.verdict = Some(Verdict::Fail(vec!["1 < 2".into()]));
        report.rows.push(failed);
        let html = report.html();
        assert!(html.contains("<p class=\"summary bad\">2 rows on 1 shot: 1 out of tolerance"), "{html}");
        assert!(html.contains("<tr class=\"wrong\">") && html.contains("<td class=\"name bad\">FAIL</td>"));
        assert!(html.contains("FAIL raymarch on nave: 1 &lt; 2"));
    }

    #[test]
    fn a_technique_without_a_picture_says_why() {
        let mut report = report();
        let mut refused = row("slices", "nave");
        refused.verdict = Some(Verdict::Unsupported("an orthographic camera".into()));
        let image = RadianceImage { size: [3, 2], pixels: vec![[1.0; 3]; 6] };
        let pictures = Pictures {
            shot: "dome".into(),
            shadow_map_truth: image.clone(),
            raycast_truth: image,
            techniques: Vec::new(),
        };
        report.add(&[refused], &pictures);
        assert!(report.html().contains("slices: unsupported: an orthographic camera</p>"));
    }

    #[test]
    fn text_is_escaped() {
        let html = report().html();
        assert!(html.contains("--shot &lt;a&amp;b&gt;") && !html.contains("<a&b>"));
    }
}
