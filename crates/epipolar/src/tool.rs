//! The integrator as tools see it: options as text, what it can do, and its ladder of settings.

use std::fmt;
use std::str::FromStr;

use scatter_core::{OptionError, OptionInfo, SceneFacts, Target, Technique, TechniqueInfo, VolumetricShadow};

use crate::baran::sums::SumAlgorithm;
use crate::baran::{Cells, Factorisation};
use crate::driver::{MOST_HALVINGS, Resampling};
use crate::options::{Around, ID, Options};
use crate::paper::SampledCells;
use crate::technique::Epipolar;

impl Options {
    /// Sets one option from text.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        match key {
            "spacing" => {
                self.target = None;
                self.spacing = INFO.parse("spacing", value, |s| (1.0 / 16.0..=16.0).contains(s))?;
            }
            "fewest" => {
                self.fewest_slices = INFO.parse("fewest", value, |n| (1.0..=1e4).contains(n))?;
            }
            "tolerance" => {
                self.refinement.tolerance = INFO.parse("tolerance", value, |t| (0.0..=1.0).contains(t))?;
            }
            "halvings" => {
                self.refinement.halvings =
                    INFO.parse("halvings", value, |h| (0..=MOST_HALVINGS).contains(h))?;
            }
            "split" => self.uncut_columns = INFO.parse("split", value, |s| (0.0..=16.0).contains(s))?,
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
    const NAMES: &'static [(&'static str, Self)] = &[
        ("chebyshev", Self::Chebyshev),
        #[cfg(feature = "svd")]
        ("svd", Self::Svd),
    ];
}

impl Choices for Option<SumAlgorithm> {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("auto", None),
        ("blocks", Some(SumAlgorithm::Blocks)),
        ("sweep", Some(SumAlgorithm::Sweep)),
        ("tree", Some(SumAlgorithm::Tree)),
        ("cursor", Some(SumAlgorithm::Cursor)),
        ("direct", Some(SumAlgorithm::Direct)),
    ];
}

impl Choices for Cells {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("exact", Self::Exact),
        ("uniform", Self::Sampled(SampledCells::Uniform)),
        ("modes", Self::Sampled(SampledCells::Modes)),
        ("box", Self::Sampled(SampledCells::Box)),
    ];
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
    cannot: &["orthographic cameras", "cascades", "lamps in media with |g| > 0.99"],
    options: &[
        OptionInfo {
            key: "spacing",
            summary: "distance of slices; without it, it is measured what the scene needs",
            unit: "pixels",
            range: "a number from 0.0625 to 16",
            default: || "measured".into(),
        },
        OptionInfo {
            key: "fewest",
            summary: "slices a radian, at least, whatever the spacing is set to",
            unit: "",
            range: "a number from 1 to 10000",
            default: || Options::default().fewest_slices.to_string(),
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
            default: || Options::default().uncut_columns.to_string(),
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
            range: "auto, blocks, sweep, tree, cursor or direct",
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
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let mut options = match target {
            Target::Quality(level) => Options::for_quality(level, facts.size),
            Target::Error(error) => Options::for_error(error, facts.size)?,
        };
        for (key, value) in overrides {
            options.set(key, value)?;
        }
        Ok(Box::new(Epipolar::new(options)))
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        // Spacing and tolerance fall together; towards the end gaps are halved more often.
        let rungs: [(f64, f64, u32, f64); 12] = [
            (8.0, 0.4, 2, 1.0),
            (4.0, 0.2, 2, 1.0),
            (2.0, 0.1, 2, 1.0),
            (2.0, 0.05, 2, 1.0),
            (2.0, 0.02, 3, 0.5),
            (1.0, 0.05, 2, 1.0),
            (1.0, 0.02, 2, 0.0),
            (0.7, 0.02, 3, 0.25),
            (0.5, 0.03, 2, 0.25),
            (0.3, 0.02, 2, 0.25),
            (0.5, 0.01, 4, 0.25),
            (0.25, 0.003, 6, 0.0),
        ];
        let values = |(spacing, tolerance, halvings, split): (f64, f64, u32, f64)| {
            // Small or wide images are cut by the radian, not by the pixel.
            let fewest = if halvings == MOST_HALVINGS { 2000.0 } else { 400.0 };
            let numbers = [
                spacing.to_string(),
                tolerance.to_string(),
                halvings.to_string(),
                fewest.to_string(),
                split.to_string(),
            ];
            ["spacing", "tolerance", "halvings", "fewest", "split"].into_iter().zip(numbers).collect()
        };
        rungs.into_iter().map(values).collect()
    }
}
