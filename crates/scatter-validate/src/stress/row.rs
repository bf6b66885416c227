//! A row of the stress matrix: what is rendered, what is expected, how far a technique may be off.

use scatter_core::ModelError;

use crate::checks::HouseRule;
use crate::scenario::Scenario;

/// One extreme.
pub struct StressRow {
    /// The heading that it stands under.
    pub group: &'static str,
    /// What it is, in a few words.
    pub name: String,
    /// What is done.
    pub trial: Trial,
}

/// What a row does.
pub enum Trial {
    /// An image against what it should be.
    Image(Box<ImageTrial>),
    /// Two images that are bound by a law.
    Relation(Box<Relation>),
    /// Input that must be refused: the model's answer, and a word that its message must have.
    Refusal {
        /// Gives the input to the model.
        input: fn() -> Result<(), ModelError>,
        /// Names field, texel or cure.
        names: &'static str,
    },
    /// A rule of the house, on several scenes.
    House(HouseRule),
    /// A row that could not be made: an input of ours that the model refuses.
    Broken(ModelError),
}

/// An image and what it should be.
pub struct ImageTrial {
    /// The input.
    pub scenario: Scenario,
    /// What is expected.
    pub expectation: Expectation,
    /// How far the reference may be off, as a share of a pixel's unoccluded value.
    pub reference_tolerance: f64,
}

/// What an image should be.
pub enum Expectation {
    /// The brute-force image of the scenario.
    Exact,
    /// One value for all pixels and channels that was worked out elsewhere: published numbers and formulas.
    Value(f64),
}

/// Two images that are bound by a law.
pub struct Relation {
    /// The first input.
    pub first: Scenario,
    /// The second one.
    pub second: Scenario,
    /// What the second image is, pixel by pixel.
    pub law: Law,
    /// Factor from the first image to the second one.
    pub factor: f64,
    /// How far the reference may be off, as a share of the unoccluded value.
    pub reference_tolerance: f64,
}

/// How the second image follows from the first one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// The same pixel.
    Same,
    /// The pixel in the mirrored column.
    Mirrored,
    /// Nowhere brighter.
    NotBrighter,
}

/// How far the reference may be off, as a share of a pixel's unoccluded value: f64 inside, an f32 pixel (6e-8), and
/// crossings with texels that are good to 1e-9 of a ray; ten times that, because a hundred stretches may add up.
pub const ROUNDING: f64 = 1e-6;

/// How far a technique may be off where nothing casts a shadow: the closed form is all there is to compute, and f32
/// forms of it are stated to 5e-6 (sun) and 3e-5 (lamps); an f32 sum of a thousand terms loses 1e-4 at worst.
pub const CLOSED_FORM: f64 = 1e-4;

impl StressRow {
    /// A row that compares with the brute-force image.
    pub fn image(
        group: &'static str,
        name: impl Into<String>,
        scenario: Result<Scenario, ModelError>,
    ) -> Self {
        Self::expecting(group, name, scenario, Expectation::Exact, ROUNDING)
    }

    /// A row with an expectation and a tolerance of the reference of its own.
    pub fn expecting(
        group: &'static str,
        name: impl Into<String>,
        scenario: Result<Scenario, ModelError>,
        expectation: Expectation,
        reference_tolerance: f64,
    ) -> Self {
        let trial = match scenario {
            Ok(scenario) => Trial::Image(Box::new(ImageTrial { scenario, expectation, reference_tolerance })),
            Err(error) => Trial::Broken(error),
        };
        Self { group, name: name.into(), trial }
    }

    /// A row that compares two images.
    pub fn relation(
        group: &'static str,
        name: impl Into<String>,
        relation: Result<Relation, ModelError>,
    ) -> Self {
        let trial = match relation {
            Ok(relation) => Trial::Relation(Box::new(relation)),
            Err(error) => Trial::Broken(error),
        };
        Self { group, name: name.into(), trial }
    }
}
