//! The integrator as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable,
    OptionValue, Outlook, Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::baran::sums::SumAlgorithm;
use crate::baran::{Cells, Factorisation, MAX_RANK};
use crate::driver::{MOST_HALVINGS, Resampling};
use crate::estimate::predicted;
use crate::options::{ID, NearEpipole, Options};
use crate::paper::SampledCells;
use crate::technique::{CAPABILITIES, Epipolar};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!(
            "spacing",
            "distance of slices; measured: what the scene needs, found from a sample of gaps",
            "pixels",
            OptionRange::WordOrReal(&["measured"], [1.0 / 16.0, 16.0]),
            |options| options.target.map_or(options.spacing.into(), |_| OptionValue::Word("measured")),
            |options, value| match value.as_number() {
                Some(spacing) => (options.target, options.spacing) = (None, spacing),
                None => options.target = options.target.or(Options::default().target),
            }
        ),
        option_row!(
            "fewest",
            "slices a radian, at least, whatever the spacing is set to",
            "",
            OptionRange::Real([1.0, 1e4]),
            fewest_slices as f64
        ),
        option_row!(
            "tolerance",
            "difference of neighbouring slices, relative to the radiance, that is interpolated over",
            "",
            OptionRange::Real([0.0, 1.0]),
            refinement.tolerance as f32
        ),
        option_row!(
            "halvings",
            "how often the gap between slices that differ is halved",
            "",
            OptionRange::Whole([0, MOST_HALVINGS as u64]),
            refinement.halvings as u32
        ),
        option_row!(
            "columns",
            "one column in how many has a view ray that pixels on one surface share; 0: every pixel asks itself",
            "",
            OptionRange::WordOrWhole(&["auto"], [0, 16]),
            |options| options.shared_columns.map_or(OptionValue::Word("auto"), OptionValue::from),
            |options, value| options.shared_columns = value.as_number().map(|columns| columns as u32)
        ),
        option_row!(
            "split",
            "columns that one texel may hide before the light rays behind it are told apart",
            "columns",
            OptionRange::Real([0.0, 16.0]),
            uncut_columns as f32
        ),
        option_row!(
            "rank",
            "terms of the factorisation",
            "",
            OptionRange::WordOrWhole(&["auto"], [1, MAX_RANK as u64]),
            |options| options.rank.map_or(OptionValue::Word("auto"), OptionValue::from),
            |options, value| options.rank = value.as_number().map(|rank| rank as u32)
        ),
        option_row!("factorisation", "how the integrand is factorised", Factorisation, factorisation),
        option_row!("integrator", "how lit runs are summed", Option<SumAlgorithm>, sum_algorithm),
        option_row!(
            "cells",
            "where the cells of rectified rows lie, and how many depths each knows",
            Cells,
            cells
        ),
        option_row!("around", "what is done around the epipole", NearEpipole, near_epipole),
        option_row!(
            "resampling",
            "whether every pixel asks with its own depth, or rectified results are resampled",
            Resampling,
            resampling
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "visibility summed along epipolar slices, shared by all view rays of a slice",
    paper: "Baran et al. 2010",
    misses: "what is thinner than the gap between two slices that agree",
    capabilities: CAPABILITIES,
    rounding: Rounding {
        overrides: &[("spacing", "0.25"), ("halvings", "0"), ("rank", "8")],
        scaled: 1e-4,
        moved: 1e-4,
        added: 1e-6,
        lit: 4e-5,
        derivation: "the tables of eight terms are interpolated linearly in f32, and a changed view changes where: 1e-4. \
                     Strength is one of the f32 factors of a product, three times, and a sum: a few roundings of 6e-8 \
                     each. Lit pixels are the closed form in f32, of a lamp twice the 2.3e-5 that was met",
    },
    // Shares take 4 bytes a pixel and channel, and where rays are cut before their ends 4 a pixel. A worker holds about a kilobyte a pixel beside one slice: at 16 pixels' distance
    // 50 of a column, so that from 1,024 rows on 96 bytes a pixel of the image suffice; below, the slices and what is left are
    // fixed. Tiles take 8 bytes for 256 texels, and a row runs along the side of a map alone.
    memory: MemoryBound { fixed: 32 << 20, a_pixel: 100, a_texel: 1 },
    options: &TABLE,
};

/// The integrator for tools.
#[derive(Debug, Clone, Copy)]
pub struct EpipolarTechnique;

/// The one instance of [`EpipolarTechnique`].
pub static TECHNIQUE: EpipolarTechnique = EpipolarTechnique;

impl Configurable for EpipolarTechnique {
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
            Target::Quality(level) => Ok(Options::for_quality(level, facts.size)),
            Target::Error(error) => {
                let range = "exact: between samples of a row no error is promised";
                TABLE.require(overrides, "cells", &["exact"], range)?;
                let range = "auto or 8: a promise takes as many terms as it needs";
                TABLE.require(overrides, "rank", &["auto", "8"], range)?;
                Options::for_error(error, facts.size)
            }
        }
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(Epipolar::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        // Spacing, tolerance, halvings, split: spacing and tolerance fall together; towards the end gaps are halved more
        // often. The first two share answers.
        let rungs = [
            [16.0, 0.5, 2.0, 1.0],
            [8.0, 0.4, 3.0, 1.0],
            [8.0, 0.4, 2.0, 1.0],
            [4.0, 0.2, 2.0, 1.0],
            [2.0, 0.1, 2.0, 1.0],
            [2.0, 0.05, 2.0, 1.0],
            [2.0, 0.02, 3.0, 0.5],
            [1.0, 0.05, 2.0, 1.0],
            [1.0, 0.02, 2.0, 0.0],
            [0.7, 0.02, 3.0, 0.25],
            [0.5, 0.03, 2.0, 0.25],
            [0.3, 0.02, 2.0, 0.25],
            [0.5, 0.01, 4.0, 0.25],
            [0.25, 0.003, 6.0, 0.0],
        ];
        let settings = rungs.map(|[spacing, tolerance, halvings, split]| {
            // Small or wide images are cut by the radian, not by the pixel.
            let is_cheap = tolerance >= 0.4 && (spacing > 8.0 || halvings > 2.0);
            let fewest = if is_cheap {
                50.0
            } else if halvings == f64::from(MOST_HALVINGS) {
                2000.0
            } else {
                400.0
            };
            vec![
                ("spacing", spacing),
                ("tolerance", tolerance),
                ("halvings", halvings),
                ("fewest", fewest),
                ("split", split),
                ("columns", if is_cheap { 1.0 } else { 0.0 }),
            ]
        });
        settings.into()
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

/// Enumerations that are options, by name.
macro_rules! choices {
    ($($choice:ty: $($name:literal $value:expr),+;)+) => {
        $(impl Choice for $choice {
            fn names() -> Vec<(&'static str, Self)> {
                vec![$(($name, $value)),+]
            }
        })+
    };
}

choices! {
    SumAlgorithm: "blocks" Self::Blocks, "sweep" Self::Sweep, "tree" Self::Tree, "cursor" Self::Cursor,
        "direct" Self::Direct;
    Cells: "exact" Self::Exact, "uniform" Self::Sampled(SampledCells::Uniform),
        "modes" Self::Sampled(SampledCells::Modes), "box" Self::Sampled(SampledCells::Box);
    NearEpipole: "bands" Self::Bands, "ring" Self::Ring;
    Resampling: "pixels" Self::Pixels, "rectified" Self::Rectified;
}

impl Choice for Factorisation {
    fn names() -> Vec<(&'static str, Self)> {
        Self::ALL.iter().map(|&kind| (kind.name(), kind)).collect()
    }
}
