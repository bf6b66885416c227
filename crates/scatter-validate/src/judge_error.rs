//! Why a shot could not be judged.

use scatter_core::OptionError;

use crate::figures::CompareError;
use crate::staged_shot::StageError;

/// A shot that could not be judged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JudgeError {
    /// The shot makes no frame, or a technique gave up.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// An option that a technique does not take.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A baseline that cannot do a shot.
    #[error("{shot}: the baseline cannot do it: {reason}")]
    Baseline {
        /// The shot.
        shot: String,
        /// The assumption that the shot breaks.
        reason: String,
    },
    /// A pool of one thread that cannot be made.
    #[error("one thread cannot be started: {0}")]
    Thread(rayon::ThreadPoolBuildError),
    /// No plan for a shot.
    #[error("{shot}: {reason}")]
    Plan {
        /// The shot.
        shot: String,
        /// Why.
        reason: String,
    },
    /// Images that cannot be compared.
    #[error("{shot}: {source}")]
    Compare {
        /// The shot.
        shot: String,
        /// Why not.
        source: CompareError,
    },
}
