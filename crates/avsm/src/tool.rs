//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, Outlook,
    Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::estimate::predicted;
use crate::options::{Between, Curve, ID, MOST_CURVES, Moments, Nodes, Opaque, Options, Removal, Texels};
use crate::technique::{Avsm, CAPABILITIES};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!("curve", "the transmittance curve of a texel", Curve, curve),
        option_row!("nodes", "nodes of an adaptive curve", Nodes, nodes),
        option_row!(
            "removal",
            "which node an adaptive curve loses: by the area of exponentials, of triangles, or of both nodes of an insertion together",
            Removal,
            removal
        ),
        option_row!("between", "how an adaptive curve runs between nodes", Between, between),
        option_row!("moments", "power moments of a curve of moments", Moments, moments),
        option_row!(
            "threshold",
            "largest error of a deep shadow map's transmittance",
            "",
            OptionRange::Real([1e-6, 1.0]),
            threshold as f32
        ),
        option_row!(
            "curves",
            "texels along the longer side of a curve map, of cube faces and cascades each; captured occluders bring their own",
            "texels",
            OptionRange::Whole([1, MOST_CURVES as u64]),
            curves as u32
        ),
        option_row!(
            "texels",
            "texels of a source's curve maps: its own, or the shadow map's where they are at most twice curves a side (every level, unless curves is given)",
            Texels,
            texels
        ),
        option_row!(
            "opaque",
            "where opaque surfaces are: in the shadow map, or in the curves",
            Opaque,
            opaque
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "fog lit through smoke and hair, by a transmittance curve a texel",
    paper: "Salvi et al. 2010",
    misses: "",
    capabilities: CAPABILITIES,
    rounding: Rounding::F64,
    // Blocks of the shadow map: 8.2 bytes for 64 texels, and a few in the smallest of maps. With opaque surfaces in the curves a
    // curve of 16 nodes or 32 slices a texel, no more than the map has, and its blocks; lists of nodes less, but in bands
    // of 8 rows. Translucent occluders are core's.
    memory: MemoryBound { fixed: 1 << 16, a_pixel: 8, a_texel: 176 },
    options: &TABLE,
};

/// The technique for tools.
#[derive(Debug, Clone, Copy)]
pub struct AvsmTechnique;

/// The one instance of [`AvsmTechnique`].
pub static TECHNIQUE: AvsmTechnique = AvsmTechnique;

impl Configurable for AvsmTechnique {
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
            Target::Quality(level) => {
                let options = Options::for_quality(level);
                // Who gives a size gets a map of that size.
                let is_sized = overrides.iter().any(|(key, _)| *key == "curves");
                Ok(Options { texels: if is_sized { Texels::Own } else { options.texels }, ..options })
            }
            Target::Error(_) => {
                TABLE.require(
                    overrides,
                    "opaque",
                    &["map"],
                    "map: curves have a resolution of their own, which promises nothing",
                )?;
                if facts.translucent {
                    let range = "uncompressed: other curves promise no error";
                    TABLE.require(overrides, "curve", &["uncompressed"], range)?;
                }
                Ok(Options::exact(facts))
            }
        }
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(Avsm::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        [4.0, 8.0, 16.0].map(|nodes| vec![("nodes", nodes)]).into()
    }

    fn predict(&self, options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        predicted(options, outlook)
    }
}

impl Options {
    /// What promises an error: the truth of the captured segments, where there are any. Opaque surfaces are exact anyway.
    pub fn exact(facts: &SceneFacts) -> Self {
        let curve = if facts.translucent { Curve::Uncompressed } else { Curve::default() };
        Self { curve, texels: Texels::Own, ..Self::default() }
    }

    /// Sets one option from text; an error names key, value and range, or all keys.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        TABLE.set(self, key, value)
    }
}

impl Choice for Curve {
    fn names() -> Vec<(&'static str, Self)> {
        vec![
            ("avsm", Self::Avsm),
            ("deep", Self::Deep),
            ("opacity", Self::Opacity),
            ("fourier", Self::Fourier),
            ("moments", Self::Moments),
            ("uncompressed", Self::Uncompressed),
        ]
    }
}

impl Choice for Nodes {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("4", Self::Four), ("8", Self::Eight), ("12", Self::Twelve), ("16", Self::Sixteen)]
    }
}

impl Choice for Moments {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("4", Self::Four), ("6", Self::Six), ("8", Self::Eight)]
    }
}

impl Choice for Removal {
    fn names() -> Vec<(&'static str, Self)> {
        vec![
            ("exponential", Self::Exponential),
            ("triangle", Self::Triangle),
            ("look-ahead", Self::LookAhead),
        ]
    }
}

impl Choice for Between {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("exponential", Self::Exponential), ("linear", Self::Linear)]
    }
}

impl Choice for Texels {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("own", Self::Own), ("shadow-map", Self::ShadowMap)]
    }
}

impl Choice for Opaque {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("map", Self::Map), ("curve", Self::Curve)]
    }
}
