//! Options of the technique: how fine the grid is, how its slices lie along the rays, and how pixels read it.

use scatter_core::{OptionError, Quality, SceneFacts};

/// The technique's id.
pub const ID: &str = "froxel";

/// Most columns, rows and slices of a grid each. A row of cells of 4096 × 4096 is 201 MB in three channels, and two of them
/// are held at a time.
pub const MOST_SIDE: u32 = 4096;

/// Most cells of a grid: 2³². What is sampled in minutes is no choice for anybody; and 1280×960 pixels with 2048 slices
/// each, where every pixel is marched on its own, still fit.
pub const MOST_CELLS: u64 = 1 << 32;

/// Most jittered passes: the table of sample distances has a number for each of them and each slice.
pub const MOST_FRAMES: u32 = 64;

/// `far / near` where the options leave `near` open: the first slice of 64 is then a sixtieth of the mean one.
pub const NEAR_SHARE: f64 = 16.0;

/// Options of [`Froxel`](crate::Froxel).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Columns, rows and slices, each 1 to [`MOST_SIDE`], at most [`MOST_CELLS`] in all. There is never more than a column a
    /// pixel: a grid that is finer than the picture is taken at the picture's size.
    pub grid: [u32; 3],
    /// Jittered samples a froxel, averaged, 1 to [`MOST_FRAMES`]: what an engine accumulates over so many frames of a view
    /// that stands still. One is the froxel's centre. Where there is a column a pixel, samples stay on the pixels' rays.
    pub frames: u32,
    /// Distance at which slices turn from equal lengths (nearer) to lengths that grow with the distance (farther)
    /// \[world units\], > 0; `None` is `far/16` ([`NEAR_SHARE`]), around a lamp at most the eye's distance to it.
    pub near: Option<f64>,
    /// Where the last slice ends \[world units\], > 0; rays that go on keep its share of the light. `None` is where the longest
    /// ray ends, or where nothing that is scattered can be seen any more if that is nearer.
    pub far: Option<f64>,
    /// What pixels read of the grid.
    pub lookup: Lookup,
}

/// What pixels read of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lookup {
    /// The share of the light that is lit, between the eye and the pixel's surface; it multiplies the pixel's own unoccluded
    /// closed form. What nothing shadows is exact.
    #[default]
    Share,
    /// The accumulated radiance, linear in the columns, the rows and the slices' number: what engines do with a 3D texture.
    Radiance,
}

impl Default for Options {
    /// Wronski's grid, 160×90×64, one sample at each froxel's centre.
    fn default() -> Self {
        Self { grid: [160, 90, 64], frames: 1, near: None, far: None, lookup: Lookup::Share }
    }
}

impl Options {
    /// What a level chooses for a frame: a column a pixel, and as many slices as the marcher's preset has steps.
    ///
    /// Columns that are coarser than pixels blur shadows, and no number of slices mends it; so levels ask for grids that no
    /// engine can afford, and a level is missed where even these are too coarse (README, Measured). Where nothing casts a
    /// shadow, the grid is not looked at.
    pub fn for_quality(level: Quality, facts: &SceneFacts) -> Self {
        if !facts.casts_shadow && !facts.textured {
            return Self::default();
        }
        let slices = match level {
            Quality::Preview => 256,
            Quality::Game => 1024,
            Quality::Film => 4096,
        };
        let [columns, rows] = facts.size.map(|side| side.clamp(1, MOST_SIDE));
        Self { grid: bounded([columns, rows, slices]), ..Self::default() }
    }

    /// Options that promise an error of at most `error` (in (0, 1)) times each pixel's unoccluded value.
    ///
    /// There is no such promise but where nothing casts a shadow, and the error says so: a froxel's one sample stands for all
    /// of it, so that a shaft between two samples is missed however bright it is; rays that are short against the longest one
    /// cross few slices; and a column between pixels sees what none of them does.
    pub fn for_error(error: f64, facts: &SceneFacts) -> Result<Self, OptionError> {
        if !facts.casts_shadow && !facts.textured && error > 0.0 && error < 1.0 {
            // The closed form alone.
            return Ok(Self::default());
        }
        Err(OptionError::BadValue {
            technique: ID,
            key: "error",
            value: error.to_string(),
            range: "a quality level or a grid: a froxel's one sample stands for all of it, and no grid bounds what is \
                    thinner; where nothing casts a shadow, any error"
                .into(),
        })
    }
}

/// Fewer slices where the cells are too many.
fn bounded([columns, rows, slices]: [u32; 3]) -> [u32; 3] {
    let most = MOST_CELLS / (u64::from(columns) * u64::from(rows));
    [columns, rows, u64::from(slices).min(most).max(1) as u32]
}
