//! The marcher's options, and the marcher as tools see it.

use std::str::FromStr;

use scatter_core::{
    LightKind, OptionError, OptionInfo, Quality, SceneFacts, Target, Technique, TechniqueInfo,
    VolumetricShadow,
};

use super::RayMarch;

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
    /// `(τ/n)/(1 − e^{−τ})` of the unoccluded value, and a ray crosses at most 2·side texels, each with two changes.
    /// So the promise asks for many steps, and where it asks for more than [`MOST_STEPS`], and near lamps, whose
    /// phase lobes and cones no step bounds, it cannot be given: an error says so. Choose `steps` by a quality level
    /// then.
    pub fn for_error(error: f64, facts: &SceneFacts) -> Result<Self, OptionError> {
        let refused = || OptionError::BadValue {
            technique: super::MARCH_ID,
            key: "error",
            value: error.to_string(),
            range: "an error that 65536 steps can promise (unshadowed sun: any), or a quality level",
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
        let near_weight = if depth > 0.0 { depth / -(-depth).exp_m1() } else { 1.0 };
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
        match key {
            "steps" => self.steps = INFO.parse("steps", value, |steps| (1..=MOST_STEPS).contains(steps))?,
            "jitter" => self.jitter = INFO.parse::<Jitter>("jitter", value, |_| true)?.0,
            "distribution" => self.distribution = INFO.parse("distribution", value, |_| true)?,
            _ => {
                INFO.option(key)?;
            }
        }
        Ok(())
    }
}

/// `off`, `on` (seed 0) or a seed.
struct Jitter(Option<u32>);

impl FromStr for Jitter {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "off" | "false" => Ok(Self(None)),
            "on" | "true" => Ok(Self(Some(0))),
            _ => text.parse().map(|seed| Self(Some(seed))).map_err(|_| ()),
        }
    }
}

impl FromStr for Distribution {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "uniform" => Ok(Self::Uniform),
            "equi-angular" => Ok(Self::EquiAngular),
            _ => Err(()),
        }
    }
}

impl std::fmt::Display for Distribution {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Uniform => "uniform",
            Self::EquiAngular => "equi-angular",
        })
    }
}

static INFO: TechniqueInfo = TechniqueInfo {
    id: super::MARCH_ID,
    summary: "brute force: every ray is cut into steps, each integrated in closed form",
    paper: "the baseline of Baran et al. 2010; equi-angular steps: Kulla and Fajardo 2012",
    lights: &["directional", "point", "spot", "textured"],
    media: &["grey", "rgb", "every sum of phase functions"],
    cameras: &["perspective", "off-centre", "orthographic"],
    cannot: &["see shadows that are thinner than a step"],
    options: &[
        OptionInfo {
            key: "steps",
            summary: "steps a ray",
            unit: "",
            range: "an integer from 1 to 65536",
            default: || Options::default().steps.to_string(),
        },
        OptionInfo {
            key: "jitter",
            summary: "one sample anywhere in each step instead of in its middle",
            unit: "",
            range: "off, on, or a seed (an integer from 0 to 4294967295)",
            default: || Options::default().jitter.map_or("off".into(), |seed| seed.to_string()),
        },
        OptionInfo {
            key: "distribution",
            summary: "how rays near a lamp are cut into steps",
            unit: "",
            range: "uniform or equi-angular",
            default: || Options::default().distribution.to_string(),
        },
    ],
};

/// The marcher for tools.
#[derive(Debug, Clone, Copy)]
pub struct RayMarchTechnique;

/// The one instance of [`RayMarchTechnique`].
pub static TECHNIQUE: RayMarchTechnique = RayMarchTechnique;

impl Technique for RayMarchTechnique {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let chooses_steps = overrides.iter().any(|(key, _)| *key == "steps");
        let mut options = match target {
            Target::Quality(level) => Options::for_quality(level),
            // A caller that says how many steps it wants asks for no promise.
            Target::Error(_) if chooses_steps => Options::default(),
            Target::Error(error) => Options::for_error(error, facts)?,
        };
        for (key, value) in overrides {
            options.set(key, value)?;
        }
        Ok(Box::new(RayMarch::new(options)?))
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        // 8 to 16384 steps.
        (3..=14).map(|power| vec![("steps", (1u32 << power).to_string())]).collect()
    }
}

impl Options {
    /// The options themselves, or the error that names the one out of its range.
    pub fn checked(self) -> Result<Self, OptionError> {
        if (1..=MOST_STEPS).contains(&self.steps) {
            return Ok(self);
        }
        Err(OptionError::BadValue {
            technique: super::MARCH_ID,
            key: "steps",
            value: self.steps.to_string(),
            range: "an integer from 1 to 65536",
        })
    }
}
