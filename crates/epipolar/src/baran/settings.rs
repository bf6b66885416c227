//! How Baran's integrator sums: which factors, which cells, which algorithm, and what happens around the epipole.

use super::factor::Factorisation;
use super::sums::SumAlgorithm;
use crate::paper::SampledCells;

/// Largest |g| of a medium around a lamp: a narrower lobe than that falls between the nodes of the factors' tables.
pub const MOST_LAMP_G: f64 = 0.99;

/// Settings of [`Baran`](super::Baran).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaranSettings {
    /// Terms of the factorisation, 1 to 8; `None` takes as many as `factor_error` asks for.
    pub rank: Option<u32>,
    /// Largest error of the factorisation, relative to a pixel's unoccluded radiance.
    pub factor_error: f64,
    /// How the integrand is factorised.
    pub factorisation: Factorisation,
    /// Columns of a slice that one texel may hide before the light rays behind it are told apart, 0 to 16: 0 is exact.
    pub uncut_columns: f32,
    /// How lit runs are summed; `None` takes the fastest for each slice.
    pub algorithm: Option<SumAlgorithm>,
    /// Where the cells of rectified rows lie.
    pub cells: Cells,
    /// Sine of the angle to the light below which pixels are left to be walked (the paper's ring); 0 for none.
    pub ring_sine: f64,
}

/// Where the cells of a row lie, and how many depths each of them knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cells {
    /// Cells end where the line crosses from texel to texel: the map's visibility, exactly.
    #[default]
    Exact,
    /// The paper's: a cell a texel column, with samples in it.
    Sampled(SampledCells),
}
