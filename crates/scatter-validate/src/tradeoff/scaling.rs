//! How a technique's time grows with resolution: image and shadow map scaled together (Baran et al. 2010, section 6:
//! slopes of log time against `log(s·r·d)/3`, s slices of r view rays and d light rays).
//!
//! Slices, rays a slice and light rays all grow with the side of image and map, so the abscissa is the cube root of
//! width × height × map side. A marcher that keeps its error under a finer map takes as many more steps: the baseline's
//! step count grows with the side. Others are configured for their level at each size.

use std::collections::BTreeMap;

use scatter_core::{Light, ScatterImage, Target, Technique};
use scatter_scene::{MapResolution, Shot};
use serde::Serialize;

use super::slope::Fit;
use super::sweep::on_one_thread;
use crate::baseline::Baseline;
use crate::judge_error::JudgeError;
use crate::judged_shot::MapJudgedShot;
use crate::measure::{Measurement, Outcome, Renderer, measure, timed};
use crate::options::at_level;
use crate::row::{Errors, Row, Verdict};
use crate::settings::{Options, Settings, pairs};
use crate::staged_shot::{StageError, StagedShot, resized};

/// Sides of image and map, of their full size, from the smallest on.
pub const SCALING_FACTORS: [f64; 5] =
    [0.25, 0.353_553_390_593_273_8, 0.5, std::f64::consts::FRAC_1_SQRT_2, 1.0];

/// What is measured on every shot.
pub struct Scaling<'a> {
    /// The techniques.
    pub techniques: Vec<&'a dyn Technique>,
    /// The one whose knob grows with the side; its value at full size is the cheapest that reaches the level.
    pub baseline: Option<Baseline<'a>>,
    /// How techniques are run. The quality is the level that they are configured for, the map size that of full size.
    pub settings: Settings,
}

/// One technique at one size.
#[derive(Debug, Clone, Serialize)]
pub struct ScalingRow {
    /// As `render --json` prints it.
    #[serde(flatten)]
    pub row: Row,
    /// As the row's `time_ms`, on one thread.
    pub time_ms_one_thread: BTreeMap<String, f64>,
    /// Cube root of width × height × map side.
    pub resolution: f64,
}

/// The growth of one technique's time on one shot, or on all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slope {
    /// The shot's name; none for all shots together (one slope, a height for each).
    pub shot: Option<String>,
    /// The technique's id.
    pub method: String,
    /// The fit; none with fewer than two sizes.
    pub fit: Option<Fit>,
}

impl Scaling<'_> {
    /// Measures all techniques on one shot at all sizes, the largest first. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<Vec<ScalingRow>, JudgeError> {
        let Settings { resolution: full_resolution, .. } = self.settings;
        progress(&format!("{}: maps", shot.name));
        let full = shot.camera.clone();
        let staged = StagedShot::with_source(shot, full_resolution, self.settings.raster.as_ref())?;
        let name = staged.name().to_string();
        let lights: Vec<Light> = staged.lights().map(|(light, _)| light.clone()).collect();
        let mut judged = MapJudgedShot::new(staged)?;
        let level = (&self.settings, self.settings.quality);
        let is_baseline = |technique: &dyn Technique| {
            self.baseline.is_some_and(|baseline| baseline.is(technique.info().id))
        };
        let mut at_full_size: Option<Options> = None;
        let mut rows = Vec::new();
        for factor in SCALING_FACTORS.into_iter().rev() {
            let [width, height] = full.size().map(|side| scaled(side, factor));
            if factor != 1.0 {
                progress(&format!("{name}: maps at {width}x{height}"));
                let camera = resized(&full, [width, height])
                    .map_err(|source| StageError::Model { shot: name.clone(), source })?;
                let side = scaled(full_resolution.side, factor);
                judged.restage(camera, &lights, MapResolution { side, ..full_resolution })?;
            }
            for &technique in &self.techniques {
                progress(&format!("{name}: {} at {width}x{height}", technique.info().id));
                let mut options = match &at_full_size {
                    Some(options) if is_baseline(technique) => Options::clone(options),
                    _ => at_level(technique, self.baseline.as_ref(), level, &judged)?,
                };
                if let Some(baseline) = self.baseline.filter(|_| is_baseline(technique)) {
                    at_full_size.get_or_insert_with(|| options.clone());
                    for (_, value) in options.iter_mut().filter(|(key, _)| key == baseline.knob) {
                        // What is no number is refused by the technique itself.
                        *value =
                            value.parse().map_or(value.clone(), |steps| scaled(steps, factor).to_string());
                    }
                }
                rows.push(self.row(technique, options, &judged)?);
            }
        }
        Ok(rows)
    }

    fn row(
        &self,
        technique: &dyn Technique,
        options: Options,
        judged: &MapJudgedShot,
    ) -> Result<ScalingRow, JudgeError> {
        let Settings { quality, repeat, threads, .. } = self.settings;
        let shot = judged.shot();
        let settings = Settings { resolution: shot.resolution(), ..self.settings.clone() };
        let [width, height] = shot.camera().size().map(f64::from);
        let resolution = (width * height * f64::from(shot.resolution().side)).cbrt();
        let mut renderer =
            Renderer::configured(technique, Target::Quality(quality), &pairs(&options), shot)??;
        let (measurement, errors, verdict) = match measure(shot, &mut renderer, 1)? {
            Outcome::Measured(measurement) => {
                let figures = judged.figures(&measurement)?;
                (*measurement, Errors { shadow_map: Some(figures), ..Errors::default() }, Verdict::Ok)
            }
            Outcome::Unsupported(unsupported) => {
                let nothing = Measurement::nothing(technique.info().id, shot.camera().size());
                (nothing, Errors::default(), Verdict::Unsupported(unsupported.reason.into()))
            }
        };
        let mut row = Row::new(shot, &measurement, &settings, errors);
        row.options = Renderer::resolved(technique, Target::Quality(quality), &pairs(&options), shot)??;
        row.overrides = options.into_iter().collect();
        row.level = Some(quality.to_string());
        let mut time_ms_one_thread = BTreeMap::new();
        if verdict == Verdict::Ok {
            let mut out = ScatterImage::new();
            row.time_ms = timed(shot, &mut renderer, 1..=repeat, &mut out)?;
            time_ms_one_thread = match threads {
                1 => row.time_ms.clone(),
                _ => on_one_thread(|| timed(shot, &mut renderer, repeat + 1..=2 * repeat, &mut out))??,
            };
        }
        row.verdict = Some(verdict);
        Ok(ScalingRow { row, time_ms_one_thread, resolution })
    }
}

impl ScalingRow {
    /// The point of the fit: resolution, and time on one thread \[ms\].
    pub fn point(&self) -> [f64; 2] {
        [self.resolution, self.time_ms_one_thread.get("total").copied().unwrap_or(f64::NAN)]
    }
}

/// The slope of each technique on each shot, then of each technique on all shots together.
pub fn slopes(rows: &[ScalingRow]) -> Vec<Slope> {
    let mut points: Vec<(&str, &str, Vec<[f64; 2]>)> = Vec::new();
    for row in rows {
        let (shot, method) = (row.row.shot.as_str(), row.row.method.as_str());
        match points.iter_mut().find(|(s, m, _)| (*s, *m) == (shot, method)) {
            Some((_, _, points)) => points.push(row.point()),
            None => points.push((shot, method, vec![row.point()])),
        }
    }
    let mut slopes: Vec<Slope> = points
        .iter()
        .map(|(shot, method, points)| Slope {
            shot: Some(shot.to_string()),
            method: method.to_string(),
            fit: Fit::of([&points[..]]),
        })
        .collect();
    let mut methods: Vec<&str> = points.iter().map(|(_, method, _)| *method).collect();
    let mut seen = Vec::new();
    methods.retain(|method| {
        !seen.contains(method) && {
            seen.push(method);
            true
        }
    });
    for method in methods {
        let groups = points.iter().filter(|(_, m, _)| *m == method).map(|(_, _, points)| &points[..]);
        slopes.push(Slope { shot: None, method: method.into(), fit: Fit::of(groups) });
    }
    slopes
}

fn scaled(count: u32, factor: f64) -> u32 {
    ((f64::from(count) * factor).round() as u32).max(1)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Rows of a technique whose time is `height·resolution^exponent`, on one thread.
    pub(in crate::tradeoff) fn rows(shot: &str, method: &str, height: f64, exponent: f64) -> Vec<ScalingRow> {
        let row = |factor: f64| {
            let resolution = 800.0 * factor;
            let time = height * factor.powf(exponent);
            ScalingRow {
                row: crate::row::tests::row(method, shot),
                time_ms_one_thread: BTreeMap::from([("total".to_string(), time)]),
                resolution,
            }
        };
        SCALING_FACTORS.map(row).to_vec()
    }

    #[test]
    fn sizes_are_evenly_spaced_in_the_logarithm() {
        for pair in SCALING_FACTORS.windows(2) {
            assert!((pair[1] / pair[0] - 2f64.sqrt()).abs() < 1e-12);
        }
        assert_eq!((scaled(640, 0.25), scaled(1, 0.25), scaled(3, 0.5)), (160, 1, 2));
    }

    #[test]
    fn each_shot_has_its_slope_and_all_shots_share_one() {
        let all =
            [rows("a", "march", 100.0, 3.0), rows("a", "slices", 9.0, 2.0), rows("b", "march", 5.0, 2.5)];
        let slopes = slopes(&all.concat());
        let of = |shot: Option<&str>, method: &str| {
            let found = slopes.iter().find(|slope| slope.shot.as_deref() == shot && slope.method == method);
            found.and_then(|slope| slope.fit).map(|fit| (1e6 * fit.slope).round() / 1e6)
        };
        assert_eq!(of(Some("a"), "march"), Some(3.0));
        assert_eq!(of(Some("b"), "march"), Some(2.5));
        assert_eq!(of(Some("a"), "slices"), Some(2.0));
        // The same abscissae in both shots: the shared slope is the mean.
        assert_eq!(of(None, "march"), Some(2.75));
        assert_eq!(slopes.len(), 5);
    }
}
