//! What cannot be encoded, and what to do about it. All of it is known before anything is recorded.

use scatter_core::{ModelError, Unsupported};
use scatter_kernels::{SetupError, TooLarge};

/// Why nothing was recorded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The device was made with less than WebGPU guarantees. Ask for `wgpu::Limits::default()` or more.
    #[error(
        "the device's limit {name} is {has} and {needed} is needed; ask for wgpu::Limits::default() or more"
    )]
    Limit {
        /// Its name in `wgpu::Limits`.
        name: &'static str,
        /// What is needed.
        needed: u64,
        /// What the device has.
        has: u64,
    },
    /// The frame breaks an assumption of the technique.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// The frame's parts do not fit each other.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A texture that does not fit the frame.
    #[error("the {which} texture {problem}; {cure}")]
    Texture {
        /// Which of [`Inputs`](crate::Inputs).
        which: &'static str,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        cure: &'static str,
    },
    /// A resource beyond what WebGPU guarantees.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// A call out of order.
    #[error("{0}")]
    Order(&'static str),
}

impl From<SetupError> for GpuError {
    fn from(error: SetupError) -> Self {
        match error {
            SetupError::Model(error) => Self::Model(error),
            SetupError::Unsupported(error) => Self::Unsupported(error),
            _ => Self::Unsupported(Unsupported { reason: error.to_string().into() }),
        }
    }
}
