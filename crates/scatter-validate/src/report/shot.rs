//! The report's pictures of one shot: the truths, then each technique's image with its signed differences to both.

use scatter_scene::{RadianceImage, encode_png};

use super::html::{Page, Tone};
use super::{base64, picture};
use crate::matrix::Pictures;
use crate::row::{Row, Verdict};
use crate::table::cells;
use crate::truths::{RAYCAST_TRUTH, SHADOW_MAP_TRUTH};

/// The pictures of one shot, as data URIs.
pub(super) struct ShotSection {
    /// The shot's name.
    pub shot: String,
    size: [u32; 2],
    entries: Vec<Entry>,
    /// What full red and full blue stand for, in radiance.
    scale: f64,
    /// Techniques without a picture, with the reason.
    without: Vec<String>,
}

/// One technique on one shot, or the two truths.
struct Entry {
    title: String,
    detail: String,
    tone: Tone,
    /// Caption and data URI.
    pictures: [(String, String); 3],
}

/// What the legend shows \[fraction of the truth's mean\].
const LEGEND: [f64; 9] = [-0.1, -0.05, -0.01, -0.001, 0.0, 0.001, 0.01, 0.05, 0.1];

impl ShotSection {
    /// Encodes the pictures, all with the exposure of ray-cast truth.
    pub(super) fn new(rows: &[Row], pictures: &Pictures) -> Self {
        let (map_truth, ray_truth) = (&pictures.shadow_map_truth, &pictures.raycast_truth);
        let exposure = picture::exposure(ray_truth);
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
        let without = rows.iter().filter_map(|row| match &row.verdict {
            Some(Verdict::Unsupported(reason)) => Some(format!("{}: unsupported: {reason}", row.method)),
            _ => None,
        });
        let without = without.collect();
        Self { shot: pictures.shot.clone(), size: map_truth.size, entries, scale, without }
    }

    /// Appends them to a page.
    pub(super) fn push(&self, page: &mut Page) {
        page.subheading(&self.shot);
        page.legend(LEGEND.map(|share| {
            let meaning = match share {
                0.0 => "equal".to_string(),
                _ => format!("{}{} %", if share > 0.0 { "+" } else { "−" }, 100.0 * share.abs()),
            };
            (picture::signed_colour(share / FULL_COLOUR), meaning)
        }));
        page.note(&format!(
            "Differences as shares of the truth's mean, {:.2e} W/(m²·sr): red is too bright, blue too dark.",
            self.scale / FULL_COLOUR
        ));
        for entry in &self.entries {
            let pictures = entry.pictures.iter().map(|(caption, uri)| (caption.as_str(), uri.as_str()));
            page.pictures((&entry.title, &entry.detail, entry.tone), self.size, pictures);
        }
        self.without.iter().for_each(|reason| page.note(reason));
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
    let options = row.overrides.iter().map(|(key, value)| format!("{key}={value}, ")).collect::<String>();
    format!(
        "{options}{} ms, rel_rmse {} %, p99 {} %, to the triangles {} %: {}",
        cells[2], cells[4], cells[5], cells[RAY_RMSE], cells[9]
    )
}

fn uri(size: [u32; 2], pixels: &[u8]) -> String {
    // Only pixels that do not fit their size fail to encode; the caption is still shown then.
    let png = encode_png(size, pixels).unwrap_or_default();
    format!("data:image/png;base64,{}", base64::encode(&png))
}

/// Where colours are full \[fraction of the truth's mean\]: what the coarsest quality level allows.
const FULL_COLOUR: f64 = 0.1;

/// The difference of the full colour, in radiance.
fn difference_scale(reference: &RadianceImage) -> f64 {
    let finite = || reference.pixels.iter().flatten().map(|&v| f64::from(v)).filter(|v| v.is_finite());
    let count = finite().count().max(1);
    FULL_COLOUR * finite().sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
