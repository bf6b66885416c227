//! Options of the technique: which basis rows are filtered with, what is certified, and how slices are laid.

use epipolar::driver::{ErrorTarget, Refinement, Resampling, SliceSettings};
use scatter_core::{OptionError, Quality};

use crate::projective::OwnMapSettings;
use crate::storage::Storage;

/// The technique's id.
pub const ID: &str = "filtered-prefix";

/// What `game` aims at with its spacing, over what `epipolar` does. Its factors may take a fifth of a level's error, sums here take a
/// fifteenth of it. At `film` that would leave nothing for what a sample of gaps does not know, at `preview` pixels share answers,
/// which it does not see.
const GAME_SPACING: f32 = 1.25;

/// Standard deviations that are added to what a sample of gaps says, at `game`: where leaves are all over the picture gaps agree, and
/// there slices are wider than `epipolar`'s; where light is in a few gaps they are not.
const GAME_SIGMAS: f64 = 1.5;

/// Options of [`FilteredPrefix`](crate::FilteredPrefix).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// What rows are filtered with.
    pub basis: Basis,
    /// Coefficients of a filtered row: 4, 6 or 8 moments; 4 to 128 of a Fourier series, even.
    pub coefficients: u32,
    /// Whether pixels whose certificate exceeds [`Self::tolerance`] are integrated exactly.
    pub certified: bool,
    /// What the basis takes for the depth of a surface and of a view ray.
    pub depths: Depths,
    /// Between which view rays depths are told apart.
    pub depth_range: DepthRange,
    /// By what light rays are weighted.
    pub weighting: Option<Weighting>,
    /// How the shadow map is rectified; `None`: projectively where the frame has a source of maps and its epipole is far.
    pub rectification: Option<Rectification>,
    /// Texels of a projective map.
    pub own_map: OwnMapSettings,
    /// How pixels get a row's answers.
    pub fetch: Fetch,
    /// How filtered rows are kept.
    pub storage: Storage,
    /// Largest certificate of a pixel's share, of the share less the certificate; or of the unoccluded light where
    /// [`Self::absolute`] is set.
    pub tolerance: f64,
    /// Which slices are filtered at all.
    pub filter: Filter,
    /// Whether certificates are held against the unoccluded light instead of the pixel's own.
    pub absolute: bool,
    /// Columns of a slice that one texel may hide before the light rays behind it are told apart, 0 to 16: 0 is exact.
    pub uncut_columns: f32,
    /// Distance of slices \[pixels\], 1/16 to 16.
    pub spacing: f64,
    /// Slices a radian of the image's middle, at least, where the spacing is not measured; > 0.
    pub fewest_slices: f64,
    /// What the spacing is measured for; `None` takes it as it is.
    pub target: Option<ErrorTarget>,
    /// When a further slice goes between two that differ.
    pub refinement: Refinement,
    /// One column of a slice in how many has a view ray whose answers the pixels on its surface share, 1 to 16; 0: every pixel
    /// asks itself.
    pub shared_columns: u32,
}

/// What rows are filtered with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Basis {
    /// Power moments (Peters et al. 2016): few numbers, and a bound of the error.
    #[default]
    Moments,
    /// A Fourier series (Klehm et al. 2014): no bound.
    Fourier,
}

/// What the basis takes for the depth of a surface and of a view ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depths {
    /// Its place in the order of the picture's columns, so that neighbours are equally far apart everywhere.
    #[default]
    Places,
    /// The angle β to the light (Klehm et al. 2014, Section 4.1).
    Angles,
    /// `t/(1 + |t|)` of the tangent `t = −1/tan β` (that of Section 4.2, which has no bound): what filtered maps have.
    Tangents,
    /// `ln tan(β/2)`, which stretches the angles beside the epipole and the anti-epipole in proportion to how near they are. Section 5 asks
    /// for such a warp and gives no formula.
    Warp,
}

/// Between which view rays depths are told apart; what lies before them all or behind is summed apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthRange {
    /// Those that share their filtered rows.
    #[default]
    Band,
    /// All of the slice, as in the paper.
    Slice,
}

/// By what light rays are weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// All alike (Klehm et al. 2014, Section 3.1): average visibility.
    Average,
    /// By the light that reference rays have of them (Section 3.2).
    Reference,
}

/// Which slices are filtered, where pixels are certified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// Those whose exact integral costs more: all but those of a sun in a uniform medium.
    #[default]
    Auto,
    /// All of them.
    Always,
}

/// How pixels get a row's answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fetch {
    /// Every slice's own row of exact runs, at the very place where the view ray ends.
    #[default]
    Exact,
    /// From a filtered map, between four texels (Klehm et al. 2014, Section 5).
    Bilinear,
    /// From a filtered map, one texel.
    Nearest,
}

/// How the shadow map is rectified.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rectification {
    /// Rows of epipolar slices are read from the given map: what levels are held against.
    Resampled,
    /// Rows of a projective map of the technique's own (Klehm et al. 2014, Section 4.2), rendered by the frame's source of maps,
    /// or resampled from the given map where there is none. Where view rays run along the light there is no such map, and rows are
    /// resampled; [`RenderStats::modelled`](scatter_core::RenderStats::modelled) says which it was.
    Projective,
}

impl Default for Options {
    fn default() -> Self {
        Self::for_quality(Quality::default(), [1280, 960])
    }
}

impl Options {
    /// The preset of a level for images of a size: slices as [`epipolar`] lays them for that level, and a certificate that is a
    /// small part of what the level allows.
    pub fn for_quality(level: Quality, size: [u32; 2]) -> Self {
        let certificate = match level {
            Quality::Preview => 0.04,
            Quality::Game => 0.01,
            Quality::Film => 0.001,
        };
        let mut options = Self::of(&epipolar::Options::for_quality(level, size), certificate);
        if let Some(target) = options.target.as_mut().filter(|_| level == Quality::Game) {
            target.error *= GAME_SPACING;
            target.confidence.sigmas = GAME_SIGMAS;
        }
        options
    }

    /// Slices as [`epipolar`] has them, with a certificate.
    fn of(preset: &epipolar::Options, certificate: f64) -> Self {
        let SliceSettings { spacing, fewest_slices, target, refinement, shared_columns, .. } =
            preset.slices();
        Self {
            basis: Basis::Moments,
            coefficients: 6,
            certified: true,
            depths: Depths::Places,
            depth_range: DepthRange::Band,
            weighting: None,
            rectification: Some(Rectification::Resampled),
            own_map: OwnMapSettings { columns: 2048, rows: 1024, splits: 16 },
            fetch: Fetch::Exact,
            storage: Storage::F32,
            tolerance: certificate,
            filter: Filter::Auto,
            absolute: false,
            uncut_columns: preset.uncut_columns,
            spacing,
            fewest_slices,
            target,
            refinement,
            shared_columns,
        }
    }

    /// Options for an error of at most `error` (in (0, 1)) times each pixel's unoccluded radiance.
    ///
    /// Along a slice that is derived: half of `error` bounds the certificate of every pixel that is not integrated exactly. Between
    /// slices it is checked: where two neighbours differ by more than a twentieth of it, weighted by how far the pixel is from
    /// both, and still do half a pixel's 64th apart, the pixel is walked ray by ray. What is thinner than half a pixel and lies
    /// between two slices that agree is not seen.
    pub fn for_error(error: f64, size: [u32; 2]) -> Result<Self, OptionError> {
        if !(error > 0.0 && error < 1.0) {
            return Err(OptionError::BadValue {
                technique: ID,
                key: "error",
                value: error.to_string(),
                range: "a number in (0, 1)".into(),
            });
        }
        Ok(Self { absolute: true, ..Self::of(&epipolar::Options::for_error(error, size)?, 0.5 * error) })
    }

    /// How slices are laid and refined.
    pub fn slices(&self) -> SliceSettings {
        let Self { spacing, fewest_slices, target, refinement, shared_columns, .. } = *self;
        SliceSettings {
            spacing,
            fewest_slices,
            target,
            refinement,
            resampling: Resampling::Pixels,
            shared_columns,
        }
    }
}
