//! What a shot's light looks like from its camera: how much of the air is lit, and how often a ray changes.
//!
//! Both by the exact walk through the shadow map. They say where a technique's time goes: a marcher pays for the dark
//! share too, a technique driven by transitions pays for those alone.

use raymarch_ref::ShadowMapWalk;
use serde::Serialize;

use crate::staged_shot::{StageError, StagedShot};

/// Figures over all rays of a shot's image, all lights together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Survey {
    /// Lit length over total length of the rays, 0 to 1 (1 for rays of no length at all).
    pub lit_share: f64,
    /// Mean number of changes between light and shadow along a ray.
    pub transitions_mean: f64,
    /// The number that 90 % of the rays do not exceed.
    pub transitions_p90: u32,
}

/// Surveys a shot.
pub fn survey(shot: &StagedShot) -> Result<Survey, StageError> {
    let [width, height] = shot.camera().size();
    let (mut lit, mut total) = (0.0, 0.0);
    let mut transitions = Vec::with_capacity(width as usize * height as usize * shot.light_count());
    for index in 0..shot.light_count() {
        shot.with_frame(index, shot.camera(), |frame| {
            for y in 0..height {
                for x in 0..width {
                    let end = frame.ray_end(x, y);
                    let mut changes = 0;
                    ShadowMapWalk::lit_stretches(frame, x, y, |from, to| {
                        lit += to - from;
                        // Each stretch begins and ends with a change, but at the ends of the ray.
                        changes += u32::from(from > 0.0) + u32::from(to < end);
                    });
                    total += end;
                    transitions.push(changes);
                }
            }
        })?;
    }
    transitions.sort_unstable();
    let count = transitions.len().max(1);
    let nine_tenths = (count * 9).div_ceil(10).saturating_sub(1);
    Ok(Survey {
        lit_share: if total > 0.0 { lit / total } else { 1.0 },
        transitions_mean: transitions.iter().map(|&n| f64::from(n)).sum::<f64>() / count as f64,
        transitions_p90: transitions.get(nine_tenths).copied().unwrap_or(0),
    })
}
