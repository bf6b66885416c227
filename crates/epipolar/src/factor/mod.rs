//! The integrand as a sum of products `Σ Γₖ(γ)·Bₖ(β)` (Baran et al. 2010, Section 6), as tables.

/// How the factors are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Factorisation {
    /// Chebyshev polynomials in 1/sin β with scaled Bessel functions: no decomposition, a derived bound.
    #[default]
    Chebyshev,
    /// The paper's: singular vectors of a 64×64 matrix, linearly upsampled.
    Svd,
}

/// Factors of one band, tabulated.
#[derive(Debug, Clone, Default)]
pub struct Factors {}
