//! Options of the epipolar integrator: what each means, the presets of the quality levels, and those for a promised error.

use scatter_core::{OptionError, Quality};

use crate::baran::sums::SumAlgorithm;
use crate::baran::{BaranSettings, Cells, Factorisation};
use crate::driver::{Confidence, ErrorTarget, MOST_HALVINGS, Refinement, Resampling, SliceSettings};
use crate::paper::RING_DEGREES;

/// The technique's id.
pub const ID: &str = "epipolar";

/// Options of [`Epipolar`](crate::Epipolar).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Distance of slices \[pixels\], 1/16 to 16.
    pub spacing: f64,
    /// Slices a radian of the image's middle, at least, where the spacing is not measured; > 0. What lies between two
    /// slices is a part of the view, not of a pixel: a thumbnail of 13×9 pixels has the shadows of the whole scene in it.
    pub fewest_slices: f64,
    /// What the spacing is measured for: it shrinks from `spacing` on until the aim is kept. `None` takes it as it is.
    pub target: Option<ErrorTarget>,
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
    pub uncut_columns: f32,
    /// How lit runs are summed; `None` takes the fastest for each slice.
    pub sum_algorithm: Option<SumAlgorithm>,
    /// Where the cells of rectified rows lie.
    pub cells: Cells,
    /// What is done around the epipole.
    pub near_epipole: NearEpipole,
    /// How pixels get a slice's answers.
    pub resampling: Resampling,
    /// One column of a slice in how many has a view ray whose answers the pixels on its surface share, 1 to 16, rounded down to a
    /// power of two; 0: every pixel asks with its own depth. `None`: 1 where the spacing is measured, else 0. Slices that are
    /// less than 2.5 pixels apart, times the columns, share nothing, since asking is faster there.
    pub shared_columns: Option<u32>,
}

/// What is done around the epipole, where view rays and light rays are nearly parallel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NearEpipole {
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
const LEAST_MEASURED_DIAGONAL: f64 = 180.0;

/// Image diagonal \[pixels\] from which on texels may hide parts of columns, and samples are large.
const LEAST_LARGE_DIAGONAL: f64 = 400.0;

/// The closest slices that are measured \[pixels\], whatever the level: in the dark a preview may need what a film needs. Coarser,
/// and rooms whose walls are one sheet missed `preview` and `game`.
const FINEST: f64 = 0.0625;

/// What the presets aim at, of their level's error: p99 and RMS; what a sample does not know of itself is added there. Not below
/// film's tolerance, up to which slices may differ: no spacing would keep it, however fine. Pixels of previews share answers,
/// which the sample does not see; and the farther slices are apart, the fewer gaps make the RMS.
const fn room(level: Quality) -> [f32; 2] {
    match level {
        Quality::Preview => [0.65, 0.7],
        Quality::Game => [0.75, 0.65],
        Quality::Film => [0.85, 0.8],
    }
}

/// How sure the presets are of their spacing. What `film` tolerates shows in fewer gaps than what others do: with 80 of them a spot
/// among slats missed it by 3 to 16 %. Where a beam was measured at two pixels alone, `game` missed it by a fiftieth with 0.8 beyond.
const fn confidence(level: Quality) -> Confidence {
    match level {
        Quality::Preview | Quality::Game => Confidence { gaps: 80, sigmas: 0.75, beyond: 0.5 },
        Quality::Film => Confidence { gaps: 160, sigmas: 1.0, beyond: 0.8 },
    }
}

impl Default for Options {
    fn default() -> Self {
        Self::for_quality(Quality::default(), [1280, 960])
    }
}

impl Options {
    /// The preset of a level for images of a size: spacing, tolerance and halvings were chosen on the built-in shots and
    /// on real scenes (README), at 640×480 with 2048² maps and at 1280×960 with 4096² maps.
    pub fn for_quality(level: Quality, size: [u32; 2]) -> Self {
        let ([spacing, widest, of_small], tolerance, halvings, split, factor_error) = match level {
            Quality::Preview => ([8.0, 16.0, 0.25], 0.08, 3, 1.0, 2e-2),
            Quality::Game => ([4.0, 16.0, 0.125], 0.04, 3, 0.5, 6e-3),
            Quality::Film => ([2.0, 8.0, 0.0625], 0.009, 3, 0.0, 2e-3),
        };
        let diagonal = f64::from(size[0]).hypot(f64::from(size[1]));
        // Small images have too few gaps for a sample, and cost little anyway.
        let measured = diagonal >= LEAST_MEASURED_DIAGONAL;
        // Slices of small previews are closer than halving them twice would bring others.
        let (tolerance, halvings) =
            if level == Quality::Preview && !measured { (0.2, 2) } else { (tolerance, halvings) };
        let is_small = diagonal < LEAST_LARGE_DIAGONAL;
        // Few gaps of a small picture tell less of the others.
        let of_room = if is_small { [0.85, 0.5] } else { [1.0; 2] };
        let aim = |index: usize| room(level)[index] * of_room[index] * level.error() as f32;
        let scale = (diagonal / TUNED_DIAGONAL).clamp(0.125, 1.0);
        Self {
            spacing: if measured { scale * spacing } else { of_small },
            fewest_slices: 400.0,
            target: measured.then(|| ErrorTarget {
                error: aim(0),
                rms: aim(1),
                within: [FINEST, widest].map(|spacing| scale * spacing),
                confidence: confidence(level),
            }),
            // Small images cost little, and nobody tells them how dark they are.
            refinement: Refinement {
                tolerance,
                floor: if measured { 0.01 } else { 0.001 },
                halvings,
                walks_rest: false,
            },
            rank: None,
            factor_error,
            factorisation: Factorisation::Chebyshev,
            // Half a column of a small picture is much of it, and no sample of slices sees what all of them leave out.
            uncut_columns: if is_small { 0.0 } else { split * scale as f32 },
            sum_algorithm: None,
            cells: Cells::Exact,
            near_epipole: NearEpipole::Bands,
            resampling: Resampling::Pixels,
            shared_columns: None,
        }
    }

    /// How slices are laid and refined.
    pub fn slices(&self) -> SliceSettings {
        let Self { spacing, fewest_slices, target, refinement, resampling, .. } = *self;
        let shared_columns = self.shared_columns.unwrap_or(u32::from(target.is_some()));
        SliceSettings { spacing, fewest_slices, target, refinement, resampling, shared_columns }
    }

    /// How slices are summed.
    pub fn sums(&self) -> BaranSettings {
        let Self {
            rank, factor_error, factorisation, uncut_columns, sum_algorithm, cells, near_epipole, ..
        } = *self;
        let ring_sine = match near_epipole {
            NearEpipole::Bands => 0.0,
            NearEpipole::Ring => RING_DEGREES.to_radians().sin(),
        };
        BaranSettings {
            rank,
            factor_error,
            factorisation,
            uncut_columns,
            algorithm: sum_algorithm,
            cells,
            ring_sine,
        }
    }

    /// Options for an error of at most `error` (in (0, 1)) times each pixel's unoccluded radiance.
    ///
    /// Along a slice that is derived: rows are exact, and the factorisation keeps half of `error` (for a lamp as
    /// measured, where its phase function allows). Between slices it is checked: where two neighbours differ by more
    /// than a twentieth of it, weighted by how far the pixel is from both, and still do half a pixel's 64th apart, the
    /// pixel is walked ray by ray. (A half leaves up to 219 of 19,000 pixels beyond, since the weight is a mean over where
    /// an edge may lie; a tenth still 34.) What is thinner than half a pixel and lies between two slices that agree is not
    /// seen; on 15 shots less than one pixel in a thousand is. Unoccluded means without the light's texture, too.
    pub fn for_error(error: f64, size: [u32; 2]) -> Result<Self, OptionError> {
        if !(error > 0.0 && error < 1.0) {
            return Err(OptionError::BadValue {
                technique: ID,
                key: "error",
                value: error.to_string(),
                range: "a number in (0, 1)".into(),
            });
        }
        let fine = Self::for_quality(Quality::Film, size);
        let refinement = Refinement {
            tolerance: 0.05 * error as f32,
            floor: 1.0,
            halvings: MOST_HALVINGS,
            walks_rest: true,
        };
        Ok(Self {
            refinement,
            factor_error: 0.5 * error,
            spacing: 0.5,
            target: None,
            uncut_columns: 0.0,
            ..fine
        })
    }
}
