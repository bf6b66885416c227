//! What cascades gain: the shadow map's own error with one map, and with cascades that have as many texels together.

use scatter_core::Light;
use scatter_scene::{MapResolution, RasterDevice, Shot};
use serde::Serialize;

use crate::figures::Figures;
use crate::judge_error::JudgeError;
use crate::judged_shot::against;
use crate::staged_shot::StagedShot;
use crate::truths::{RAYCAST_TRUTH, SHADOW_MAP_TRUTH, raycast_truth, shadow_map_truth};

/// The error of shadow-map truth against ray-cast truth at one resolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapError {
    /// Texels along a side of each map.
    pub shadow_map: u32,
    /// Maps of each sun.
    pub cascades: u32,
    /// Time to make depth and shadow maps \[ms\].
    pub maps_ms: f64,
    /// Against ray-cast truth.
    pub error: Figures,
}

/// The map's own error of a sun's shot with equal texels in one map and in cascades.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CascadeGain {
    /// With one map.
    pub one_map: MapError,
    /// With cascades.
    pub cascades: MapError,
}

impl CascadeGain {
    /// How many times smaller the relative RMSE is with cascades; > 1 is a gain. NaN if both are 0.
    pub fn factor(&self) -> f64 {
        self.one_map.error.rel_rmse / self.cascades.error.rel_rmse
    }
}

/// Measures a shot at its own size; `None` without a sun. Renders ray-cast truth once and shadow-map truth twice;
/// `progress` is told what comes next.
pub fn cascade_gain(
    shot: Shot,
    resolution: MapResolution,
    device: Option<&RasterDevice>,
    progress: &mut dyn FnMut(&str),
) -> Result<Option<CascadeGain>, JudgeError> {
    if !shot.lights.iter().any(|part| matches!(part.light, Light::Directional(_))) {
        return Ok(None);
    }
    let mut staged = StagedShot::without_maps(shot, resolution, device)?;
    progress(RAYCAST_TRUTH);
    let raycast = raycast_truth(&staged)?;
    let lights: Vec<Light> = staged.lights().map(|(light, _)| light.clone()).collect();
    let mut error_with = |resolution: MapResolution| {
        progress(&format!("{SHADOW_MAP_TRUTH}, {resolution}"));
        staged.restage(staged.camera().clone(), &lights, resolution)?;
        let error = against(&staged, &raycast, &shadow_map_truth(&staged)?)?;
        let MapResolution { side, cascades } = resolution;
        Ok::<_, JudgeError>(MapError { shadow_map: side, cascades, maps_ms: staged.maps_ms(), error })
    };
    let one_map = error_with(resolution.in_one_map())?;
    Ok(Some(CascadeGain { one_map, cascades: error_with(resolution)? }))
}
