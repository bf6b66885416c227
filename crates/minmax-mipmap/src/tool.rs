//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Configurable, MemoryBound, OptionError, OptionTable, Rounding, SceneFacts, Target, TechniqueInfo,
    VolumetricShadow, option_row,
};

use crate::options::{ID, Mode, Options};
use crate::technique::{CAPABILITIES, MinMaxMipmap};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[option_row!("mode", "how pixels are answered; exact: each by its own ray", Mode, mode)],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "lit intervals by min/max mipmaps of the shadow map, exact for every pixel's own ray",
    paper: "Chen et al. 2011, Yusov 2012",
    misses: "",
    capabilities: CAPABILITIES,
    rounding: Rounding {
        overrides: &[],
        scaled: 2e-5,
        moved: 2e-5,
        added: 1e-6,
        lit: 4e-5,
        derivation: "where a ray crosses a texel's border is rounded to f32 relative to where it enters the map, twice a \
                     lit interval: 2⁻²³ of the ray's length each, over as many crossings as a small map has: ten are \
                     allowed, 1e-6; what lies between is the closed form in f32, of a sun 1e-5 at most, of a lamp twice \
                     the 2.3e-5 that was met",
    },
    // A block of 4×4 texels has one node of 4 bytes, and all coarser levels a third of that. A worker holds one tile.
    memory: MemoryBound { fixed: 16 << 20, a_pixel: 1, a_texel: 1 },
    options: &TABLE,
};

/// The technique for tools.
#[derive(Debug, Clone, Copy)]
pub struct MinMaxMipmapTechnique;

/// The one instance of [`MinMaxMipmapTechnique`].
pub static TECHNIQUE: MinMaxMipmapTechnique = MinMaxMipmapTechnique;

impl Configurable for MinMaxMipmapTechnique {
    type Options = Options;

    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn table(&self) -> &'static OptionTable<Options> {
        &TABLE
    }

    fn choose(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Options, OptionError> {
        // Exact is no dearer than an approximation but in foliage, and keeps every level and every promise.
        Ok(Options::default())
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(MinMaxMipmap::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        // Exact has one setting.
        vec![vec![]]
    }
}

impl Options {
    /// Sets one option from text; an error names key, value and range, or all keys.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        TABLE.set(self, key, value)
    }
}

impl Choice for Mode {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("exact", Self::Exact)]
    }
}
