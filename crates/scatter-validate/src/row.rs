//! One row of the matrix: what a technique did on a shot. Its JSON is that of `render --json` and of `validate`.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::figures::Figures;
use crate::machine::Machine;
use crate::measure::Measurement;
use crate::settings::Settings;
use crate::staged_shot::StagedShot;

/// What a technique did on a shot.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// The shot's name.
    pub shot: String,
    /// The technique's id.
    pub method: String,
    /// `auto` where a planner chose the technique.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub requested: Option<String>,
    /// Whether its times are a software driver's and not those of the hardware that it is made for.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub emulated: bool,
    /// The values of all options that it ran with; none for a reference.
    pub options: BTreeMap<String, String>,
    /// Those that were set by hand or searched for; the others follow from the level.
    pub overrides: BTreeMap<String, String>,
    /// `[width, height]` of the image.
    pub size: [u32; 2],
    /// Texels along a side of each shadow map.
    pub shadow_map: u32,
    /// How many cascades each sun has, of so many texels a side each; none where all lights have one map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cascades: Option<u32>,
    /// Threads of the pool.
    pub threads: usize,
    /// Time of the technique alone \[ms\]: `total` on the wall clock, and each stage.
    pub time_ms: BTreeMap<String, f64>,
    /// Time to make depth and shadow maps \[ms\].
    pub maps_ms: f64,
    /// Time of the same maps by ray casts \[ms\], where a Vulkan device drew them and both were timed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raycast_maps_ms: Option<f64>,
    /// Bytes that the technique holds between frames.
    pub memory_bytes: u64,
    /// Counts that do not depend on the machine.
    pub counts: BTreeMap<String, u64>,
    /// What was modelled.
    pub modelled: Vec<String>,
    /// Error figures against the truths that were asked for.
    pub errors: Errors,
    /// Of a technique on other hardware: its distance from the technique whose twin it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinDistance>,
    /// The quality level; none for a reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<String>,
    /// The marcher's time at the same level over this one's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratio: Option<f64>,
    /// `ok`, `FAIL: …`, `misses LEVEL: …` or `unsupported: …`; none where nothing was judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What is to be said instead of a verdict: the level that a foreign image reaches, or that it is identical.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// How far an image is from that of the same technique on the CPU, with the same options.
#[derive(Debug, Clone, Serialize)]
pub struct TwinDistance {
    /// The CPU's technique.
    pub method: String,
    /// Its image is the reference.
    #[serde(flatten)]
    pub figures: Figures,
}

/// Error figures against the truths.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Errors {
    /// Against shadow-map truth: the technique's own error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow_map: Option<Figures>,
    /// Against ray-cast truth: with the shadow map's error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raycast: Option<Figures>,
    /// Against height-field truth: the own error of a technique that interpolates the shadow map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_field: Option<Figures>,
}

/// The judgement on a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Within every limit.
    Ok,
    /// Out of tolerance: why, one sentence each.
    Fail(Vec<String>),
    /// Short of its quality level, which by its nature it is known to miss (`[[miss]]` in the tolerance file): by how much,
    /// and why.
    Misses(String),
    /// The technique said beforehand that it cannot do this shot.
    Unsupported(String),
}

/// Everything that `validate --json` prints.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    /// Where it ran.
    pub machine: &'a Machine,
    /// One row a shot and technique.
    pub rows: &'a [Row],
}

impl Row {
    /// The row of a measurement, without options, level, ratio and verdict.
    pub fn new(shot: &StagedShot, measurement: &Measurement, settings: &Settings, errors: Errors) -> Self {
        Self {
            shot: shot.name().to_string(),
            method: measurement.method.clone(),
            requested: None,
            emulated: false,
            options: Default::default(),
            overrides: Default::default(),
            size: measurement.image.size,
            shadow_map: settings.resolution.side,
            cascades: shot.cascades(),
            threads: settings.threads,
            time_ms: measurement.time_ms.clone(),
            maps_ms: shot.maps_ms(),
            raycast_maps_ms: None,
            memory_bytes: measurement.memory_bytes,
            counts: measurement.counts.clone(),
            modelled: measurement.modelled.clone(),
            errors,
            twin: None,
            level: None,
            ratio: None,
            verdict: None,
            note: None,
        }
    }

    /// Time of the technique alone \[ms\].
    pub fn total_ms(&self) -> f64 {
        self.time_ms.get("total").copied().unwrap_or(f64::NAN)
    }

    /// Whether the row is out of tolerance.
    pub fn has_failed(&self) -> bool {
        matches!(self.verdict, Some(Verdict::Fail(_)))
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ok => f.write_str("ok"),
            Self::Fail(reasons) => write!(f, "FAIL: {}", reasons.join("; ")),
            Self::Misses(what) => f.write_str(what),
            Self::Unsupported(reason) => write!(f, "unsupported: {reason}"),
        }
    }
}

impl Serialize for Verdict {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A row with nothing measured.
    pub(crate) fn row(method: &str, shot: &str) -> Row {
        Row {
            shot: shot.into(),
            method: method.into(),
            requested: None,
            emulated: false,
            options: BTreeMap::new(),
            overrides: BTreeMap::new(),
            size: [4, 3],
            shadow_map: 16,
            cascades: None,
            threads: 1,
            time_ms: BTreeMap::from([("total".into(), 2.5)]),
            maps_ms: 1.0,
            raycast_maps_ms: None,
            memory_bytes: 0,
            counts: BTreeMap::new(),
            modelled: Vec::new(),
            errors: Errors::default(),
            twin: None,
            level: None,
            ratio: None,
            verdict: None,
            note: None,
        }
    }

    /// Figures with these two and nothing else.
    pub(crate) fn figures(rel_rmse: f64, p99: f64) -> Figures {
        Figures {
            rel_rmse,
            p99,
            max: p99,
            p99_lit: p99,
            bias: 0.0,
            non_finite: 0,
            reference_non_finite: 0,
            reference_mean: 1.0,
            pixels: 12,
        }
    }

    #[test]
    fn the_json_has_the_documented_keys_in_their_order() {
        let mut row = row("m", "s");
        row.errors.shadow_map = Some(figures(0.1, 0.2));
        row.verdict = Some(Verdict::Fail(vec!["a".into(), "b".into()]));
        let json = serde_json::to_string(&row).unwrap();
        let start = r#"{"shot":"s","method":"m","options":{},"overrides":{},"size":[4,3],"shadow_map":16,"threads":1,"time_ms":{"total":2.5},"maps_ms":1.0,"memory_bytes":0,"counts":{},"modelled":[],"errors":{"shadow_map":{"rel_rmse":0.1,"p99":0.2,"#;
        assert!(json.starts_with(start), "{json}");
        assert!(json.ends_with(r#""verdict":"FAIL: a; b"}"#), "{json}");
        assert!(!json.contains("raycast"), "what was not measured is not there");
    }
}
