//! The marcher's options, and the marcher as tools see it.

use scatter_core::{
    Choice, Configurable, Estimate, LightKind, MemoryBound, NoEstimate, OptionError, OptionRange,
    OptionTable, OptionValue, Outlook, Quality, Rounding, SceneFacts, Target, TechniqueInfo,
    VolumetricShadow, option_row,
};

use super::RayMarch;
use super::estimate::predicted;
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

/// Options of [`RayMarch`].
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

static TABLE: OptionTable<Options> = OptionTable {
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

static INFO: TechniqueInfo = TechniqueInfo {
    id: super::MARCH_ID,
    summary: "brute force: every ray is cut into steps, each integrated in closed form",
    paper: "the baseline of Baran et al. 2010; equi-angular steps: Kulla and Fajardo 2012",
    misses: "shadows that are thinner than a step",
    capabilities: super::CAPABILITIES,
    rounding: Rounding {
        overrides: &[("steps", "1024")],
        scaled: 1e-4,
        // 2 of 1024 samples.
        moved: 2.0 / 1024.0,
        added: 1e-4,
        lit: 1e-3,
        derivation: "f32: 2,048 additions of rounded weights at the finest preset, 1e-4. A world 1e4 units from the origin has \
                     coordinates good to 2e-12, so that a moved sample may fall on the neighbouring texel: two of 1024. A \
                     lit sun's steps are exact; a lamp's follow phase function and cone by midpoints, with the square of \
                     the step: 32 were seen to miss by 6 %, 1024 then by 6e-5, and as much again for f32 cosines at the \
                     steep border of a cone, 2.5e-4",
    },
    // A packet's lanes of each layer for every band of 32 rows.
    memory: MemoryBound { fixed: 1 << 20, a_pixel: 64, a_texel: 0 },
    options: &TABLE,
};

/// The marcher for tools.
#[derive(Debug, Clone, Copy)]
pub struct RayMarchTechnique;

/// The one instance of [`RayMarchTechnique`].
pub static TECHNIQUE: RayMarchTechnique = RayMarchTechnique;

impl Configurable for RayMarchTechnique {
    type Options = Options;

    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn table(&self) -> &'static OptionTable<Options> {
        &TABLE
    }

    fn choose(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Options, OptionError> {
        match target {
            Target::Quality(level) => Ok(Options::for_quality(level)),
            // A caller that says how many steps it wants asks for no promise.
            Target::Error(_) if overrides.iter().any(|(key, _)| *key == "steps") => Ok(Options::default()),
            Target::Error(error) => Options::for_error(error, facts),
        }
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(RayMarch::unchecked(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        // 8 to 16384 steps.
        (3..=14).map(|power| vec![("steps", 2f64.powi(power))]).collect()
    }

    fn predict(&self, options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        predicted(options, outlook)
    }
}
