//! Options of the epipolar integrator, and the integrator as tools see it.

use std::fmt;
use std::str::FromStr;

use scatter_core::{
    OptionError, OptionInfo, Quality, SceneFacts, Target, Technique, TechniqueInfo, VolumetricShadow,
};

use crate::factor::Factorisation;
use crate::integrate::Integrator;
use crate::probe::Aim;
use crate::row::Cells;
use crate::slice_pass::{MOST_HALVINGS, Refinement, Resampling};
use crate::technique::{Epipolar, ID};

/// Options of [`Epipolar`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Distance of slices \[pixels\], 1/16 to 16.
    pub spacing: f64,
    /// Slices a radian of the image's middle, at least, where the spacing is not measured; > 0. What lies between two
    /// slices is a part of the view, not of a pixel: a thumbnail of 13×9 pixels has the shadows of the whole scene in it.
    pub fewest_slices: f64,
    /// What the spacing is measured for: it shrinks from `spacing` on until the aim is kept. `None` takes it as it is.
    pub aim: Option<Aim>,
    /// When a further slice goes between two that differ.
    pub refinement: Refinement,
    /// Terms of the factorisation, 1 to 8; `None` takes as many as `factor_error` asks for.
    pub rank: Option<u32>,
    /// Largest error of the factorisation, relative to a pixel's unoccluded radiance.
    pub factor_error: f64,
    /// How the integrand is factorised.
    pub factorisation: Factorisation,
    /// Columns of a slice that one texel may hide before the light rays behind it are told apart, 0 to 16: 0 is exact,
    /// 1 shifts a shadow's edge by up to half a column. Less within 64 columns of a slice's ends.
    pub split_over: f32,
    /// How lit runs are summed; `None` takes the fastest for each slice.
    pub integrator: Option<Integrator>,
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

/// Image diagonal \[pixels\] that the presets are tuned at: 1280×960. What a scene shows is as fine as the image as a
/// whole, so smaller images need slices that are closer together in pixels.
const TUNED_DIAGONAL: f64 = 1600.0;

/// Image diagonal \[pixels\] from which on the presets measure their spacing. Below it a sample of gaps says little.
const LEAST_MEASURED_DIAGONAL: f64 = 480.0;

/// RMS error, relative to the mean, that the presets aim at where they measure their spacing: 1 % is promised.
const MOST_RMS: f32 = 0.006;

impl Default for Options {
    fn default() -> Self {
        Self::for_quality(Quality::default(), [1280, 960])
    }
}

impl Options {
    /// The preset of a level for images of a size: spacing, tolerance and halvings were chosen on the built-in shots and
    /// on real scenes (README), at 640×480 with 2048² maps and at 1280×960 with 4096² maps.
    pub fn for_quality(level: Quality, size: [u32; 2]) -> Self {
        let (spacing, finest, tolerance, halvings, split, factor_error) = match level {
            Quality::Preview => (4.0, 2.0, 0.2, 2, 1.0, 2e-2),
            Quality::Game => (4.0, 0.25, 0.03, 3, 0.5, 6e-3),
            Quality::Film => (4.0, 0.125, 0.009, 3, 0.25, 2e-3),
        };
        // What the sample predicts is met by most scenes; half of it leaves room for the others.
        // The RMS is made by shadows' edges: in dark halls, relative to a mean of few lit pixels, they are most of it.
        let error = 0.5 * level.error() as f32;
        let aim =
            Aim { error, rms: if level == Quality::Preview { error } else { error.min(MOST_RMS) }, finest };
        let diagonal = f64::from(size[0]).hypot(f64::from(size[1]));
        let scale = (diagonal / TUNED_DIAGONAL).clamp(0.25, 1.0);
        // Small images have too few gaps for a sample, and cost little anyway.
        let measured = diagonal >= LEAST_MEASURED_DIAGONAL;
        Self {
            spacing: scale * if measured { spacing } else { 2.0 * finest },
            fewest_slices: 400.0,
            aim: measured.then_some(Aim { finest: finest * scale, ..aim }),
            refinement: Refinement { tolerance, floor: 0.01, halvings, walks_rest: false },
            rank: None,
            factor_error,
            factorisation: Factorisation::Chebyshev,
            // Half a column of a thumbnail is much of its picture.
            split_over: if measured { split * scale as f32 } else { 0.0 },
            integrator: None,
            cells: Cells::Exact,
            around: Around::Bands,
            resampling: Resampling::Pixels,
        }
    }

    /// Options for an error of at most `error` (in (0, 1)) times each pixel's unoccluded radiance.
    ///
    /// Along a slice that is derived: rows are exact, and the factorisation keeps half of `error` (for a lamp as
    /// measured, where its phase function allows). Between slices it is checked: where two neighbours differ by more
    /// than a twentieth of it, weighted by how far the pixel is from both, and still do half a pixel's 64th apart, the
    /// pixel is walked ray by ray. (A half leaves up to 219 of 19,000 pixels beyond, since the weight is a mean over where
    /// an edge may lie; a tenth still 34.) What is thinner than half a pixel and lies between two slices that agree is not
    /// seen; on 15 shots less than one pixel in a thousand is. Unoccluded means without the light's glass, too.
    pub fn for_error(error: f64, size: [u32; 2]) -> Result<Self, OptionError> {
        if !(error > 0.0 && error < 1.0) {
            return Err(OptionError::BadValue {
                technique: ID,
                key: "error",
                value: error.to_string(),
                range: "a number in (0, 1)",
            });
        }
        let fine = Self::for_quality(Quality::Film, size);
        let refinement = Refinement {
            tolerance: 0.05 * error as f32,
            floor: 1.0,
            halvings: MOST_HALVINGS,
            walks_rest: true,
        };
        Ok(Self { refinement, factor_error: 0.5 * error, spacing: 0.5, aim: None, split_over: 0.0, ..fine })
    }

    /// Sets one option from text.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        match key {
            "spacing" => {
                self.aim = None;
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

impl Choices for Option<Integrator> {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("auto", None),
        ("blocks", Some(Integrator::Blocks)),
        ("sweep", Some(Integrator::Sweep)),
        ("tree", Some(Integrator::Tree)),
        ("cursor", Some(Integrator::Cursor)),
        ("direct", Some(Integrator::Direct)),
    ];
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
        let rungs: [(f64, f64, u32, f64); 11] = [
            (8.0, 0.4, 2, 1.0),
            (4.0, 0.2, 2, 1.0),
            (2.0, 0.1, 2, 1.0),
            (2.0, 0.02, 3, 0.5),
            (1.0, 0.05, 2, 0.5),
            (1.0, 0.02, 3, 0.25),
            (0.8, 0.02, 3, 0.0),
            (0.5, 0.02, 3, 0.25),
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
