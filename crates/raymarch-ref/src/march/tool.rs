//! The marcher as tools see it.

use scatter_core::{
    Configurable, Estimate, LightKind, MemoryBound, NoEstimate, OptionError, OptionTable, Outlook, Rounding,
    SceneFacts, Target, TechniqueInfo, VolumetricShadow,
};

use super::RayMarch;
use super::estimate::predicted;
use super::options::{Options, TABLE};

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
        if let (Target::Error(_), LightKind::Point | LightKind::Spot) = (target, facts.light) {
            let range = "equi-angular: equal lengths beside a lamp promise no error";
            TABLE.require(overrides, "distribution", &["equi-angular"], range)?;
        }
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
