//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, Outlook,
    Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::estimate::predicted;
use crate::options::{Downscale, Edges, ID, MOST_HALVINGS, Mode, Options};
use crate::slices::TreeKind;
use crate::technique::{CAPABILITIES, MinMaxMipmap};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!(
            "mode",
            "how pixels are answered; exact: each by its own ray; all other options are those of the two other modes",
            Mode,
            mode
        ),
        option_row!("tree", "the min/max tree over a slice's row of texels", TreeKind, tree),
        option_row!("slices", "slices of a frame", "", OptionRange::Whole([24, 16384]), slices as u32),
        option_row!(
            "samples",
            "samples of a slice, or as many as it has pixels along it",
            "",
            OptionRange::Whole([2, 8192]),
            samples as u32
        ),
        option_row!(
            "initial",
            "one sample in how many is marched to begin with",
            "",
            OptionRange::Whole([1, 512]),
            initial as u32
        ),
        option_row!(
            "density",
            "how many times as many are marched near the epipole",
            "",
            OptionRange::Whole([1, 64]),
            density as u32
        ),
        option_row!(
            "refinement",
            "relative difference of depths over which nothing is interpolated",
            "",
            OptionRange::Real([0.001, 10.0]),
            refinement as f32
        ),
        option_row!("edges", "at which edges further samples are marched", Edges, edges),
        option_row!(
            "halvings",
            "how often the gap between two slices that differ is halved",
            "",
            OptionRange::Whole([0, MOST_HALVINGS as u64]),
            halvings as u32
        ),
        option_row!(
            "contrast",
            "relative difference of two samples' or two slices' light that is interpolated over",
            "",
            OptionRange::Real([0.001, 1.0]),
            contrast as f32
        ),
        option_row!(
            "downscale",
            "one pixel in how many, along each axis, is found from slices",
            Downscale,
            downscale
        ),
        option_row!(
            "correction",
            "whether pixels that no sample serves are marched",
            "",
            OptionRange::choice::<Correction>(),
            |options| Correction(options.correction).into(),
            |options, value| options.correction = value.choice::<Correction>().0
        ),
    ],
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
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Options, OptionError> {
        // Exact keeps every level and every promise.
        match target {
            Target::Quality(level) => Ok(Options::for_quality(level, facts)),
            Target::Error(_) => {
                TABLE.require(
                    overrides,
                    "mode",
                    &["exact"],
                    "exact: interpolation between slices promises no error",
                )?;
                Ok(Options::default())
            }
        }
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(MinMaxMipmap::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        // Exact has one setting.
        vec![vec![]]
    }

    fn predict(&self, options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        predicted(options, outlook)
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
        vec![("exact", Self::Exact), ("sampling", Self::Sampling), ("slices", Self::Slices)]
    }
}

impl Choice for TreeKind {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("yusov", Self::Yusov), ("chen", Self::Chen), ("none", Self::None)]
    }
}

impl Choice for Edges {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("depth", Self::Depth), ("row", Self::Row)]
    }
}

impl Choice for Downscale {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("1", Self::One), ("2", Self::Two), ("4", Self::Four)]
    }
}

/// Whether pixels that no sample serves are marched.
#[derive(Clone, Copy, PartialEq)]
struct Correction(bool);

impl Choice for Correction {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("on", Self(true)), ("off", Self(false))]
    }
}
