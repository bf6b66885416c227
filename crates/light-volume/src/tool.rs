//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, Outlook,
    Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::estimate::predicted;
use crate::options::{Accumulate, ID, Options, Surface, Tessellation};
use crate::technique::{CAPABILITIES, LightVolume};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!("surface", "the surface that the mesh has", Surface, surface),
        option_row!(
            "accumulate",
            "how crossings become radiance: intervals, or the sum of signed terms in integers, f64 or f32",
            Accumulate,
            accumulate
        ),
        option_row!(
            "tessellation",
            "whether the mesh is coarser where the map allows it",
            Tessellation,
            tessellation
        ),
        option_row!(
            "threshold",
            "what an adaptive mesh may be off by along the light: a share of the longest ray, around a lamp of the depth",
            "",
            OptionRange::Real([0.0, 0.1]),
            threshold as f32
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "a closed mesh around the shadow of the map, rasterised; exact with respect to the map",
    paper: "Billeter et al. 2010",
    misses: "",
    capabilities: CAPABILITIES,
    rounding: Rounding {
        // A square's spread of depths may come to lie on the other side of a threshold.
        overrides: &[("threshold", "0")],
        scaled: 2e-5,
        moved: 2e-5,
        added: 1e-6,
        lit: 4e-5,
        derivation: "crossings are solved in f64 and rounded to f32, twice a lit interval: 2⁻²³ of the ray's length each, \
                     over as many as a small map has: ten are allowed, 1e-6; what lies between is the closed form in \
                     f32, of a sun 1e-5 at most, of a lamp twice the 2.3e-5 that was met",
    },
    // The worst map has three faces a texel at 18 bytes, a row of texels one more, in lists that may have grown by doubling
    // and chunks that may be half full; and a texel of its own. A worker holds one tile, in
    // which a ray may cross all texels of a map's row: more than these bytes from 400 texels a side on, and then less than the
    // texels' own.
    memory: MemoryBound { fixed: 64 << 20, a_pixel: 1, a_texel: 256 },
    options: &TABLE,
};

/// The technique for tools.
#[derive(Debug, Clone, Copy)]
pub struct LightVolumeTechnique;

/// The one instance of [`LightVolumeTechnique`].
pub static TECHNIQUE: LightVolumeTechnique = LightVolumeTechnique;

impl Configurable for LightVolumeTechnique {
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
            Target::Quality(level) => Ok(Options::for_quality(level, facts.light)),
            Target::Error(error) => {
                // Sums of signed terms lose what a frame's media make them lose.
                let range = "intervals: sums of signed terms promise no error";
                TABLE.require(overrides, "accumulate", &["intervals"], range)?;
                let range = "stepped: the interpolated surface is not that of the map's nearest texels, of which errors are promised";
                TABLE.require(overrides, "surface", &["stepped"], range)?;
                Ok(Options::for_error(error))
            }
        }
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(LightVolume::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        [0.01, 3e-3, 1e-3, 3e-4, 1e-4, 0.0].map(|threshold| vec![("threshold", threshold)]).into()
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

impl Choice for Surface {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("stepped", Self::Stepped), ("interpolated", Self::Interpolated)]
    }
}

impl Choice for Accumulate {
    fn names() -> Vec<(&'static str, Self)> {
        vec![
            ("intervals", Self::Intervals),
            ("shares", Self::Shares),
            ("signed", Self::Signed),
            ("signed-f32", Self::SignedSingle),
        ]
    }
}

impl Choice for Tessellation {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("adaptive", Self::Adaptive), ("static", Self::Static)]
    }
}
