//! The technique × shot matrix, a shot at a time: maps once, both truths once, then each technique at its level.

use scatter_core::{OptionError, Quality, Target, Technique, VolumetricShadow};
use scatter_scene::{RadianceImage, RasterDevice, RaycastTruth, Shot};

use raymarch_ref::ShadowMapWalk;

use crate::baseline::Baseline;
use crate::figures::{CompareError, Figures, Labelled, compare};
use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::options::{Options, at_level, pairs};
use crate::row::{Errors, Row, Verdict};
use crate::staged_shot::{StageError, StagedShot};
use crate::step_search::reaches;
use crate::tolerance::Tolerances;

/// Id of shadow-map truth.
pub const SHADOW_MAP_TRUTH: &str = "truth-shadow-map";
/// Id of ray-cast truth.
pub const RAYCAST_TRUTH: &str = "truth-raycast";

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
    /// How the techniques are run.
    pub settings: Settings,
    /// What they must keep.
    pub tolerances: Tolerances,
}

/// How techniques are run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The level that every technique is configured for.
    pub quality: Quality,
    /// Options by hand, over the level's choice; each technique takes those that it knows.
    pub overrides: Vec<(String, String)>,
    /// Texels along a side of the shadow map.
    pub map_size: u32,
    /// Draws the maps; rays make them where there is none.
    pub raster: Option<RasterDevice>,
    /// Timed runs.
    pub repeat: u32,
    /// Threads of the pool that all this runs in (for the rows).
    pub threads: usize,
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

/// A shot that could not be judged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// The shot makes no frame, or a technique gave up.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// An option that a technique does not take.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A baseline that cannot do a shot.
    #[error("{shot}: the baseline cannot do it: {reason}")]
    Baseline {
        /// The shot.
        shot: String,
        /// The assumption that the shot breaks.
        reason: String,
    },
    /// A pool of one thread that cannot be made.
    #[error("one thread cannot be started: {0}")]
    Thread(rayon::ThreadPoolBuildError),
    /// Images that cannot be compared.
    #[error("{shot}: {source}")]
    Compare {
        /// The shot.
        shot: String,
        /// Why not.
        source: CompareError,
    },
}

impl Matrix<'_> {
    /// Measures every technique on one shot. `progress` is told what comes next.
    pub fn run(&self, shot: Shot, progress: &mut dyn FnMut(&str)) -> Result<ShotResult, MatrixError> {
        self.run_beside(shot, &[], progress)
    }

    /// As [`Self::run`], with a row for each image that another program made of this shot.
    pub fn run_beside(
        &self,
        shot: Shot,
        images: &[ForeignImage],
        progress: &mut dyn FnMut(&str),
    ) -> Result<ShotResult, MatrixError> {
        progress(&format!("{}: maps", shot.name));
        let shot = StagedShot::with_source(shot, self.settings.map_size, self.settings.raster.as_ref())?;
        progress(&format!("{}: {SHADOW_MAP_TRUTH}", shot.name()));
        let map_truth = shadow_map_truth(&shot, 1)?;
        progress(&format!("{}: {RAYCAST_TRUTH}", shot.name()));
        let ray_truth = raycast_truth(&shot, 1)?;
        let mut rows = Vec::new();
        if self.map_row {
            let errors = Errors {
                shadow_map: None,
                raycast: Some(against(&shot, (RAYCAST_TRUTH, &ray_truth), (SHADOW_MAP_TRUTH, &map_truth))?),
            };
            let mut row = row(&shot, SHADOW_MAP_TRUTH, &map_truth, &self.settings, errors);
            row.verdict = Some(self.verdict(&row));
            rows.push(row);
        }
        if self.raycast_row {
            let errors = Errors {
                shadow_map: Some(against(
                    &shot,
                    (SHADOW_MAP_TRUTH, &map_truth),
                    (RAYCAST_TRUTH, &ray_truth),
                )?),
                raycast: None,
            };
            let mut row = row(&shot, RAYCAST_TRUTH, &ray_truth, &self.settings, errors);
            row.verdict = Some(self.verdict(&row));
            rows.push(row);
        }
        let mut techniques = Vec::new();
        for ForeignImage { label, image } in images {
            let measurement = Measurement { image: image.clone(), ..Measurement::nothing(image.size) };
            let errors = Errors {
                shadow_map: Some(against(&shot, (SHADOW_MAP_TRUTH, &map_truth), (label, &measurement))?),
                raycast: Some(against(&shot, (RAYCAST_TRUTH, &ray_truth), (label, &measurement))?),
            };
            let mut row = row(&shot, label, &measurement, &self.settings, errors);
            row.note = Some(if image.pixels == map_truth.image.pixels {
                format!("identical to {SHADOW_MAP_TRUTH}")
            } else if image.pixels == ray_truth.image.pixels {
                format!("identical to {RAYCAST_TRUTH}")
            } else {
                level_reached(errors)
            });
            // It is graded and not judged: limits are for techniques of ours.
            rows.push(row);
            techniques.push((label.clone(), measurement.image));
        }
        let mut baseline_ms = None;
        for &technique in &self.techniques {
            let id = technique.info().id;
            progress(&format!("{}: {id}", shot.name()));
            let options = self.options_of(technique, &shot, &map_truth)?;
            let measurement = match self.measured(technique, &options, &shot)? {
                Outcome::Measured(measurement) => measurement,
                Outcome::Unsupported(unsupported) => {
                    rows.push(self.unsupported_row(&shot, id, &unsupported.reason));
                    continue;
                }
            };
            let errors = Errors {
                shadow_map: Some(against(&shot, (SHADOW_MAP_TRUTH, &map_truth), (id, &measurement))?),
                raycast: Some(against(&shot, (RAYCAST_TRUTH, &ray_truth), (id, &measurement))?),
            };
            let mut row = row(&shot, id, &measurement, &self.settings, errors);
            row.options = options.into_iter().collect();
            row.level = Some(self.settings.quality.to_string());
            row.verdict = Some(self.verdict(&row));
            if self.is_baseline(id) {
                baseline_ms = Some(row.total_ms());
            }
            rows.push(row);
            techniques.push((id.to_string(), measurement.image));
        }
        // The baseline is run for its time alone where it has no row of its own.
        if baseline_ms.is_none()
            && let Some(Baseline { technique: baseline, .. }) = self.baseline
            && !techniques.is_empty()
        {
            progress(&format!("{}: {} for its time", shot.name(), baseline.info().id));
            let options = self.options_of(baseline, &shot, &map_truth)?;
            if let Outcome::Measured(measurement) = self.measured(baseline, &options, &shot)? {
                baseline_ms = measurement.time_ms.get("total").copied();
            }
        }
        for row in rows.iter_mut().filter(|row| row.level.is_some() && row.total_ms() > 0.0) {
            row.ratio = baseline_ms.map(|time| time / row.total_ms());
        }
        if self.settings.raster.is_some() {
            progress(&format!("{}: maps by ray casts, for their time", shot.name()));
        }
        let raycast_maps_ms = shot.raycast_maps_ms()?;
        for row in &mut rows {
            row.raycast_maps_ms = raycast_maps_ms;
        }
        let pictures = Pictures {
            shot: shot.name().to_string(),
            shadow_map_truth: map_truth.image,
            raycast_truth: ray_truth.image,
            techniques,
        };
        Ok(ShotResult { rows, pictures })
    }

    fn measured(
        &self,
        technique: &dyn Technique,
        options: &[(String, String)],
        shot: &StagedShot,
    ) -> Result<Outcome, MatrixError> {
        let target = Target::Quality(self.settings.quality);
        let mut renderer = Renderer::configured(technique, target, &pairs(options), shot)??;
        Ok(measure(shot, &mut renderer, self.settings.repeat)?)
    }

    /// The options by hand, and the baseline's cheapest step count where it is not given by hand.
    fn options_of(
        &self,
        technique: &dyn Technique,
        shot: &StagedShot,
        truth: &Measurement,
    ) -> Result<Options, MatrixError> {
        let level = (&self.settings, self.settings.quality);
        at_level(technique, self.baseline.as_ref(), level, (shot, truth))
    }

    fn is_baseline(&self, id: &str) -> bool {
        self.baseline.is_some_and(|baseline| baseline.technique.info().id == id)
    }

    fn verdict(&self, row: &Row) -> Verdict {
        let mut reasons = Vec::new();
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
                reasons.push(format!(
                    "misses {level}: p99 {:.3e} and rel_rmse {:.3e}, both at most {error}",
                    figures.p99, figures.rel_rmse
                ));
            }
        }
        reasons.extend(self.tolerances.violations(row));
        reasons.dedup();
        if reasons.is_empty() { Verdict::Ok } else { Verdict::Fail(reasons) }
    }

    fn unsupported_row(&self, shot: &StagedShot, id: &str, reason: &str) -> Row {
        let nothing = Measurement::nothing(shot.camera().size());
        let mut row = row(shot, id, &nothing, &self.settings, Errors::default());
        row.level = Some(self.settings.quality.to_string());
        row.verdict = Some(Verdict::Unsupported(reason.to_string()));
        row
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

/// The exact image for the shot's shadow maps.
pub fn shadow_map_truth(shot: &StagedShot, repeat: u32) -> Result<Measurement, StageError> {
    measured_reference(shot, &mut ShadowMapWalk::new(), repeat)
}

/// The exact image for the shot's triangles; needs no maps.
pub fn raycast_truth(shot: &StagedShot, repeat: u32) -> Result<Measurement, StageError> {
    measured_reference(shot, &mut RaycastTruth::new(shot.caster()), repeat)
}

/// References have no options and no level; one that cannot do a shot is an error.
pub fn measured_reference(
    shot: &StagedShot,
    reference: &mut dyn VolumetricShadow,
    repeat: u32,
) -> Result<Measurement, StageError> {
    let method = reference.id();
    match measure(shot, &mut Renderer::Shared(reference), repeat)? {
        Outcome::Measured(measurement) => Ok(*measurement),
        Outcome::Unsupported(unsupported) => {
            Err(StageError::Render { shot: shot.name().to_string(), method, source: unsupported.into() })
        }
    }
}

/// The error figures of one measurement against another.
pub fn against(
    shot: &StagedShot,
    (reference_label, reference): (&str, &Measurement),
    (label, test): (&str, &Measurement),
) -> Result<Figures, MatrixError> {
    let reference =
        Labelled { label: reference_label, size: reference.image.size, pixels: &reference.image.pixels };
    let test = Labelled { label, size: test.image.size, pixels: &test.image.pixels };
    compare(reference, test, None)
        .map_err(|source| MatrixError::Compare { shot: shot.name().to_string(), source })
}

/// A row without options, level, ratio and verdict.
pub fn row(
    shot: &StagedShot,
    method: &str,
    measurement: &Measurement,
    settings: &Settings,
    errors: Errors,
) -> Row {
    Row {
        shot: shot.name().to_string(),
        method: method.to_string(),
        options: Default::default(),
        size: measurement.image.size,
        shadow_map: settings.map_size,
        threads: settings.threads,
        time_ms: measurement.time_ms.clone(),
        maps_ms: shot.maps_ms(),
        raycast_maps_ms: None,
        memory_bytes: measurement.memory_bytes,
        counts: measurement.counts.clone(),
        modelled: measurement.modelled.clone(),
        errors,
        level: None,
        ratio: None,
        verdict: None,
        note: None,
    }
}
