//! The integrand as a sum of products `Σ Γₖ(γ)·Bₖ(β)` (Baran et al. 2010, Section 6), as tables that are read by linear
//! interpolation.
//!
//! For a directional light the visible part of a view ray at `y = 1/sin β` is, up to a factor of y,
//! `∫ e^{−x·y}·V dx` over `x = σt·γ`. With `e^{−x·y} ≈ Σ Γₖ(x)·Bₖ(y)` a slice sums Γ alone, and a pixel asks for
//!
//! ```text
//! vis = Σ Bₖ(y)·Sₖ / Σ Bₖ(y)·Pₖ(u),    Pₖ(u) = ∫₀ᵘ Γₖ,    Sₖ the same over lit parts only
//! ```
//!
//! which multiplies the closed form of its unshadowed ray. The quotient forgives much: whatever factor of y alone the
//! factorisation leaves out or gets wrong cancels, and vis is exact wherever everything or nothing is lit.
//!
//! The paper finds the factors by an SVD; [`Factorisation::Chebyshev`] writes them down, with a derived bound. For an
//! octave of y and an optical depth of 20, the worst over all visibilities, directions and lengths, beside the bound:
//!
//! | rank | Chebyshev | SVD, 64×64 samples |
//! | --- | --- | --- |
//! | 2 | 1.7e-2 of 3.8e-2 | 3.0e-2 of 6.5e-2 |
//! | 3 | 3.1e-3 of 5.4e-3 | 7.9e-3 of 2.2e-2 |
//! | 4 | 4.7e-4 of 1.3e-3 | 6.7e-3 of 1.7e-2 |
//! | 5 | 2.8e-4 of 7.1e-4 | 6.6e-3 of 1.7e-2 |
//!
//! (From there on it is the interpolation of the prefix, and for the SVD that of 64 samples.) At an optical depth of 1
//! the two err alike, to a few percent; Chebyshev takes a tenth of the time.
//!
//! Lamps have factors of their own, [`LampBands`]: fitted, with a measured error.

mod chebyshev;
mod lamp;
mod lamp_fit;
mod lamp_kernel;

use lamp_kernel::within;

#[cfg(feature = "svd")]
use crate::paper::Decomposition;

pub use lamp::{LampBands, LampFactors};
pub use lamp_kernel::LampMedium;

#[cfg(test)]
mod bessel;

/// Most products a factorisation has. Four lanes of two SIMD registers; no band of an octave asks for more (at eight
/// it leaves less than f32 does).
pub const MAX_RANK: usize = 8;

/// How the factors are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Factorisation {
    /// Chebyshev polynomials in 1/sin β with scaled Bessel functions: no decomposition, a derived bound.
    #[default]
    Chebyshev,
    /// The paper's: singular vectors of a 64×64 matrix, linearly upsampled.
    #[cfg(feature = "svd")]
    Svd,
}

impl Factorisation {
    /// All that this build has.
    pub const ALL: &[Self] = &[
        Self::Chebyshev,
        #[cfg(feature = "svd")]
        Self::Svd,
    ];

    /// A word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Chebyshev => "chebyshev",
            #[cfg(feature = "svd")]
            Self::Svd => "svd",
        }
    }
}

/// Factors of a sun in one band `y ∈ [1, ratio]`, y in units of the band's smallest 1/sin β, tabulated: `e^{−x·y} ≈ Σ Γₖ(x)·Bₖ(y)`
/// (Baran et al. 2010, Section 6). [`Self::bound`] bounds the error of a share for any visibility.
#[derive(Debug, Clone, Default)]
pub struct Factors {
    rank: usize,
    lanes: usize,
    optical_depth: f64,
    ratio: f64,
    prefix: Vec<f32>,
    weights: Vec<f32>,
    bound: f64,
}

/// Intervals of the weights' table. The error is `O(1/count²)` and part of [`Factors::bound`]: 1e-6 for an octave.
pub(crate) const WEIGHT_INTERVALS: usize = 512;

impl Factors {
    /// Factors of `e^{−x·y}` for a directional light, `x ∈ [0, optical_depth]`, `y ∈ [1, ratio]`.
    ///
    /// `rank` is taken into 1..=[`MAX_RANK`], `ratio` into [1, 8] (one octave is the use), and an `optical_depth`
    /// below 0 or not a number counts as 0. Costs some tens of microseconds with [`Factorisation::Chebyshev`].
    pub fn sun(kind: Factorisation, rank: usize, optical_depth: f64, ratio: f64) -> Self {
        let mut factors = Self::default();
        factors.rebuild(kind, rank, optical_depth, ratio);
        factors
    }

    /// [`Self::sun`] in place: allocates nothing when the tables were as long before.
    pub fn rebuild(&mut self, kind: Factorisation, rank: usize, optical_depth: f64, ratio: f64) {
        let (optical_depth, ratio) = domain(optical_depth, ratio);
        let rank = rank.clamp(1, MAX_RANK);
        let lanes = rank.next_power_of_two();
        let intervals = prefix_intervals(optical_depth * ratio);
        self.bound = match kind {
            Factorisation::Chebyshev => {
                let band = chebyshev::Band::new(rank, optical_depth, ratio);
                band.prefix(lanes, intervals, &mut self.prefix);
                band.weights(lanes, &mut self.weights);
                band.bound()
            }
            #[cfg(feature = "svd")]
            Factorisation::Svd => {
                let band = Decomposition::new(optical_depth, ratio);
                band.prefix(rank, lanes, intervals, &mut self.prefix);
                band.weights(rank, lanes, &mut self.weights);
                band.bound(rank)
            }
        };
        (self.rank, self.lanes, self.optical_depth, self.ratio) = (rank, lanes, optical_depth, ratio);
    }

    /// The smallest rank of [`Factorisation::Chebyshev`] whose [`Self::bound`] is at most `error`, if one is.
    pub fn rank_for(error: f64, optical_depth: f64, ratio: f64) -> Option<usize> {
        let (optical_depth, ratio) = domain(optical_depth, ratio);
        (1..=MAX_RANK).find(|&rank| chebyshev::Band::new(rank, optical_depth, ratio).bound() <= error)
    }

    /// How many products are summed, 1..=[`MAX_RANK`].
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Floats a node: the rank, padded with zeros to 1, 2, 4 or 8.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// The largest x of the table, > 0: an empty medium's is 1e-30.
    pub fn optical_depth(&self) -> f64 {
        self.optical_depth
    }

    /// The largest y of the table, ≥ 1.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// `Pₖ(u) = ∫₀ᵘ Γₖ(optical_depth·u′) du′`, `[node][lane]`; nodes are uniform in u from 0 to 1.
    ///
    /// The values are of the order of u: in an empty medium `P₀ = u`.
    pub fn prefix(&self) -> &[f32] {
        &self.prefix
    }

    /// `Bₖ(y)`, `[node][lane]`; nodes are uniform in y from 1 to the ratio.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The largest error of vis, for any visibility and any ray of the band.
    ///
    /// Radiances err by at most this share of the unshadowed radiance. Truncation, interpolation of both tables and
    /// rounding to f32 are in it, the rounding of the caller's own sums is not.
    pub fn bound(&self) -> f64 {
        self.bound
    }

    /// `Pₖ` at `u` in [0, 1], as a slice reads it.
    pub fn prefix_at(&self, u: f32, values: &mut [f32; MAX_RANK]) {
        interpolate(&self.prefix, self.lanes, u, values);
    }

    /// `Bₖ` at `y` in [1, ratio], as a pixel reads it.
    pub fn weights_at(&self, y: f32) -> [f32; MAX_RANK] {
        let mut values = [0.0; MAX_RANK];
        let span = (self.ratio - 1.0) as f32;
        interpolate(&self.weights, self.lanes, if span > 0.0 { (y - 1.0) / span } else { 0.0 }, &mut values);
        values
    }
}

/// Both parameters of a band, made usable.
fn domain(optical_depth: f64, ratio: f64) -> (f64, f64) {
    // The limit of an empty medium is reached long before 1e-30, and nothing is divided by 0.
    (within(optical_depth, 1e-30, 1e9), within(ratio, 1.0, 8.0))
}

/// What reading the tables adds to the error of vis.
///
/// `depth` is the optical depth of the longest ray, `amplified` is `Σ|Bₖ·Pₖ|` over its integral. Between nodes of the
/// prefix the weight is its own mean (see [`prefix_intervals`]); values and positions are rounded to f32.
pub(crate) fn reading_error(depth: f64, amplified: f64) -> f64 {
    /// Lit intervals for whose roundings there is room: two ends, each off by two of half an ulp.
    const INTERVALS: f64 = 16.0;
    depth / (4.0 * prefix_intervals(depth) as f64) + INTERVALS * 2.0 * f64::from(f32::EPSILON) * amplified
}

/// Intervals of the prefix table for a ray of optical depth `depth` from end to end.
///
/// Between nodes the weight along the ray is a constant where it should fall by the share `depth/count`. A visibility
/// that lights just the wrong half of every interval errs by an eighth of that, at most by a quarter where the ray ends
/// within an interval; a single edge errs by `(depth/count)²/8` of a ray of optical depth 1. So 512 intervals for each
/// unit keep the worst visibility below 5e-4 and an edge below 5e-7 up to the longest table. More would push the
/// table of a usual medium out of the fastest cache, as the longest is (a quarter of a megabyte at rank 4).
fn prefix_intervals(depth: f64) -> usize {
    const SHORTEST: usize = 1024;
    const LONGEST: usize = 16384;
    const PER_UNIT: f64 = 512.0;
    ((depth * PER_UNIT).ceil().min(LONGEST as f64) as usize).clamp(SHORTEST, LONGEST)
}

/// The table at `position` in [0, 1], linearly between its nodes.
fn interpolate(table: &[f32], lanes: usize, position: f32, values: &mut [f32; MAX_RANK]) {
    let intervals = table.len() / lanes - 1;
    let at = position.clamp(0.0, 1.0) * intervals as f32;
    let node = (at as usize).min(intervals - 1);
    let fraction = at - node as f32;
    let (left, right) = table[node * lanes..][..2 * lanes].split_at(lanes);
    values.fill(0.0);
    for ((value, l), r) in values.iter_mut().zip(left).zip(right) {
        *value = l + fraction * (r - l);
    }
}

#[cfg(test)]
mod tests;
