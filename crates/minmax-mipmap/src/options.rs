//! Options of the technique: which mode answers, and how the modes on slices sample.

use scatter_core::{LightKind, Quality, SceneFacts};

use crate::slices::TreeKind;

/// The technique's id.
pub const ID: &str = "minmax-mipmap";

/// Most times that a gap between two slices is halved. Every one doubles the slices in the worst case.
pub const MOST_HALVINGS: u32 = 4;

/// Options of [`MinMaxMipmap`](crate::MinMaxMipmap). All but [`Self::mode`] are those of the modes on slices, with the defaults of
/// Yusov 2012, Section 9. Two options of mode `sampling` are not the paper's, and on by default: [`Self::edges`] and
/// [`Self::halvings`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How pixels are answered.
    pub mode: Mode,
    /// The tree over a slice's row.
    pub tree: TreeKind,
    /// Slices of a frame, at most, 24 to 16384.
    pub slices: u32,
    /// Samples of a slice, at most, 2 to 8192: as many as it has pixels along it, if those are fewer.
    pub samples: u32,
    /// One sample in how many is marched to begin with, 1 to 512.
    pub initial: u32,
    /// How many times as many are within a twentieth of the image's diagonal of the epipole, 1 to 64.
    pub density: u32,
    /// Relative difference of two depths from which on nothing is interpolated between them, 0.001 to 10.
    pub refinement: f32,
    /// At which edges further samples are marched.
    pub edges: Edges,
    /// How often the gap between two slices that differ is halved, 0 to [`MOST_HALVINGS`]: 0 is the paper's.
    pub halvings: u32,
    /// Relative difference of two samples' or two slices' light that is interpolated over, 0.001 to 1.
    pub contrast: f32,
    /// One pixel in how many, along each axis, is found from slices: 1, 2 or 4.
    pub downscale: Downscale,
    /// Whether pixels that no sample serves are marched, each by its own ray.
    pub correction: bool,
}

/// How pixels are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// Every pixel's own ray descends a quadtree over the whole shadow map: the exact walk's lit intervals, at every
    /// quality level.
    #[default]
    Exact,
    /// Every pixel's ray is marched through the trees of its two slices, between which it is interpolated.
    Slices,
    /// Some samples along slices are marched, the others and all pixels are interpolated (Engelhardt and Dachsbacher 2010, Yusov 2012).
    Sampling,
}

/// At which edges further samples are marched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Edges {
    /// Where depth jumps between two samples (Yusov 2012, Section 6.2).
    Depth,
    /// Also where a shadow's edge, as the slice's row has it, lies between the surfaces that two samples see (a look-up a
    /// sample), and half way between two samples whose light differs by more than [`Options::contrast`], until none do.
    #[default]
    Row,
}

/// One pixel in how many, along each axis, is found from slices; the others are interpolated between those.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Downscale {
    /// Every pixel.
    #[default]
    One,
    /// One in two.
    Two,
    /// One in four.
    Four,
}

impl Downscale {
    /// As a number.
    pub fn factor(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
        }
    }
}

impl Default for Options {
    /// What the default level chooses under a sun.
    fn default() -> Self {
        let [_, game, ..] = Self::ladder_of_sampling();
        game
    }
}

impl Options {
    /// The numbers of Engelhardt and Dachsbacher 2010 and Yusov 2012 for the modes on slices, with this crate's edges of rows.
    pub fn paper() -> Self {
        Self {
            mode: Mode::Exact,
            tree: TreeKind::Yusov,
            slices: 512,
            samples: 256,
            initial: 16,
            density: 2,
            refinement: 0.03,
            edges: Edges::Row,
            halvings: 2,
            contrast: 0.1,
            downscale: Downscale::One,
            correction: true,
        }
    }

    /// What a level chooses of the modes on slices for a frame; exact mode has one setting, and keeps every level. Around lamps
    /// light is steeper, and `game` takes a finer setting.
    pub fn for_quality(level: Quality, facts: &SceneFacts) -> Self {
        let [preview, game, _, fine, .., finest] = Self::ladder_of_sampling();
        match (level, facts.light) {
            (Quality::Preview, _) => preview,
            (Quality::Game, LightKind::Directional) => game,
            (Quality::Game, _) => fine,
            (Quality::Film, _) => finest,
        }
    }

    /// Settings of mode `sampling`, from the cheapest to [`Self::finest`]; what each reaches where is on the crate's page. Each takes
    /// about one and a half times as long as the one before it, the last four times.
    pub fn ladder_of_sampling() -> [Self; 7] {
        let of = |slices, samples, initial, halvings, contrast| Self {
            slices,
            samples,
            initial,
            halvings,
            contrast,
            ..Self::paper()
        };
        [
            Self::paper(),
            of(512, 640, 16, 2, 0.08),
            of(512, 640, 16, 3, 0.06),
            of(1024, 640, 8, 3, 0.05),
            of(1024, 1280, 4, 3, 0.05),
            of(2048, 2048, 4, 2, 0.04),
            Self::finest(),
        ]
    }

    /// Epipolar sampling at its finest: a slice a pixel of the border of an image of 1280×960, gaps halved three times where slices
    /// differ, a sample a pixel, and every one of them marched.
    pub fn finest() -> Self {
        Self {
            slices: 4096,
            samples: 4096,
            initial: 1,
            density: 1,
            refinement: 0.02,
            halvings: 3,
            contrast: 0.03,
            ..Self::paper()
        }
    }
}
