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
use crate::row::Row;
use html::{Page, escaped};
pub use picture::exposure;
pub use stress::{stress_grid, stress_page};
pub use tradeoff::TradeSection;

/// What a report says. Pictures become PNGs as they are added, so that no radiance image is held.
pub struct Report {
    machine: Machine,
    command_line: String,
    date: String,
    rows: Vec<Row>,
    shots: Vec<ShotSection>,
}

/// The pictures of one shot, as data URIs.
struct ShotSection {
    shot: String,
    figures: Vec<PictureEntry>,
    /// What full red and full blue stand for, in radiance.
    scale: f64,
}

struct PictureEntry {
    caption: String,
    uri: String,
}

impl Report {
    /// An empty report of a run on this machine.
    pub fn new(machine: Machine, command_line: String, date: String) -> Self {
        Self { machine, command_line, date, rows: Vec::new(), shots: Vec::new() }
    }

    /// Adds the rows and pictures of a shot.
    pub fn add(&mut self, rows: &[Row], pictures: &Pictures) {
        self.rows.extend_from_slice(rows);
        let reference = &pictures.shadow_map_truth;
        let exposure = exposure(&pictures.raycast_truth);
        let scale = difference_scale(reference);
        let mut figures = Vec::new();
        let mut push = |caption: String, size: [u32; 2], pixels: &[u8]| {
            // Only pixels that do not fit their size fail to encode; the caption is still shown then.
            let png = encode_png(size, pixels).unwrap_or_default();
            figures.push(PictureEntry {
                caption,
                uri: format!("data:image/png;base64,{}", base64::encode(&png)),
            });
        };
        let mut toned = |label: &str, image: &RadianceImage| {
            push(label.to_string(), image.size, &picture::tone_mapped(image, exposure));
        };
        toned(RAYCAST_TRUTH, &pictures.raycast_truth);
        toned(SHADOW_MAP_TRUTH, reference);
        for (method, image) in &pictures.techniques {
            toned(method, image);
        }
        let compared = pictures
            .techniques
            .iter()
            .map(|(method, image)| (method.as_str(), image, reference, SHADOW_MAP_TRUTH));
        let map_error = (SHADOW_MAP_TRUTH, reference, &pictures.raycast_truth, RAYCAST_TRUTH);
        for (method, image, truth, truth_label) in [map_error].into_iter().chain(compared) {
            let pixels = picture::signed_difference(truth, image, scale);
            push(format!("{method} − {truth_label}"), image.size, &pixels);
        }
        self.shots.push(ShotSection { shot: pictures.shot.clone(), figures, scale });
    }

    /// The page.
    pub fn html(&self) -> String {
        let mut page = Page::new("Scatter: validation report");
        self.push_settings(&mut page);
        self.push_table(&mut page);
        for shot in &self.shots {
            shot.push(&mut page);
        }
        page.finish()
    }

    fn push_settings(&self, page: &mut Page) {
        page.heading("Machine and settings");
        let settings = [
            ("date", &self.date),
            ("command line", &self.command_line),
            ("processor", &self.machine.cpu),
            ("cores", &self.machine.cores.to_string()),
            ("vector instructions", &self.machine.simd),
            ("system", &self.machine.os),
            ("compiler", &self.machine.rustc),
            ("scatter", &self.machine.version),
        ];
        page.definitions(settings.map(|(name, value)| (name, value.as_str())));
    }

    fn push_table(&self, page: &mut Page) {
        page.heading("Techniques × shots");
        page.paragraph(
            "Errors are relative to the truth's mean, against the exact image for the same shadow map (the \
             technique's own error); /ray against the exact image for the triangles (with the shadow map's error). \
             The ratio is the marcher's time at the same quality level over the technique's.",
        );
        page.preformatted(&crate::table::table(&self.rows));
    }
}

impl ShotSection {
    fn push(&self, page: &mut Page) {
        page.heading(&self.shot);
        page.paragraph(&format!(
            "Differences: red is too bright, blue too dark, white equal; full colour at ±{:.3e} (a tenth of the \
             truth's mean) and beyond; the scale follows the square root. Magenta is not a finite number.",
            self.scale
        ));
        page.legend(self.scale, picture::signed_colour);
        page.pictures(self.figures.iter().map(|figure| (escaped(&figure.caption), figure.uri.as_str())));
    }
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
        // Two truths, one technique, two differences.
        assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 5);
        assert_eq!(html.matches("alt=").count(), 5, "every picture says what it is");
    }

    #[test]
    fn text_is_escaped() {
        let html = report().html();
        assert!(html.contains("--shot &lt;a&amp;b&gt;") && !html.contains("<a&b>"));
    }
}
