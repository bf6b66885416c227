//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use scatter_core::{
    Choice, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, OptionValue, Outlook,
    Rounding, SceneFacts, Target, Technique, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::estimate::predicted;
use crate::options::{ID, Lookup, MOST_CELLS, MOST_FRAMES, MOST_SIDE, Options};
use crate::technique::{CAPABILITIES, Froxel};

/// Distances that scenes have.
const DISTANCES: [f64; 2] = [1e-6, 1e9];

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!(
            "grid",
            "columns, rows and slices; never more than a column a pixel",
            "",
            OptionRange::Grid { most: MOST_SIDE, cells: MOST_CELLS },
            |options| OptionValue::Grid(options.grid),
            |options, value| options.grid = value.as_grid().unwrap_or(options.grid)
        ),
        option_row!(
            "frames",
            "jittered samples a froxel, averaged; 1 is its centre",
            "",
            OptionRange::Whole([1, MOST_FRAMES as u64]),
            frames as u32
        ),
        option_row!(
            "near",
            "where slices turn from equal lengths to exponential ones; auto is far/16, around a lamp at most its distance",
            "world units",
            OptionRange::WordOrReal(&["auto"], DISTANCES),
            |options| options.near.map_or(OptionValue::Word("auto"), OptionValue::from),
            |options, value| options.near = value.as_number()
        ),
        option_row!(
            "far",
            "where the last slice ends; auto is the longest ray, or where nothing is seen any more",
            "world units",
            OptionRange::WordOrReal(&["auto"], DISTANCES),
            |options| options.far.map_or(OptionValue::Word("auto"), OptionValue::from),
            |options, value| options.far = value.as_number()
        ),
        option_row!(
            "lookup",
            "what pixels read: the lit share of their own closed form, or radiance as engines do",
            Lookup,
            lookup
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "a camera-aligned grid with one shadow-map sample a cell, as engines ship it; an opponent",
    paper: "Wronski 2014, Hillaire 2015",
    misses: "shafts thinner than a froxel; light bleeds over columns where surfaces are near",
    capabilities: CAPABILITIES,
    rounding: Rounding {
        // A column a pixel of the worlds that this is asked on.
        overrides: &[("grid", "64x64x1024")],
        scaled: 1e-4,
        // 4 of 1024 samples, the longest slices of which are three times the mean.
        moved: 3.0 / 256.0,
        added: 1e-4,
        lit: 4e-5,
        derivation: "what is lit is the closed form in f32, of a sun 1e-5 at most, of a lamp twice the 1.2e-5 that core states. \
                     Shares are f32 sums of 1,024 weights: 2⁻²⁴ each at the worst, 6e-5. A world 1e4 units from the origin has \
                     coordinates good to 2e-12, so that a moved sample may fall on the neighbouring texel: it weighs one of \
                     1024 slices, on rays of a quarter of the longest one's length four times that",
    },
    // Two rows of 4096 columns and slices in three channels, and one more; tables of slices and passes are 2 MB. Eight bytes a
    // pixel are more than its line's and its column's footing.
    memory: MemoryBound { fixed: 640 << 20, a_pixel: 24, a_texel: 0 },
    options: &TABLE,
};

/// The technique for tools.
#[derive(Debug, Clone, Copy)]
pub struct FroxelTechnique;

/// The one instance of [`FroxelTechnique`].
pub static TECHNIQUE: FroxelTechnique = FroxelTechnique;

/// The grids of the trade-off, from the coarsest to the finest, with their passes: those of engines, then a column a pixel of
/// usual pictures.
const GRIDS: [([u32; 3], u32); 8] = [
    ([80, 45, 32], 1),
    ([160, 90, 64], 1),
    ([240, 135, 64], 1),
    ([240, 135, 128], 1),
    ([320, 180, 128], 8),
    ([640, 480, 256], 1),
    ([1280, 960, 1024], 1),
    ([1280, 960, 2048], 8),
];

impl Options {
    /// Sets one option from text; an error names key, value and range, or all keys.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        TABLE.set(self, key, value)
    }
}

impl Technique for FroxelTechnique {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        Ok(Box::new(Froxel::new(options_for(target, overrides, facts)?)))
    }

    fn resolved(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        Ok(TABLE.values(&options_for(target, overrides, facts)?))
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        let text = |(grid, frames)| {
            vec![("grid", OptionValue::Grid(grid).to_string()), ("frames", u32::to_string(&frames))]
        };
        GRIDS.into_iter().map(text).collect()
    }

    fn estimate(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        let options = options_for(target, overrides, &outlook.sample.facts)
            .map_err(|error| NoEstimate::because(error.to_string()))?;
        predicted(&options, outlook)
    }
}

/// The choice for a target with the caller's own values over it. Who gives a grid asks for no promise.
fn options_for(
    target: Target,
    overrides: &[(&str, &str)],
    facts: &SceneFacts,
) -> Result<Options, OptionError> {
    if let Target::Error(_) = target {
        TABLE.require(
            overrides,
            "lookup",
            &["share"],
            "share: radiance between samples promises no error",
        )?;
        TABLE.require(overrides, "far", &["auto"], "auto: behind a far that is set nothing is looked at")?;
    }
    let mut options = match target {
        Target::Quality(level) => Options::for_quality(level, facts),
        Target::Error(_) if overrides.iter().any(|(key, _)| *key == "grid") => Options::default(),
        Target::Error(error) => Options::for_error(error, facts)?,
    };
    TABLE.set_all(&mut options, overrides)?;
    TABLE.check(&options)?;
    Ok(options)
}

impl Choice for Lookup {
    fn names() -> Vec<(&'static str, Self)> {
        vec![("share", Self::Share), ("radiance", Self::Radiance)]
    }
}
