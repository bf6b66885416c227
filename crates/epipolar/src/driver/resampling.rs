//! How what slices found gets to pixels: each asks itself, or the paper's way (Baran et al. 2010).

/// How pixels get a slice's answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resampling {
    /// Every pixel queries with its own depth, or shares the answers of its surface ([`SliceSettings`](super::SliceSettings)).
    #[default]
    Pixels,
    /// The paper's: a slice is integrated for one view ray a column, with the depth of the pixel nearest to it, and
    /// pixels interpolate between the results.
    Rectified,
}
