//! Options of the epipolar integrator, and the integrator as tools see it.

use std::fmt;
use std::str::FromStr;

use scatter_core::{
    OptionError, OptionInfo, Quality, SceneFacts, Target, Technique, TechniqueInfo, VolumetricShadow,
};

use crate::factor::Factorisation;
use crate::integrate::Integrator;
use crate::row::Cells;
use crate::slice_pass::{MOST_HALVINGS, Refinement, Resampling};
use crate::technique::{Epipolar, ID};

/// Options of [`Epipolar`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Distance of slices \[pixels\], 1/16 to 16.
    pub spacing: f64,
    /// When a further slice goes between two that differ.
    pub refinement: Refinement,
    /// Terms of the factorisation, 1 to 8; `None` takes as many as `factor_error` asks for.
    pub rank: Option<u32>,
    /// Largest error of the factorisation, relative to a pixel's unoccluded radiance.
    pub factor_error: f64,
    /// How the integrand is factorised.
    pub factorisation: Factorisation,
    /// Columns of a slice that one texel may hide before the light rays behind it are told apart, 0 to 16: 0 is exact,
    /// 1 shifts a shadow's edge by up to half a column.
    pub split_over: f32,
    /// How lit runs are summed.
    pub integrator: Integrator,
    /// Where the cells of rectified rows lie.
    pub cells: Cells,
    /// What is done around the epipole.
    pub around: Around,
    /// How pixels get a slice's answers.
    pub resampling: Resampling,
}

/// What is done around the epipole, where view rays and light rays are nearly parallel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Around {
    /// More bands of factors, of equal ratios of 1/sin β.
    #[default]
    Bands,
    /// The paper's: pixels within two degrees are walked through the map, ray by ray.
    Ring,
}

impl Default for Options {
    fn default() -> Self {
        Self::for_quality(Quality::default())
    }
}

impl Options {
    /// The preset of a level.
    pub fn for_quality(level: Quality) -> Self {
        let (spacing, halvings, factor_error) = match level {
            Quality::Preview => (4.0, 3, 1e-2),
            Quality::Game => (4.0, 4, 3e-3),
            Quality::Film => (2.0, 4, 1e-3),
        };
        let tolerance = level.error() as f32;
        Self {
            spacing,
            refinement: Refinement { tolerance, floor: 0.01, halvings },
            rank: None,
            factor_error,
            factorisation: Factorisation::Chebyshev,
            split_over: 0.0,
            integrator: Integrator::Sweep,
            cells: Cells::Exact,
            around: Around::Bands,
            resampling: Resampling::Pixels,
        }
    }

    /// Sets one option from text.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        match key {
            "spacing" => self.spacing = INFO.parse("spacing", value, |s| (1.0 / 16.0..=16.0).contains(s))?,
            "tolerance" => {
                self.refinement.tolerance = INFO.parse("tolerance", value, |t| (0.0..=1.0).contains(t))?;
            }
            "halvings" => {
                self.refinement.halvings =
                    INFO.parse("halvings", value, |h| (0..=MOST_HALVINGS).contains(h))?;
            }
            "split" => self.split_over = INFO.parse("split", value, |s| (0.0..=16.0).contains(s))?,
            "rank" => self.rank = INFO.parse::<Rank>("rank", value, |_| true)?.0,
            "factorisation" => self.factorisation = choice("factorisation", value)?,
            "integrator" => self.integrator = choice("integrator", value)?,
            "cells" => self.cells = choice("cells", value)?,
            "around" => self.around = choice("around", value)?,
            "resampling" => self.resampling = choice("resampling", value)?,
            _ => {
                INFO.option(key)?;
            }
        }
        Ok(())
    }
}

/// `auto` or a number of terms.
struct Rank(Option<u32>);

impl FromStr for Rank {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "auto" => Ok(Self(None)),
            _ => {
                text.parse().ok().filter(|rank| (1..=8).contains(rank)).map(|rank| Self(Some(rank))).ok_or(())
            }
        }
    }
}

fn choice<T: Choices>(key: &str, value: &str) -> Result<T, OptionError> {
    INFO.parse::<Named<T>>(key, value, |_| true).map(|named| named.0)
}

/// A choice with a name for each of its values.
struct Named<T>(T);

/// Values by name.
trait Choices: Sized + Copy + PartialEq + 'static {
    const NAMES: &'static [(&'static str, Self)];
}

impl Choices for Factorisation {
    const NAMES: &'static [(&'static str, Self)] = &[("chebyshev", Self::Chebyshev), ("svd", Self::Svd)];
}

impl Choices for Integrator {
    const NAMES: &'static [(&'static str, Self)] =
        &[("sweep", Self::Sweep), ("tree", Self::Tree), ("cursor", Self::Cursor), ("direct", Self::Direct)];
}

impl Choices for Cells {
    const NAMES: &'static [(&'static str, Self)] =
        &[("exact", Self::Exact), ("uniform", Self::Uniform), ("modes", Self::Modes), ("box", Self::Box)];
}

impl Choices for Around {
    const NAMES: &'static [(&'static str, Self)] = &[("bands", Self::Bands), ("ring", Self::Ring)];
}

impl Choices for Resampling {
    const NAMES: &'static [(&'static str, Self)] =
        &[("pixels", Self::Pixels), ("rectified", Self::Rectified)];
}

impl<T: Choices> FromStr for Named<T> {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        T::NAMES.iter().find(|(name, _)| *name == text).map(|&(_, value)| Self(value)).ok_or(())
    }
}

impl<T: Choices> fmt::Display for Named<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::NAMES.iter().find(|(_, value)| *value == self.0).map_or("", |(name, _)| name))
    }
}

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "visibility summed along epipolar slices, shared by all view rays of a slice",
    paper: "Baran et al. 2010",
    lights: &["directional", "point", "spot", "textured"],
    media: &["grey", "rgb", "every sum of phase functions"],
    cameras: &["perspective", "off-centre"],
    cannot: &["orthographic cameras", "cascades"],
    options: &[
        OptionInfo {
            key: "spacing",
            summary: "distance of slices",
            unit: "pixels",
            range: "a number from 0.0625 to 16",
            default: || Options::default().spacing.to_string(),
        },
        OptionInfo {
            key: "tolerance",
            summary: "difference of neighbouring slices, relative to the radiance, that is interpolated over",
            unit: "",
            range: "a number from 0 to 1",
            default: || Options::default().refinement.tolerance.to_string(),
        },
        OptionInfo {
            key: "halvings",
            summary: "how often the gap between slices that differ is halved",
            unit: "",
            range: "an integer from 0 to 6",
            default: || Options::default().refinement.halvings.to_string(),
        },
        OptionInfo {
            key: "split",
            summary: "columns that one texel may hide before the light rays behind it are told apart",
            unit: "columns",
            range: "a number from 0 to 16",
            default: || Options::default().split_over.to_string(),
        },
        OptionInfo {
            key: "rank",
            summary: "terms of the factorisation",
            unit: "",
            range: "auto, or an integer from 1 to 8",
            default: || Options::default().rank.map_or("auto".into(), |rank| rank.to_string()),
        },
        OptionInfo {
            key: "factorisation",
            summary: "how the integrand is factorised",
            unit: "",
            range: "chebyshev or svd",
            default: || Named(Options::default().factorisation).to_string(),
        },
        OptionInfo {
            key: "integrator",
            summary: "how lit runs are summed",
            unit: "",
            range: "sweep, tree, cursor or direct",
            default: || Named(Options::default().integrator).to_string(),
        },
        OptionInfo {
            key: "cells",
            summary: "where the cells of rectified rows lie, and how many depths each knows",
            unit: "",
            range: "exact, uniform, modes or box",
            default: || Named(Options::default().cells).to_string(),
        },
        OptionInfo {
            key: "around",
            summary: "what is done around the epipole",
            unit: "",
            range: "bands or ring",
            default: || Named(Options::default().around).to_string(),
        },
        OptionInfo {
            key: "resampling",
            summary: "whether every pixel asks with its own depth, or rectified results are resampled",
            unit: "",
            range: "pixels or rectified",
            default: || Named(Options::default().resampling).to_string(),
        },
    ],
};

/// The integrator for tools.
#[derive(Debug, Clone, Copy)]
pub struct EpipolarTechnique;

/// The one instance of [`EpipolarTechnique`].
pub static TECHNIQUE: EpipolarTechnique = EpipolarTechnique;

impl Technique for EpipolarTechnique {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let mut options = match target {
            Target::Quality(level) => Options::for_quality(level),
            Target::Error(_) => Options::for_quality(Quality::Film),
        };
        for (key, value) in overrides {
            options.set(key, value)?;
        }
        Ok(Box::new(Epipolar::new(options)))
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        [8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125]
            .iter()
            .map(|s: &f64| vec![("spacing", s.to_string())])
            .collect()
    }
}
