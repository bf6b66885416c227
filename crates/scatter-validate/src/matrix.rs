//! The technique × shot matrix, a shot at a time: maps once, both truths once, then each technique at its level.

use scatter_core::{Quality, Target, Technique};
use scatter_scene::{RadianceImage, Shot};

use crate::baseline::Baseline;
use crate::judge_error::JudgeError;
use crate::judged_shot::{JudgedShot, against};
use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::options::at_level;
use crate::planned::{AUTO, Planner, measure_planned};
use crate::row::{Errors, Row, TwinDistance, Verdict};
use crate::settings::{Options, Settings, pairs};
use crate::staged_shot::StagedShot;
use crate::step_search::reaches;
use crate::tolerance::Tolerances;

/// What the matrix holds for every shot.
pub struct Matrix<'a> {
    /// The techniques, a row a shot each.
    pub techniques: Vec<&'a dyn Technique>,
    /// Whether shadow-map truth gets a row: the shadow map's own error, against ray-cast truth.
    pub map_row: bool,
    /// Whether ray-cast truth gets a row: for its time.
    pub raycast_row: bool,
    /// Whose time at the same level the others' times are divided into; it runs at the cheapest setting that
    /// reaches the level.
    pub baseline: Option<Baseline<'a>>,
    /// Who chooses a technique a shot for a further row, `auto`.
    pub planner: Option<&'a dyn Planner>,
    /// Techniques that run on other hardware what another one runs on the CPU: their distance from it is measured, too.
    pub twins: Vec<Twin<'a>>,
    /// Ids of techniques whose hardware a software driver stands for: their times are shown in brackets and enter no ratio.
    pub emulated: Vec<&'a str>,
    /// How the techniques are run.
    pub settings: Settings,
    /// What they must keep.
    pub tolerances: Tolerances,
}

/// A technique on other hardware and what it is the twin of.
#[derive(Clone, Copy)]
pub struct Twin<'a> {
    /// Its id.
    pub id: &'a str,
    /// The CPU's technique.
    pub of: &'a dyn Technique,
}

/// What one shot gave.
#[derive(Debug)]
pub struct ShotResult {
    /// Its rows.
    pub rows: Vec<Row>,
    /// Its images.
    pub pictures: Pictures,
}

/// The images of one shot.
#[derive(Debug)]
pub struct Pictures {
    /// The shot's name.
    pub shot: String,
    /// The exact image for the shadow map.
    pub shadow_map_truth: RadianceImage,
    /// The exact image for the triangles.
    pub raycast_truth: RadianceImage,
    /// Each technique's id and image, in the order of the rows.
    pub techniques: Vec<(String, RadianceImage)>,
}

/// An image that another program made of a shot.
#[derive(Debug, Clone)]
pub struct ForeignImage {
    /// What it is called in tables.
    pub label: String,
    /// In-scattered radiance, as a technique gives it.
    pub image: RadianceImage,
}

/// Rows and images of one shot so far.
#[derive(Debug, Default)]
struct Collected {
    rows: Vec<Row>,
    images: Vec<(String, RadianceImage)>,
}

impl Matrix<'_> {
    /// Measures every technique on one shot. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<ShotResult, JudgeError> {
        self.run_beside(shot, &[], progress)
    }

    /// As [`Self::run`], with a row for each image that another program made of this shot.
    pub fn run_beside(
        &self,
        shot: Shot,
        images: &[ForeignImage],
        progress: &mut dyn FnMut(&str),
    ) -> Result<ShotResult, JudgeError> {
        let judged = self.judged(shot, progress)?;
        let mut collected = Collected::default();
        self.add_truths(&judged, &mut collected)?;
        self.add_foreign(&judged, images, &mut collected)?;
        self.add_techniques(&judged, &mut collected, progress)?;
        self.add_planned(&judged, &mut collected, progress)?;
        collected.rows.iter_mut().for_each(|row| row.emulated = self.emulated.contains(&row.method.as_str()));
        self.fill_ratios(&judged, &mut collected, progress)?;
        self.fill_raycast_map_times(&judged, &mut collected, progress)?;
        Ok(collected.with_truths(judged))
    }

    /// Stages the shot and renders both truths.
    fn judged(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<JudgedShot, JudgeError> {
        let name = shot.name.clone();
        progress(&format!("{name}: maps"));
        let shot = StagedShot::with_source(shot, self.settings.resolution, self.settings.raster.as_ref())?;
        Ok(JudgedShot::new(shot, &mut |truth| progress(&format!("{name}: {truth}")))?)
    }

    /// The truths' own rows, each against the other.
    fn add_truths(&self, judged: &JudgedShot, to: &mut Collected) -> Result<(), JudgeError> {
        let truths = [(self.map_row, judged.map_truth()), (self.raycast_row, judged.raycast_truth())];
        for (_, truth) in truths.into_iter().filter(|(is_wanted, _)| *is_wanted) {
            let mut row = Row::new(judged.shot(), truth, &self.settings, judged.errors(truth)?);
            row.verdict = Some(self.verdict(&row));
            to.rows.push(row);
        }
        Ok(())
    }

    /// A row an image that another program made. It is graded and not judged: limits are for techniques of ours.
    fn add_foreign(
        &self,
        judged: &JudgedShot,
        images: &[ForeignImage],
        to: &mut Collected,
    ) -> Result<(), JudgeError> {
        for ForeignImage { label, image } in images {
            let measurement = Measurement { image: image.clone(), ..Measurement::nothing(label, image.size) };
            let errors = judged.errors(&measurement)?;
            let mut row = Row::new(judged.shot(), &measurement, &self.settings, errors);
            let twin = [judged.map_truth(), judged.raycast_truth()]
                .into_iter()
                .find(|truth| truth.image.pixels == image.pixels);
            row.note = Some(match twin {
                Some(truth) => format!("identical to {}", truth.method),
                None => level_reached(errors),
            });
            to.push(row, measurement);
        }
        Ok(())
    }

    /// A row a technique at its level.
    fn add_techniques(
        &self,
        judged: &JudgedShot,
        to: &mut Collected,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), JudgeError> {
        let shot = judged.shot();
        for &technique in &self.techniques {
            let id = technique.info().id;
            progress(&format!("{}: {id}", shot.name()));
            let options = self.options_of(technique, judged)?;
            let measurement = match self.measured(technique, &options, shot)? {
                Outcome::Measured(measurement) => *measurement,
                Outcome::Unsupported(unsupported) => {
                    to.rows.push(self.unsupported_row(shot, id, &unsupported.reason));
                    continue;
                }
            };
            let mut row = Row::new(shot, &measurement, &self.settings, judged.errors(&measurement)?);
            let target = Target::Quality(self.settings.quality);
            row.options = Renderer::resolved(technique, target, &pairs(&options), shot)??;
            row.overrides = options.into_iter().collect();
            row.level = Some(self.settings.quality.to_string());
            row.twin = self.twin_distance(&row, &measurement, shot)?;
            row.verdict = Some(self.verdict(&row));
            to.push(row, measurement);
        }
        Ok(())
    }

    /// How far a twin's image is from that of its technique with the values of the options that both have; `None` where a
    /// technique is nobody's twin, or the CPU's does not take the shot or the values.
    fn twin_distance(
        &self,
        row: &Row,
        measurement: &Measurement,
        shot: &StagedShot,
    ) -> Result<Option<TwinDistance>, JudgeError> {
        let Some(twin) = self.twins.iter().find(|twin| twin.id == row.method) else { return Ok(None) };
        let options: Vec<(&str, &str)> = row
            .options
            .iter()
            .filter(|(key, _)| twin.of.info().option(key).is_ok())
            .map(|(key, value)| (key.as_str(), value.as_str()))
            .collect();
        let target = Target::Quality(self.settings.quality);
        let Ok(mut renderer) = Renderer::configured(twin.of, target, &options, shot)? else {
            return Ok(None);
        };
        let Outcome::Measured(of) = measure(shot, &mut renderer, 1)? else { return Ok(None) };
        let figures = against(shot, &of, measurement)?;
        Ok(Some(TwinDistance { method: of.method, figures }))
    }

    /// A row of what the planner chooses. Its image is that of the technique that it names.
    fn add_planned(
        &self,
        judged: &JudgedShot,
        to: &mut Collected,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), JudgeError> {
        let Some(planner) = self.planner else { return Ok(()) };
        let shot = judged.shot();
        progress(&format!("{}: {AUTO}", shot.name()));
        let (measurement, choice) = match measure_planned(shot, planner, self.settings.repeat) {
            Err(JudgeError::Plan { reason, .. }) => {
                to.rows.push(self.unsupported_row(shot, AUTO, &reason));
                return Ok(());
            }
            planned => planned?,
        };
        let mut row = Row::new(shot, &measurement, &self.settings, judged.errors(&measurement)?);
        (row.method, row.requested) = (choice.method, Some(AUTO.into()));
        (row.options, row.overrides) = (choice.options, choice.overrides);
        row.level = Some(self.settings.quality.to_string());
        row.verdict = Some(self.verdict(&row));
        to.rows.push(row);
        Ok(())
    }

    /// The baseline's time at the level over each technique's. The baseline is run for its time alone where it has no
    /// row of its own.
    fn fill_ratios(
        &self,
        judged: &JudgedShot,
        to: &mut Collected,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), JudgeError> {
        let Some(baseline) = self.baseline else { return Ok(()) };
        let is_timed = |row: &&Row| row.level.is_some() && row.total_ms() > 0.0 && !row.emulated;
        let is_own = |row: &&Row| row.requested.is_none() && baseline.is(&row.method);
        let own_row = to.rows.iter().filter(is_timed).rfind(is_own);
        let mut baseline_ms = own_row.map(Row::total_ms);
        if baseline_ms.is_none() && !to.images.is_empty() {
            let (technique, shot) = (baseline.technique, judged.shot());
            progress(&format!("{}: {} for its time", shot.name(), technique.info().id));
            let options = self.options_of(technique, judged)?;
            if let Outcome::Measured(measurement) = self.measured(technique, &options, shot)? {
                baseline_ms = measurement.total_ms();
            }
        }
        for row in to.rows.iter_mut().filter(|row| is_timed(&&**row)) {
            row.ratio = baseline_ms.map(|time| time / row.total_ms());
        }
        Ok(())
    }

    /// What the maps would have taken by ray casts, where something else made them.
    fn fill_raycast_map_times(
        &self,
        judged: &JudgedShot,
        to: &mut Collected,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), JudgeError> {
        if self.settings.raster.is_some() {
            progress(&format!("{}: maps by ray casts, for their time", judged.shot().name()));
        }
        let raycast_maps_ms = judged.shot().raycast_maps_ms()?;
        to.rows.iter_mut().for_each(|row| row.raycast_maps_ms = raycast_maps_ms);
        Ok(())
    }

    fn measured(
        &self,
        technique: &dyn Technique,
        options: &[(String, String)],
        shot: &StagedShot,
    ) -> Result<Outcome, JudgeError> {
        let target = Target::Quality(self.settings.quality);
        let mut renderer = Renderer::configured(technique, target, &pairs(options), shot)??;
        Ok(measure(shot, &mut renderer, self.settings.repeat)?)
    }

    /// The options by hand, and the baseline's cheapest step count where it is not given by hand.
    fn options_of(&self, technique: &dyn Technique, judged: &JudgedShot) -> Result<Options, JudgeError> {
        let level = (&self.settings, self.settings.quality);
        at_level(technique, self.baseline.as_ref(), level, judged.by_map())
    }

    fn verdict(&self, row: &Row) -> Verdict {
        let mut reasons = Vec::new();
        let mut missed = None;
        for (truth, figures) in [("shadow_map", row.errors.shadow_map), ("raycast", row.errors.raycast)] {
            let Some(figures) = figures else { continue };
            if figures.non_finite > 0 {
                reasons.push(format!("{} values are not finite", figures.non_finite));
            }
            if figures.reference_non_finite > 0 {
                reasons
                    .push(format!("{} values of {truth} truth are not finite", figures.reference_non_finite));
            }
        }
        // Only the technique's own error is held against its level; the map's error is not its fault.
        if let (Some(level), Some(figures)) = (&row.level, &row.errors.shadow_map) {
            let error = self.settings.quality.error();
            if !reaches(figures, error) {
                let what = format!(
                    "misses {level}: p99 {:.3e} and rel_rmse {:.3e}, both at most {error}",
                    figures.p99, figures.rel_rmse
                );
                match self.tolerances.known_miss(row) {
                    Some(reason) => missed = Some(format!("{what}; {reason}")),
                    None => reasons.push(what),
                }
            }
        }
        reasons.extend(self.tolerances.violations(row));
        reasons.dedup();
        match missed {
            _ if !reasons.is_empty() => Verdict::Fail(reasons),
            Some(what) => Verdict::Misses(what),
            None => Verdict::Ok,
        }
    }

    fn unsupported_row(&self, shot: &StagedShot, id: &str, reason: &str) -> Row {
        let nothing = Measurement::nothing(id, shot.camera().size());
        let mut row = Row::new(shot, &nothing, &self.settings, Errors::default());
        row.level = Some(self.settings.quality.to_string());
        row.verdict = Some(Verdict::Unsupported(reason.to_string()));
        row
    }
}

impl Collected {
    fn push(&mut self, row: Row, measurement: Measurement) {
        self.rows.push(row);
        self.images.push((measurement.method, measurement.image));
    }

    fn with_truths(self, judged: JudgedShot) -> ShotResult {
        let shot = judged.shot().name().to_string();
        let [shadow_map_truth, raycast_truth] = judged.into_truths().map(|truth| truth.image);
        let pictures = Pictures { shot, shadow_map_truth, raycast_truth, techniques: self.images };
        ShotResult { rows: self.rows, pictures }
    }
}

/// The finest quality level that an image reaches against the nearer one of the truths: whoever made it may have traced
/// triangles or read a map.
fn level_reached(errors: Errors) -> String {
    let reached = [Quality::Film, Quality::Game, Quality::Preview].into_iter().find(|level| {
        [errors.shadow_map, errors.raycast].into_iter().flatten().any(|f| reaches(&f, level.error()))
    });
    reached.map_or_else(|| format!("misses {}", Quality::Preview), |level| format!("reaches {level}"))
}
