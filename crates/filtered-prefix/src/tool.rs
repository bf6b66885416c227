//! The technique as tools see it: its options as a table, its choice for a target, and its ladder of settings.

use epipolar::driver::MOST_HALVINGS;
use scatter_core::{
    Choice, Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable,
    OptionValue, Outlook, Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};

use crate::estimate::predicted;
use crate::filtered_map::most_bytes;
use crate::fourier::FOURIER_COUNTS;
use crate::moments::COUNTS;
use crate::options::{Basis, DepthRange, Depths, Fetch, Filter, ID, Options, Rectification, Weighting};
use crate::storage::Storage;
use crate::technique::{CAPABILITIES, FilteredPrefix};

static TABLE: OptionTable<Options> = OptionTable {
    technique: ID,
    rows: &[
        option_row!(
            "basis",
            "what rows are filtered with; moments bound their error, fourier does not",
            Basis,
            basis
        ),
        option_row!(
            "coefficients",
            "numbers of a filtered row: 4, 6 or 8 moments (6); an even number of a Fourier series, 4 to 128 (32), which other \
             numbers ask for",
            "",
            OptionRange::Whole([4, 128]),
            coefficients as u32
        ),
        option_row!(
            "certified",
            "whether pixels whose certificate does not suffice are integrated exactly (default on for moments; of a Fourier \
             series, which certifies nothing: all that are partly lit)",
            "",
            OptionRange::choice::<Switch>(),
            |options| Switch(options.certified).into(),
            |options, value| options.certified = value.choice::<Switch>().0
        ),
        option_row!(
            "depths",
            "what the basis takes for depth: places in the order of the picture's columns, angles to the light, bounded tangents of \
             them (as filtered maps do), or angles with a warp that stretches those beside the epipole",
            Depths,
            depths
        ),
        option_row!(
            "depth_range",
            "between which view rays depths are told apart: those of a band, or all of a slice (the paper)",
            DepthRange,
            depth_range
        ),
        option_row!("weighting", "by what light rays are weighted", Option<Weighting>, weighting),
        option_row!(
            "rectification",
            "whether rows are read from the given map, or from a projective map of the technique's own (auto: where the frame has a \
             source of maps and the epipole is far)",
            Option<Rectification>,
            rectification
        ),
        option_row!(
            "map_columns",
            "texels of a projective map along view rays, over all splits",
            "texels",
            OptionRange::Whole([1, 16384]),
            own_map.columns as u32
        ),
        option_row!(
            "map_rows",
            "texels of a projective map across view rays",
            "texels",
            OptionRange::Whole([1, 16384]),
            own_map.rows as u32
        ),
        option_row!(
            "splits",
            "maps that a projective map is cut into along view rays",
            "",
            OptionRange::Whole([1, 16]),
            own_map.splits as u32
        ),
        option_row!(
            "fetch",
            "how pixels get a row's answers: exact, or one bilinear or nearest fetch from a filtered projective map (the paper's \
             own way, which certifies nothing)",
            Fetch,
            fetch
        ),
        option_row!("storage", "how filtered rows are kept", Storage, storage),
        option_row!(
            "certificate",
            "largest certificate of a pixel, relative to its radiance",
            "",
            OptionRange::Real([0.0, 1.0]),
            tolerance as f64
        ),
        option_row!(
            "filter",
            "which slices are filtered, where pixels are certified; auto: those whose exact integral costs more",
            Filter,
            filter
        ),
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
            "split",
            "columns that one texel may hide before the light rays behind it are told apart",
            "columns",
            OptionRange::Real([0.0, 16.0]),
            uncut_columns as f32
        ),
        option_row!(
            "columns",
            "one column in how many has a view ray that pixels on one surface share; 0: every pixel asks itself",
            "",
            OptionRange::Whole([0, 16]),
            shared_columns as u32
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: ID,
    summary: "prefix-filtered rows of the shadow map, by power moments with a certificate or by a Fourier series",
    paper: "Klehm et al. 2014, Peters et al. 2016/17",
    misses: "what is thinner than the gap between two slices that agree",
    capabilities: CAPABILITIES,
    rounding: Rounding {
        overrides: &[("spacing", "0.25"), ("halvings", "0"), ("certificate", "0")],
        scaled: 1e-4,
        moved: 1e-4,
        added: 1e-6,
        lit: 4e-5,
        derivation: "with a certificate of 0 all partly lit pixels are integrated exactly over rows in f32; the closed form is one \
                     of f32, of a lamp twice the 2.3e-5 that was met",
    },
    memory: MemoryBound { fixed: 64 << 20, a_pixel: 132, a_texel: 1 },
    options: &TABLE,
};

/// The technique for tools.
#[derive(Debug, Clone, Copy)]
pub struct FilteredPrefixTechnique;

/// The one instance of [`FilteredPrefixTechnique`].
pub static TECHNIQUE: FilteredPrefixTechnique = FilteredPrefixTechnique;

impl Configurable for FilteredPrefixTechnique {
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
        let mut options = match target {
            Target::Quality(level) => Options::for_quality(level, facts.size),
            Target::Error(error) => Options::for_error(error, facts.size)?,
        };
        let last = |key: &str| overrides.iter().rev().find(|(own, _)| *own == key).map(|(_, value)| *value);
        // What only a series has asks for one, where no basis is named.
        let asks_for_series = last("storage") == Some("u8")
            || last("coefficients")
                .and_then(|text| text.parse::<u32>().ok())
                .is_some_and(|count| !COUNTS.contains(&count));
        let is_fourier = last("basis").map_or(asks_for_series, |basis| basis == "fourier");
        if is_fourier {
            options.basis = Basis::Fourier;
            // The paper's: 32 coefficients, and nothing certified unless it is asked for.
            (options.coefficients, options.certified) = (32, false);
        }
        // One fetch a pixel has no row to integrate.
        let fetches = last("fetch").is_some_and(|fetch| fetch != "exact");
        options.certified &= !fetches;
        if let Some(text) = last("coefficients")
            && let Ok(count) = text.parse::<u32>()
        {
            let [least, most] = FOURIER_COUNTS;
            let is_known = if is_fourier {
                (least..=most).contains(&count) && count % 2 == 0
            } else {
                COUNTS.contains(&count)
            };
            if !is_known {
                let range =
                    if is_fourier { "an even number from 4 to 128" } else { "4, 6 or 8 with basis moments" };
                return Err(bad_value("coefficients", text, range));
            }
        }
        if fetches && options.certified {
            return Err(bad_value(
                "certified",
                "on",
                "off with fetch=bilinear and fetch=nearest, which certify nothing",
            ));
        }
        if let Target::Error(_) = target {
            let certifies = last("certified").map_or(options.certified, |certified| certified == "on");
            keeps_promises(overrides, certifies)?;
        }
        if last("storage") == Some("u8") && !is_fourier {
            return Err(bad_value("storage", "u8", "f32 or f16 with basis moments, or set basis=fourier"));
        }
        Ok(options)
    }

    fn instance(&self, options: Options) -> Box<dyn VolumetricShadow> {
        Box::new(FilteredPrefix::new(options))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        // Spacing, tolerance, halvings, split, certificate: all fall together.
        let rungs = [
            [16.0, 0.5, 2.0, 1.0, 0.1],
            [8.0, 0.4, 2.0, 1.0, 0.1],
            [4.0, 0.2, 2.0, 1.0, 0.05],
            [2.0, 0.05, 2.0, 1.0, 0.02],
            [1.0, 0.05, 2.0, 1.0, 0.01],
            [0.5, 0.03, 2.0, 0.25, 0.005],
            [0.25, 0.003, 6.0, 0.0, 0.001],
        ];
        let settings = rungs.map(|[spacing, tolerance, halvings, split, certificate]| {
            let is_cheap = tolerance >= 0.4;
            // Small or wide images are cut by the radian, not by the pixel.
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
                ("certificate", certificate),
                ("columns", if is_cheap { 1.0 } else { 0.0 }),
            ]
        });
        settings.into()
    }

    fn predict(&self, options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        predicted(options, outlook)
    }

    fn bytes_of_own_maps(&self, options: &Options) -> u64 {
        let Options { rectification, own_map, fetch, .. } = *options;
        if rectification == Some(Rectification::Resampled) && fetch == Fetch::Exact {
            return 0;
        }
        // Depths, and those of one split as a source makes them.
        let depths = 2 * size_of::<f32>() as u64 * u64::from(own_map.columns) * u64::from(own_map.rows);
        match fetch {
            Fetch::Exact => depths,
            Fetch::Bilinear | Fetch::Nearest => depths + most_bytes(options) as u64,
        }
    }
}

/// An error where the caller sets a mode that promises no error.
fn keeps_promises(overrides: &[(&str, &str)], certifies: bool) -> Result<(), OptionError> {
    let range = "exact: one fetch a pixel promises no error";
    TABLE.require(overrides, "fetch", &["exact"], range)?;
    let range = "resampled: a map of the technique's own promises nothing of the given one";
    TABLE.require(overrides, "rectification", &["resampled"], range)?;
    if certifies {
        return Ok(());
    }
    Err(bad_value("certified", "off", "on: a row's numbers alone promise no error"))
}

fn bad_value(key: &'static str, value: &str, range: &str) -> OptionError {
    OptionError::BadValue { technique: ID, key, value: value.into(), range: range.into() }
}

impl Options {
    /// Sets one option from text; an error names key, value and range, or all keys.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), OptionError> {
        TABLE.set(self, key, value)
    }
}

/// A yes or a no, as `on` and `off`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Switch(bool);

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
    Switch: "on" Self(true), "off" Self(false);
    Basis: "moments" Self::Moments, "fourier" Self::Fourier;
    Depths: "places" Self::Places, "angles" Self::Angles, "tangents" Self::Tangents, "warp" Self::Warp;
    DepthRange: "band" Self::Band, "slice" Self::Slice;
    Weighting: "average" Self::Average, "reference" Self::Reference;
    Rectification: "resampled" Self::Resampled, "projective" Self::Projective;
    Fetch: "exact" Self::Exact, "bilinear" Self::Bilinear, "nearest" Self::Nearest;
    Filter: "auto" Self::Auto, "always" Self::Always;
    Storage: "f32" Self::F32, "f16" Self::F16, "u8" Self::U8;
}
