//! Why a frame is not rendered.

use std::borrow::Cow;

use crate::map_source::MapError;

/// The assumption of a technique that a frame breaks.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unsupported: {reason}")]
pub struct Unsupported {
    /// What the frame has and the technique cannot do, and what to give instead, in words.
    pub reason: Cow<'static, str>,
}

/// Why a render failed. `out` holds nothing of use then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The frame breaks an assumption; [`VolumetricShadow::supports`](crate::VolumetricShadow::supports) says so beforehand.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// A map that was asked for could not be made.
    #[error("map source: {0}")]
    Map(#[from] MapError),
}
