//! What the frame's shadow map is good for, and which one would serve the budget.
//!
//! The map's own error (against the triangles) is found from the rays of the sample ([`SceneSample::map_error`]): how long their
//! texels are, how much light their edges move, and what half as many texels would change.

use scatter_core::{LightKind, SceneSample};

use super::budget::Budget;

/// What a map shows, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapAdvice {
    /// Relative RMSE of an exact technique against the triangles, as predicted; 0 without shadows.
    pub error: f64,
    /// Texels along a side of the largest of its maps; 0 without one.
    pub side: u32,
    /// The least power of two of texels a side whose error is within the budget's; `None` where that would be above
    /// 16,384, or where the budget is none of errors.
    pub wanted_side: Option<u32>,
    /// The kind that serves best.
    pub kind: MapKindAdvice,
}

/// Which maps a light should have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKindAdvice {
    /// As they are: one map, or a lamp's own.
    Keep,
    /// A sun's map as four cascades of half of [`MapAdvice::wanted_side`] each: one map of that size would be larger than
    /// most devices like.
    Cascades,
    /// None that this page knows of: texels finer than 16,384 a side.
    NoneSuffices,
}

/// Sides from which on a sun's map is better given as cascades, and of the largest map.
const LARGE_SIDE: f64 = 4096.0;
const LARGEST_SIDE: f64 = 16_384.0;

impl MapAdvice {
    pub(super) fn of(sample: &SceneSample, budget: Budget) -> Self {
        let side = sample.facts.shadow_map_side;
        let error = if sample.facts.casts_shadow { sample.map_error(1.0) } else { 0.0 };
        let mut advice = Self { error, side, wanted_side: None, kind: MapKindAdvice::Keep };
        let (Some(allowed), true) = (budget.error(), sample.facts.casts_shadow && side > 0) else {
            return advice;
        };
        let wanted = (6..=14).map(|power| f64::from(1 << power)).find(|wanted| {
            let scale = wanted / f64::from(side);
            sample.map_error(scale) <= allowed
        });
        match wanted {
            Some(wanted) => {
                advice.wanted_side = Some(wanted as u32);
                if wanted > LARGE_SIDE && sample.facts.light == LightKind::Directional {
                    advice.kind = MapKindAdvice::Cascades;
                }
            }
            None => {
                debug_assert!(LARGEST_SIDE == f64::from(1 << 14));
                advice.kind = MapKindAdvice::NoneSuffices;
            }
        }
        advice
    }

    /// Whether an error is far below what the map itself is off by, so that nobody gains by it.
    pub fn hides(&self, error: f64) -> bool {
        3.0 * error < self.error
    }
}
