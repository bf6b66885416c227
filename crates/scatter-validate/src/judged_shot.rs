//! A staged shot beside its truths: what an image of it is held against.
//!
//! [`MapJudgedShot`] knows shadow-map truth, a technique's own error; [`JudgedShot`] knows ray-cast truth too, and with it
//! the shadow map's error. Truths are rendered once, when the shot is judged or staged anew.

use scatter_core::{Camera, Light};
use scatter_scene::MapResolution;

use crate::figures::{Figures, Labelled, compare};
use crate::judge_error::JudgeError;
use crate::measure::Measurement;
use crate::row::Errors;
use crate::staged_shot::{StageError, StagedShot};
use crate::truths::{RAYCAST_TRUTH, SHADOW_MAP_TRUTH, raycast_truth, shadow_map_truth};

/// A staged shot with the exact image for its shadow maps.
#[derive(Debug)]
pub struct MapJudgedShot {
    shot: StagedShot,
    truth: Measurement,
}

/// A staged shot with both truths.
#[derive(Debug)]
pub struct JudgedShot {
    by_map: MapJudgedShot,
    raycast: Measurement,
}

impl MapJudgedShot {
    /// Renders shadow-map truth.
    pub fn new(shot: StagedShot) -> Result<Self, StageError> {
        let truth = shadow_map_truth(&shot)?;
        Ok(Self { shot, truth })
    }

    /// Moves camera and lights and makes maps anew ([`StagedShot::restage`]), and truth with them.
    pub fn restage(
        &mut self,
        camera: Camera,
        lights: &[Light],
        resolution: impl Into<MapResolution>,
    ) -> Result<(), StageError> {
        self.shot.restage(camera, lights, resolution)?;
        self.truth = shadow_map_truth(&self.shot)?;
        Ok(())
    }

    /// The shot.
    pub fn shot(&self) -> &StagedShot {
        &self.shot
    }

    /// The exact image for the shadow maps.
    pub fn truth(&self) -> &Measurement {
        &self.truth
    }

    /// The error figures of an image of the shot against shadow-map truth.
    pub fn figures(&self, image: &Measurement) -> Result<Figures, JudgeError> {
        against(&self.shot, &self.truth, image)
    }
}

impl JudgedShot {
    /// Renders both truths; `progress` is told the id of each before.
    pub fn new(shot: StagedShot, progress: &mut dyn FnMut(&str)) -> Result<Self, StageError> {
        progress(SHADOW_MAP_TRUTH);
        let by_map = MapJudgedShot::new(shot)?;
        progress(RAYCAST_TRUTH);
        let raycast = raycast_truth(by_map.shot())?;
        Ok(Self { by_map, raycast })
    }

    /// The shot.
    pub fn shot(&self) -> &StagedShot {
        self.by_map.shot()
    }

    /// The shot beside shadow-map truth alone.
    pub fn by_map(&self) -> &MapJudgedShot {
        &self.by_map
    }

    /// The exact image for the shadow maps.
    pub fn map_truth(&self) -> &Measurement {
        self.by_map.truth()
    }

    /// The exact image for the triangles.
    pub fn raycast_truth(&self) -> &Measurement {
        &self.raycast
    }

    /// Shadow-map truth and ray-cast truth, when everything is judged.
    pub fn into_truths(self) -> [Measurement; 2] {
        [self.by_map.truth, self.raycast]
    }

    /// The error figures of an image of the shot against both truths; of one of the truths against the other alone.
    pub fn errors(&self, image: &Measurement) -> Result<Errors, JudgeError> {
        // By identity: an image that is merely named like a truth is refused by the comparison.
        let beside = |truth: &Measurement| {
            let is_other = !std::ptr::eq(truth, image);
            is_other.then(|| against(self.shot(), truth, image)).transpose()
        };
        let (shadow_map, raycast) = (beside(self.map_truth())?, beside(&self.raycast)?);
        Ok(Errors { shadow_map, raycast, height_field: None })
    }

    /// The shadow map's own error: shadow-map truth against ray-cast truth.
    pub fn map_error(&self) -> Result<Figures, JudgeError> {
        self.raycast_figures(self.map_truth())
    }

    /// The error figures of an image of the shot against ray-cast truth.
    pub fn raycast_figures(&self, image: &Measurement) -> Result<Figures, JudgeError> {
        against(self.shot(), &self.raycast, image)
    }
}

/// The error figures of one image of a shot against another.
pub fn against(
    shot: &StagedShot,
    reference: &Measurement,
    test: &Measurement,
) -> Result<Figures, JudgeError> {
    compare(labelled(reference), labelled(test), None)
        .map_err(|source| JudgeError::Compare { shot: shot.name().to_string(), source })
}

fn labelled(measurement: &Measurement) -> Labelled<'_> {
    let Measurement { method, image, .. } = measurement;
    Labelled { label: method, size: image.size, pixels: &image.pixels }
}
