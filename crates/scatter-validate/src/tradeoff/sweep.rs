//! Climbs the settings of every technique on one shot: time against error.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use scatter_core::{Quality, ScatterImage, Target, Technique};
use scatter_scene::Shot;

use super::setting::{Setting, Source, ladder};
use super::trade::{Rung, ShotTrade};
use crate::baseline::Baseline;
use crate::judge_error::JudgeError;
use crate::judged_shot::JudgedShot;
use crate::measure::{Measurement, Outcome, Renderer, measure, timed};
use crate::row::{Errors, Row, Verdict};
use crate::settings::{Settings, pairs};
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

/// A technique with the settings to try.
type Planned<'a> = (&'a dyn Technique, Vec<Setting>);

impl Sweep<'_> {
    /// Measures every setting of every technique on one shot. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<ShotTrade, JudgeError> {
        progress(&format!("{}: maps", shot.name));
        let shot = StagedShot::with_source(shot, self.settings.resolution, self.settings.raster.as_ref())?;
        progress(&format!("{}: truths", shot.name()));
        let judged = JudgedShot::new(shot, &mut |_| {})?;
        let map_error = judged.map_error()?;
        let mut rungs = Vec::new();
        for (technique, settings) in self.plan(&judged, progress)? {
            let mut climb =
                Climb { sweep: self, judged: &judged, technique, seen: Vec::new(), rungs: &mut rungs };
            let mut ended = None;
            for setting in settings {
                // A source's finer settings are left out, not those of another source, nor what others are divided into.
                if ended == Some(setting.source) && setting.source != Source::Search {
                    continue;
                }
                progress(&format!("{}: {} {setting}", judged.shot().name(), technique.info().id));
                match climb.measure(&setting)? {
                    Step::On => {}
                    Step::End => ended = Some(setting.source),
                    Step::Unsupported => break,
                }
            }
        }
        let baseline = self.baseline.map(|baseline| baseline.technique.info().id);
        Ok(ShotTrade::new(judged.shot().name().into(), map_error, rungs, baseline))
    }

    /// Each technique with its settings; the baseline comes first.
    fn plan(
        &self,
        judged: &JudgedShot,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Vec<Planned<'_>>, JudgeError> {
        let mut plan: Vec<Planned<'_>> = Vec::new();
        if let Some(baseline) = self.baseline {
            let by_hand = self.settings.by_hand(baseline.technique);
            progress(&format!("{}: cheapest {}", judged.shot().name(), baseline.technique.info().id));
            let mut settings = searched(&baseline, &by_hand, judged)?;
            if self.techniques.iter().any(|technique| baseline.is(technique.info().id)) {
                settings.extend(ladder(baseline.technique, &by_hand));
            }
            plan.push((baseline.technique, settings));
        }
        for &technique in &self.techniques {
            if plan.iter().all(|(planned, _)| planned.info().id != technique.info().id) {
                plan.push((technique, ladder(technique, &self.settings.by_hand(technique))));
            }
        }
        Ok(plan)
    }
}

/// The baseline's cheapest settings for the levels; none where its knob is set by hand.
fn searched(
    baseline: &Baseline<'_>,
    by_hand: &[(String, String)],
    judged: &JudgedShot,
) -> Result<Vec<Setting>, JudgeError> {
    if by_hand.iter().any(|(key, _)| key == baseline.knob) {
        return Ok(Vec::new());
    }
    let found = baseline.cheapest(Quality::ALL, judged.by_map(), &pairs(by_hand))?;
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
    judged: &'c JudgedShot,
    technique: &'c dyn Technique,
    /// What each rung did, with its index: equal settings are found by what they do.
    seen: Vec<(u64, usize)>,
    rungs: &'c mut Vec<Rung>,
}

impl Climb<'_> {
    fn measure(&mut self, setting: &Setting) -> Result<Step, JudgeError> {
        let shot = self.judged.shot();
        let Settings { repeat, threads, .. } = self.sweep.settings;
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
                let nothing = Measurement::nothing(self.technique.info().id, shot.camera().size());
                let mut rung = self.rung(setting, &nothing, Errors::default())?;
                rung.row.verdict = Some(Verdict::Unsupported(unsupported.reason.into()));
                self.rungs.push(rung);
                return Ok(Step::Unsupported);
            }
        };
        let figures = self.judged.by_map().figures(&measurement)?;
        let frame_ms = measurement.total_ms().unwrap_or_default();
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
        let raycast = self.judged.raycast_figures(&measurement)?;
        let errors = Errors { shadow_map: Some(figures), raycast: Some(raycast), height_field: None };
        let mut rung = self.rung(setting, &measurement, errors)?;
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
    fn rung(&self, setting: &Setting, measurement: &Measurement, errors: Errors) -> Result<Rung, JudgeError> {
        let shot = self.judged.shot();
        let mut row = Row::new(shot, measurement, &self.sweep.settings, errors);
        row.options = Renderer::resolved(self.technique, setting.target, &pairs(&setting.overrides), shot)??;
        row.overrides = setting.overrides.iter().cloned().collect();
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
        Ok(Rung {
            row,
            setting: vec![setting.to_string()],
            time_ms_one_thread: BTreeMap::new(),
            front: false,
            reaches: reached,
        })
    }
}

/// Runs a job in a pool of one thread.
pub(super) fn on_one_thread<R: Send>(job: impl FnOnce() -> R + Send) -> Result<R, JudgeError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(JudgeError::Thread)?;
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
