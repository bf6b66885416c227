//! The GPU's techniques as tools see them: described, configured, swept. Their ids end in `@gpu`.

use scatter_core::{
    Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, Outlook, Quality,
    Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use super::epipolar_tool::Epipolar;
use super::technique::{GpuTechnique, MARCH_GPU_ID, MINMAX_GPU_ID, NOT_MODELLED};
use crate::capabilities;
use crate::technique::Technique;

/// All of them.
pub static TECHNIQUES: &[&dyn scatter_core::Technique] = &[&March, &MinMax, &Epipolar];

/// The technique with that id.
pub fn technique(id: &str) -> Option<&'static dyn scatter_core::Technique> {
    TECHNIQUES.iter().copied().find(|technique| technique.info().id == id)
}

struct March;
struct MinMax;

/// Options of the marcher on the GPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarchSteps {
    /// Steps a ray, 1 to 65,536.
    pub steps: u32,
}

impl MarchSteps {
    /// The steps of the CPU marcher's preset: a twin marches alike.
    pub const fn for_quality(level: Quality) -> Self {
        let steps = match level {
            Quality::Preview => 256,
            Quality::Game => 1024,
            Quality::Film => 4096,
        };
        Self { steps }
    }
}

impl Default for MarchSteps {
    fn default() -> Self {
        Self::for_quality(Quality::default())
    }
}

static MARCH_TABLE: OptionTable<MarchSteps> = OptionTable {
    technique: MARCH_GPU_ID,
    rows: &[option_row!("steps", "steps a ray", "", OptionRange::Whole([1, 65_536]), steps as u32)],
};

static MARCH_INFO: TechniqueInfo = TechniqueInfo {
    id: MARCH_GPU_ID,
    summary: "brute force on the GPU: one look-up a step, each integrated in closed form",
    paper: "the twin of raymarch",
    misses: "shadows that are thinner than a step",
    capabilities: capabilities::MARCH,
    rounding: Rounding {
        overrides: &[("steps", "1024")],
        scaled: 1e-4,
        moved: 4.0 / 1024.0,
        added: 1e-4,
        lit: 1e-3,
        derivation: "as the CPU marcher's; positions in maps are sums of f32, so that two more of 1024 samples may fall \
                     on a neighbouring texel",
    },
    // Two images of 16 bytes, distances, depth: once on the GPU and once read back.
    memory: MemoryBound { fixed: 1 << 20, a_pixel: 128, a_texel: 8 },
    options: &MARCH_TABLE,
};

impl Configurable for March {
    type Options = MarchSteps;

    fn info(&self) -> &'static TechniqueInfo {
        &MARCH_INFO
    }

    fn table(&self) -> &'static OptionTable<MarchSteps> {
        &MARCH_TABLE
    }

    fn choose(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<MarchSteps, OptionError> {
        match target {
            Target::Quality(level) => Ok(MarchSteps::for_quality(level)),
            Target::Error(_) if overrides.iter().any(|(key, _)| *key == "steps") => Ok(MarchSteps::default()),
            Target::Error(error) => Err(OptionError::BadValue {
                technique: MARCH_GPU_ID,
                key: "error",
                value: error.to_string(),
                range: "a quality level, or steps: the GPU's marcher promises no error".into(),
            }),
        }
    }

    fn instance(&self, options: MarchSteps) -> Box<dyn VolumetricShadow> {
        let technique = Technique::RayMarch { steps: options.steps, jitter: None, uniform: false };
        Box::new(GpuTechnique::new(technique))
    }

    fn predict(&self, _options: &MarchSteps, _outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because(NOT_MODELLED))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        (3..=12).map(|power| vec![("steps", 2f64.powi(power))]).collect()
    }
}

/// Options of exact min/max on the GPU: none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NoOptions;

static MINMAX_TABLE: OptionTable<NoOptions> = OptionTable { technique: MINMAX_GPU_ID, rows: &[] };

static MINMAX_INFO: TechniqueInfo = TechniqueInfo {
    id: MINMAX_GPU_ID,
    summary: "exact shadows on the GPU: every pixel's ray through min/max trees of the maps",
    paper: "the twin of minmax-mipmap's exact mode; after Chen et al. 2011",
    misses: "",
    capabilities: capabilities::MINMAX,
    rounding: Rounding {
        overrides: &[],
        scaled: 2e-4,
        moved: 1e-3,
        added: 2e-4,
        lit: 2e-4,
        derivation: "f32 crossings of f32 rays with texels, and the airlight integral of lamps by panels across a cone's \
                     borders, 8.5e-5 at the worst of the stock frames",
    },
    memory: MemoryBound { fixed: 1 << 20, a_pixel: 128, a_texel: 8 },
    options: &MINMAX_TABLE,
};

impl Configurable for MinMax {
    type Options = NoOptions;

    fn info(&self) -> &'static TechniqueInfo {
        &MINMAX_INFO
    }

    fn table(&self) -> &'static OptionTable<NoOptions> {
        &MINMAX_TABLE
    }

    fn choose(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<NoOptions, OptionError> {
        Ok(NoOptions)
    }

    fn instance(&self, _options: NoOptions) -> Box<dyn VolumetricShadow> {
        Box::new(GpuTechnique::new(Technique::MinmaxMipmap))
    }

    fn predict(&self, _options: &NoOptions, _outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because(NOT_MODELLED))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        vec![vec![]]
    }
}
