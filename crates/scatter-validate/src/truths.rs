//! The truths of a staged shot, by their ids and as images: all exact, without options and without a level.

use raymarch_ref::{HEIGHT_FIELD_ID, HeightFieldWalk, ShadowMapWalk};
use scatter_core::VolumetricShadow;
use scatter_scene::RaycastTruth;

use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::staged_shot::{StageError, StagedShot};

/// Id of shadow-map truth.
pub const SHADOW_MAP_TRUTH: &str = "truth-shadow-map";
/// Id of ray-cast truth.
pub const RAYCAST_TRUTH: &str = "truth-raycast";

/// Id of height-field truth.
pub const HEIGHT_FIELD_TRUTH: &str = HEIGHT_FIELD_ID;

/// The exact image for the surface that interpolates the shot's shadow maps.
pub fn height_field_truth(shot: &StagedShot) -> Result<Measurement, StageError> {
    measured(shot, &mut HeightFieldWalk)
}

/// The exact image for the shot's shadow maps.
pub fn shadow_map_truth(shot: &StagedShot) -> Result<Measurement, StageError> {
    measured(shot, &mut ShadowMapWalk::new())
}

/// The exact image for the shot's triangles; needs no maps.
pub fn raycast_truth(shot: &StagedShot) -> Result<Measurement, StageError> {
    measured(shot, &mut RaycastTruth::new(shot.caster()))
}

/// A reference that cannot do a shot is an error.
fn measured(shot: &StagedShot, reference: &mut dyn VolumetricShadow) -> Result<Measurement, StageError> {
    let method = reference.id();
    match measure(shot, &mut Renderer::Shared(reference), 1)? {
        Outcome::Measured(measurement) => Ok(*measurement),
        Outcome::Unsupported(unsupported) => {
            Err(StageError::Render { shot: shot.name().to_string(), method, source: unsupported.into() })
        }
    }
}
