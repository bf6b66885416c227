//! Which tree stands over a slice's row.

/// Which tree stands over a slice's row. All three find the same lit runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TreeKind {
    /// Over depths as the light sees them; a view ray's depth is linear along the row, and its two ends are compared
    /// (Yusov 2012, Section 4).
    #[default]
    Yusov,
    /// Over rectified depths: the view ray (a number of columns, in the place of the angle β) at which a texel's shadow begins, so
    /// that a view ray is one constant query (Chen et al. 2011). A division a texel's end more.
    Chen,
    /// None: every texel column is visited. The march that the trees must equal.
    None,
}
