//! Options of the technique: which mode answers.

/// The technique's id.
pub const ID: &str = "minmax-mipmap";

/// Options of [`MinMaxMipmap`](crate::MinMaxMipmap).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// How pixels are answered.
    pub mode: Mode,
}

/// How pixels are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// Every pixel's own ray descends a quadtree over the whole shadow map: the exact walk's lit intervals, at every
    /// quality level.
    #[default]
    Exact,
}
