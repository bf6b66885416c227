//! Climbs the settings of every technique on one shot: time against error.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use scatter_core::{Quality, ScatterImage, Target, Technique};
use scatter_scene::Shot;
use serde::Serialize;

use super::pareto::on_front;
use super::setting::{Setting, Source, ladder};
use crate::baseline::Baseline;
use crate::figures::Figures;
use crate::matrix::{
    MatrixError, RAYCAST_TRUTH, SHADOW_MAP_TRUTH, Settings, against, raycast_truth, row, shadow_map_truth,
};
use crate::measure::{Measurement, Outcome, Renderer, measure, timed};
use crate::options::{by_hand, pairs};
use crate::row::{Errors, Row, Verdict};
use crate::staged_shot::StagedShot;
use crate::step_search::reaches;

/// What a sweep holds for every shot.
pub struct Sweep<'a> {
    /// The techniques.
    pub techniques: Vec<&'a dyn Technique>,
    /// Whose time at its own cheapest setting the others' times are divided into; always measured at the settings
    /// that reach the levels, and on its whole ladder if it is among the techniques.
    pub baseline: Option<Baseline<'a>>,
    /// How techniques are run; the quality does not matter.
    pub settings: Settings,
    /// Where climbing ends.
    pub limits: Limits,
}

/// Where climbing a technique's settings ends. The first setting beyond a limit is still measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Error \[fraction\] that nobody tells from none: finer settings only cost time.
    pub error: f64,
    /// Time of one frame on all threads \[ms\].
    pub frame_ms: f64,
}

impl Default for Limits {
    fn default() -> Self {
        // A tenth of the finest level; a frame of seconds is no choice for anybody who is in a hurry.
        Self { error: 0.001, frame_ms: 2_000.0 }
    }
}

/// One setting of one technique on one shot.
#[derive(Debug, Clone, Serialize)]
pub struct Rung {
    /// As `render --json` prints it; `level` is the finest that it reaches, `ratio` the baseline's time at that level
    /// over this one's, all threads.
    #[serde(flatten)]
    pub row: Row,
    /// What to ask for to get it; further names of the same thing follow.
    pub setting: Vec<String>,
    /// As the row's `time_ms`, on one thread.
    pub time_ms_one_thread: BTreeMap<String, f64>,
    /// Whether no setting of any technique is both faster (on one thread) and more exact on this shot.
    pub front: bool,
    #[serde(skip)]
    pub(super) reaches: Option<Quality>,
}

/// What a sweep found on one shot.
#[derive(Debug, Clone)]
pub struct ShotTrade {
    /// The shot's name.
    pub shot: String,
    /// The shadow map's own error: its truth against ray-cast truth.
    pub map_error: Figures,
    /// All settings, technique by technique.
    pub rungs: Vec<Rung>,
    /// The id of the baseline.
    pub baseline: Option<&'static str>,
}

/// A technique with the settings to try.
type Planned<'a> = (&'a dyn Technique, Vec<Setting>);

/// A shot with both truths.
struct Judge {
    shot: StagedShot,
    map_truth: Measurement,
    ray_truth: Measurement,
}

impl Sweep<'_> {
    /// Measures every setting of every technique on one shot. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<ShotTrade, MatrixError> {
        progress(&format!("{}: maps", shot.name));
        let shot = StagedShot::with_source(shot, self.settings.map_size, self.settings.raster.as_ref())?;
        progress(&format!("{}: truths", shot.name()));
        let (map_truth, ray_truth) = (shadow_map_truth(&shot, 1)?, raycast_truth(&shot, 1)?);
        let map_error = against(&shot, (RAYCAST_TRUTH, &ray_truth), (SHADOW_MAP_TRUTH, &map_truth))?;
        let judge = Judge { shot, map_truth, ray_truth };
        let mut rungs = Vec::new();
        for (technique, settings) in self.plan(&judge, progress)? {
            let mut climb =
                Climb { sweep: self, judge: &judge, technique, seen: Vec::new(), rungs: &mut rungs };
            let mut ended = None;
            for setting in settings {
                // A source's finer settings are left out, not those of another source, nor what others are divided into.
                if ended == Some(setting.source) && setting.source != Source::Search {
                    continue;
                }
                progress(&format!("{}: {} {setting}", judge.shot.name(), technique.info().id));
                match climb.measure(&setting)? {
                    Step::On => {}
                    Step::End => ended = Some(setting.source),
                    Step::Unsupported => break,
                }
            }
        }
        let baseline = self.baseline.map(|baseline| baseline.technique.info().id);
        let mut trade = ShotTrade { shot: judge.shot.name().into(), map_error, rungs, baseline };
        trade.mark_front();
        trade.fill_ratios();
        Ok(trade)
    }

    /// Each technique with its settings; the baseline comes first.
    fn plan(&self, judge: &Judge, progress: &mut dyn FnMut(&str)) -> Result<Vec<Planned<'_>>, MatrixError> {
        let mut plan: Vec<Planned<'_>> = Vec::new();
        if let Some(baseline) = self.baseline {
            let by_hand = by_hand(&self.settings, baseline.technique);
            progress(&format!("{}: cheapest {}", judge.shot.name(), baseline.technique.info().id));
            let mut settings = searched(&baseline, &by_hand, judge)?;
            if self.techniques.iter().any(|technique| technique.info().id == baseline.technique.info().id) {
                settings.extend(ladder(baseline.technique, &by_hand));
            }
            plan.push((baseline.technique, settings));
        }
        for &technique in &self.techniques {
            if plan.iter().all(|(planned, _)| planned.info().id != technique.info().id) {
                plan.push((technique, ladder(technique, &by_hand(&self.settings, technique))));
            }
        }
        Ok(plan)
    }
}

/// The baseline's cheapest settings for the levels; none where its knob is set by hand.
fn searched(
    baseline: &Baseline<'_>,
    by_hand: &[(String, String)],
    judge: &Judge,
) -> Result<Vec<Setting>, MatrixError> {
    if by_hand.iter().any(|(key, _)| key == baseline.knob) {
        return Ok(Vec::new());
    }
    let found = baseline.cheapest(Quality::ALL, &judge.shot, &judge.map_truth, &pairs(by_hand))?;
    let setting = |steps: u32| Setting {
        source: Source::Search,
        target: Target::Quality(Quality::default()),
        overrides: by_hand.iter().cloned().chain([(baseline.knob.into(), steps.to_string())]).collect(),
    };
    Ok(found.into_iter().flatten().map(setting).collect())
}

/// What a setting's measurement says about the next one.
enum Step {
    On,
    End,
    Unsupported,
}

/// One technique's way up on one shot.
struct Climb<'c> {
    sweep: &'c Sweep<'c>,
    judge: &'c Judge,
    technique: &'c dyn Technique,
    /// What each rung did, with its index: equal settings are found by what they do.
    seen: Vec<(u64, usize)>,
    rungs: &'c mut Vec<Rung>,
}

impl Climb<'_> {
    fn measure(&mut self, setting: &Setting) -> Result<Step, MatrixError> {
        let Judge { shot, map_truth, ray_truth } = self.judge;
        let Settings { repeat, threads, .. } = self.sweep.settings;
        let id = self.technique.info().id;
        let configured =
            Renderer::configured(self.technique, setting.target, &pairs(&setting.overrides), shot)?;
        let mut renderer = match configured {
            Ok(renderer) => renderer,
            // A promise that the technique cannot give is no rung; finer ones it cannot give either.
            // (Options by hand have been found good by then: levels are tried before promises.)
            Err(_) if setting.source == Source::Error => return Ok(Step::End),
            Err(error) => return Err(error.into()),
        };
        let measurement = match measure(shot, &mut renderer, 1)? {
            Outcome::Measured(measurement) => measurement,
            Outcome::Unsupported(unsupported) => {
                let nothing = Measurement::nothing(shot.camera().size());
                let mut rung = self.rung(setting, &nothing, Errors::default());
                rung.row.verdict = Some(Verdict::Unsupported(unsupported.reason.into()));
                self.rungs.push(rung);
                return Ok(Step::Unsupported);
            }
        };
        let figures = against(shot, (SHADOW_MAP_TRUTH, map_truth), (id, &measurement))?;
        let frame_ms = measurement.time_ms.get("total").copied().unwrap_or_default();
        let limits = self.sweep.limits;
        let is_last = reaches(&figures, limits.error) || frame_ms > limits.frame_ms;
        let step = if is_last { Step::End } else { Step::On };
        let print = fingerprint(&measurement);
        if let Some(&(_, twin)) = self.seen.iter().find(|(seen, _)| *seen == print) {
            let names = &mut self.rungs[twin].setting;
            let name = setting.to_string();
            if !names.contains(&name) {
                names.push(name);
            }
            return Ok(step);
        }
        let raycast = against(shot, (RAYCAST_TRUTH, ray_truth), (id, &measurement))?;
        let errors = Errors { shadow_map: Some(figures), raycast: Some(raycast) };
        let mut rung = self.rung(setting, &measurement, errors);
        let mut out = ScatterImage::new();
        // That run has warmed up; with --repeat 1 it is the one that counts.
        if repeat > 1 {
            rung.row.time_ms = timed(shot, &mut renderer, 1..=repeat, &mut out)?;
        }
        rung.time_ms_one_thread = if threads == 1 {
            rung.row.time_ms.clone()
        } else {
            on_one_thread(|| timed(shot, &mut renderer, repeat + 1..=2 * repeat, &mut out))??
        };
        self.seen.push((print, self.rungs.len()));
        self.rungs.push(rung);
        Ok(step)
    }

    /// A rung without times of its own, ratio and place on the front.
    fn rung(&self, setting: &Setting, measurement: &Measurement, errors: Errors) -> Rung {
        let (shot, settings) = (&self.judge.shot, &self.sweep.settings);
        let mut row = row(shot, self.technique.info().id, measurement, settings, errors);
        row.options = setting.overrides.iter().cloned().collect();
        let figures = errors.shadow_map;
        let reached = figures.and_then(|figures| {
            Quality::ALL.into_iter().rev().find(|level| reaches(&figures, level.error()))
        });
        row.level = reached.map(|level| level.to_string());
        row.verdict = Some(match figures {
            Some(figures) if figures.non_finite > 0 => {
                Verdict::Fail(vec![format!("{} values are not finite", figures.non_finite)])
            }
            _ => Verdict::Ok,
        });
        Rung {
            row,
            setting: vec![setting.to_string()],
            time_ms_one_thread: BTreeMap::new(),
            front: false,
            reaches: reached,
        }
    }
}

/// Runs a job in a pool of one thread.
pub(super) fn on_one_thread<R: Send>(job: impl FnOnce() -> R + Send) -> Result<R, MatrixError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(MatrixError::Thread)?;
    Ok(pool.install(job))
}

/// Everything that a run says but its time: two settings with the same are one.
fn fingerprint(measurement: &Measurement) -> u64 {
    let mut hasher = DefaultHasher::new();
    for value in measurement.image.pixels.iter().flatten() {
        value.to_bits().hash(&mut hasher);
    }
    measurement.counts.hash(&mut hasher);
    measurement.modelled.hash(&mut hasher);
    measurement.memory_bytes.hash(&mut hasher);
    measurement.time_ms.keys().for_each(|stage| stage.hash(&mut hasher));
    hasher.finish()
}

impl Rung {
    /// The larger of p99 and relative RMSE against shadow-map truth: what the quality levels limit.
    pub fn error(&self) -> f64 {
        self.row.errors.shadow_map.map_or(f64::NAN, |figures| match figures.non_finite {
            0 => figures.p99.max(figures.rel_rmse),
            _ => f64::NAN,
        })
    }

    /// Time of a frame on one thread \[ms\].
    pub fn one_thread_ms(&self) -> f64 {
        self.time_ms_one_thread.get("total").copied().unwrap_or(f64::NAN)
    }

    /// Whether it was measured: the technique can do the shot.
    pub fn is_measured(&self) -> bool {
        !self.time_ms_one_thread.is_empty()
    }

    /// Whether it reaches that level.
    pub fn reaches(&self, level: Quality) -> bool {
        self.reaches.is_some_and(|reached| reached >= level)
    }
}

impl ShotTrade {
    /// The ids of the techniques, in the order of their rungs.
    pub fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = Vec::new();
        for rung in &self.rungs {
            if !methods.contains(&rung.row.method.as_str()) {
                methods.push(&rung.row.method);
            }
        }
        methods
    }

    /// The fastest rung of a technique, on one thread, that reaches a level.
    pub fn cheapest(&self, method: &str, level: Quality) -> Option<&Rung> {
        let of_method = self.rungs.iter().filter(|rung| rung.row.method == method && rung.reaches(level));
        of_method.min_by(|a, b| a.one_thread_ms().total_cmp(&b.one_thread_ms()))
    }

    fn mark_front(&mut self) {
        let points: Vec<[f64; 2]> =
            self.rungs.iter().map(|rung| [rung.one_thread_ms(), rung.error()]).collect();
        for (rung, front) in self.rungs.iter_mut().zip(on_front(&points)) {
            rung.front = front;
        }
    }

    fn fill_ratios(&mut self) {
        let Some(baseline) = self.baseline else { return };
        let baseline_ms =
            Quality::ALL.map(|level| self.cheapest(baseline, level).map(|rung| rung.row.total_ms()));
        for rung in &mut self.rungs {
            let of_level = rung.reaches.and_then(|level| baseline_ms[level as usize]);
            rung.row.ratio = of_level.map(|time| time / rung.row.total_ms());
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::row::tests::{figures, row};

    /// A rung with that error and time on one thread; half of it on all threads.
    pub(crate) fn rung(method: &str, error: f64, one_thread_ms: f64) -> Rung {
        let mut row = row(method, "nave");
        row.errors.shadow_map = Some(figures(0.5 * error, error));
        row.errors.raycast = Some(figures(error, 3.0 * error));
        row.time_ms.insert("total".into(), 0.5 * one_thread_ms);
        let reaches = Quality::ALL.into_iter().rev().find(|level| error <= level.error());
        row.level = reaches.map(|level| level.to_string());
        let time_ms_one_thread = BTreeMap::from([("total".to_string(), one_thread_ms)]);
        let setting = vec![format!("e={error}")];
        Rung { row, setting, time_ms_one_thread, front: false, reaches }
    }

    /// The marcher at 40, 9, 2 and 0.5 %, and a technique that reaches film at once and another that never does.
    pub(crate) fn trade() -> ShotTrade {
        let march =
            [(0.4, 2.0), (0.09, 10.0), (0.02, 50.0), (0.005, 200.0)].map(|(e, t)| rung("march", e, t));
        let exact = [(0.004, 20.0), (0.001, 25.0)].map(|(e, t)| rung("exact", e, t));
        let rungs = march.into_iter().chain(exact).chain([rung("rough", 0.2, 1.0)]).collect();
        let mut trade =
            ShotTrade { shot: "nave".into(), map_error: figures(0.01, 0.3), rungs, baseline: Some("march") };
        trade.mark_front();
        trade.fill_ratios();
        trade
    }

    #[test]
    fn the_cheapest_rung_of_a_level_may_be_one_of_a_finer_level() {
        let trade = trade();
        let cheapest =
            |method, level| trade.cheapest(method, level).map(|rung| (rung.error(), rung.one_thread_ms()));
        assert_eq!(cheapest("exact", Quality::Preview), Some((0.004, 20.0)));
        assert_eq!(cheapest("march", Quality::Preview), Some((0.09, 10.0)));
        assert_eq!(cheapest("march", Quality::Film), Some((0.005, 200.0)));
        assert_eq!(cheapest("rough", Quality::Preview), None);
    }

    #[test]
    fn the_front_runs_over_all_techniques() {
        let front: Vec<bool> = trade().rungs.iter().map(|rung| rung.front).collect();
        assert_eq!(front, [false, true, false, false, true, true, true]);
    }

    #[test]
    fn the_ratio_is_that_of_the_level_that_is_reached() {
        let ratios: Vec<Option<f64>> = trade().rungs.iter().map(|rung| rung.row.ratio).collect();
        assert_eq!(ratios, [None, Some(1.0), Some(1.0), Some(1.0), Some(10.0), Some(8.0), None]);
    }

    #[test]
    fn a_rung_that_is_not_finite_has_no_error_to_compare() {
        let mut broken = rung("march", 0.001, 1.0);
        broken.row.errors.shadow_map.as_mut().unwrap().non_finite = 1;
        assert!(broken.error().is_nan());
    }
}
