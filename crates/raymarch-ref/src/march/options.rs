//! The marcher's options.

use scatter_core::{
    Choice, LightKind, OptionError, OptionRange, OptionTable, OptionValue, Quality, SceneFacts, option_row,
};

use super::fog_window::SCALE_HEIGHTS;

/// Most steps a ray; more than the texels that any ray crosses on a 16,384² map, and f32 counts them exactly.
pub const MOST_STEPS: u32 = 65_536;

/// How a ray is cut into steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Distribution {
    /// Equal lengths.
    Uniform,
    /// Near a lamp equal angles at the lamp, which is where the light is; under a sun equal lengths.
    #[default]
    EquiAngular,
}

/// Options of [`RayMarch`](super::RayMarch).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Steps a ray, 1 to [`MOST_STEPS`].
    pub steps: u32,
    /// Seed of a jittered march (one sample anywhere in each step); `None` samples the middle.
    pub jitter: Option<u32>,
    /// How a ray is cut.
    pub distribution: Distribution,
}

impl Default for Options {
    fn default() -> Self {
        Self::for_quality(Quality::default())
    }
}

impl Options {
    /// The preset of a level: what typical indoor shots need; thin shafts need up
    /// to four times as many, open terrain a tenth.
    pub const fn for_quality(level: Quality) -> Self {
        let steps = match level {
            Quality::Preview => 256,
            Quality::Game => 1024,
            Quality::Film => 4096,
        };
        Self { steps, jitter: None, distribution: Distribution::EquiAngular }
    }

    /// Options that promise an error of at most `error` (in (0, 1)) times each pixel's unoccluded value.
    ///
    /// Visibility can be wrong only in steps that it changes in. Under a sun a step weighs at most
    /// `(τ/n)/(1 − e^{−τ})` of the unoccluded value, in height fog whose `ln ρ` changes by x along the ray
    /// `x/(1 − e^{−x})` times that, and a ray crosses at most 2·side texels, each with two changes.
    /// So the promise asks for many steps, and where it asks for more than [`MOST_STEPS`], and near lamps, whose
    /// phase lobes and cones no step bounds, it cannot be given: an error says so. Choose `steps` by a quality level
    /// then.
    pub fn for_error(error: f64, facts: &SceneFacts) -> Result<Self, OptionError> {
        let refused = || OptionError::BadValue {
            technique: super::MARCH_ID,
            key: "error",
            value: error.to_string(),
            range: format!(
                "an error that {MOST_STEPS} steps can promise (unshadowed sun: any), or a quality level"
            ),
        };
        if !(error > 0.0 && error < 1.0) {
            return Err(refused());
        }
        let least = Self { steps: 1, ..Self::default() };
        if facts.light != LightKind::Directional {
            return Err(refused());
        }
        if !facts.casts_shadow && !facts.textured {
            return Ok(least);
        }
        if facts.textured {
            return Err(refused());
        }
        // Marched rays end where the transmittance is negligible.
        let depth = facts.max_optical_depth.min(super::NEGLIGIBLE_OPTICAL_DEPTH);
        let over_its_mean = |x: f64| if x > 0.0 { x / -(-x).exp_m1() } else { 1.0 };
        let fall = facts.log_density.map_or(0.0, |[least, most]| (most - least).min(SCALE_HEIGHTS));
        let near_weight = over_its_mean(depth) * over_its_mean(fall);
        let changes = 4.0 * f64::from(facts.shadow_map_side.max(1));
        let steps = (changes * near_weight / error).ceil();
        if steps <= f64::from(MOST_STEPS) {
            Ok(Self { steps: steps as u32, ..least })
        } else {
            Err(refused())
        }
    }

    /// Sets one option from text.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        TABLE.set(self, key, value)
    }

    /// The options themselves, or the error that names the one out of its range.
    pub fn checked(self) -> Result<Self, OptionError> {
        TABLE.check(&self).map(|()| self)
    }
}

impl std::fmt::Display for Distribution {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        OptionValue::from(*self).fmt(f)
    }
}

impl Choice for Distribution {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("uniform", Self::Uniform), ("equi-angular", Self::EquiAngular)]
    }
}

pub(super) static TABLE: OptionTable<Options> = OptionTable {
    technique: super::MARCH_ID,
    rows: &[
        option_row!("steps", "steps a ray", "", OptionRange::Whole([1, MOST_STEPS as u64]), steps as u32),
        option_row!(
            "jitter",
            "one sample anywhere in each step instead of in its middle; on is seed 0",
            "seed",
            OptionRange::WordOrWhole(&["off", "on"], [0, u32::MAX as u64]),
            |options| options.jitter.map_or(OptionValue::Word("off"), OptionValue::from),
            |options, value| {
                let seed = value.as_number().map(|seed| seed as u32);
                options.jitter = if value == OptionValue::Word("on") { Some(0) } else { seed };
            }
        ),
        option_row!("distribution", "how rays near a lamp are cut into steps", Distribution, distribution),
    ],
};
