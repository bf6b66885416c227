//! What a plan may cost, or must keep.

use std::fmt;

use scatter_core::{Estimate, Quality};

use super::plan_error::PlanError;

/// A time counts as kept up to a quarter more, which is what predictions of times are good for: a setting that is
/// predicted just beyond is taken if what fits is much worse.
pub(super) const TIME_KEPT_WITHIN: f64 = 1.25;

/// What a plan may cost, or must keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// The error of a quality level, in the least time.
    Level(Quality),
    /// A level of one's own: p99 and relative RMSE against shadow-map truth both at most this, in (0, 1), in the least time.
    Error(f64),
    /// A bound for every pixel: `|T − R| ≤ ε` times its unoccluded value, ε in (0, 1), in the least time.
    Promise(f64),
    /// The least error within so many milliseconds a frame, > 0; up to a quarter more where what fits is much worse.
    Time(f64),
}

impl Budget {
    /// The largest error, where it is one.
    pub fn error(&self) -> Option<f64> {
        match *self {
            Self::Level(level) => Some(level.error()),
            Self::Error(error) => Some(error),
            Self::Promise(_) | Self::Time(_) => None,
        }
    }

    pub(super) fn check(&self) -> Result<(), PlanError> {
        let (what, value, is_sane, cure) = match *self {
            Self::Level(_) => return Ok(()),
            Self::Error(error) => ("error", error, error > 0.0 && error < 1.0, "a number in (0, 1)"),
            Self::Promise(error) => ("promise", error, error > 0.0 && error < 1.0, "a number in (0, 1)"),
            Self::Time(time) => {
                ("time", time, time > 0.0 && time.is_finite(), "a finite number of milliseconds above 0")
            }
        };
        if is_sane { Ok(()) } else { Err(PlanError::BadBudget { what, value, cure }) }
    }

    /// Whether what is predicted is within it.
    pub fn is_kept_by(&self, estimate: &Estimate) -> bool {
        match *self {
            Self::Level(_) | Self::Error(_) => self.error().is_some_and(|error| estimate.keeps <= error),
            // Derived, not predicted.
            Self::Promise(_) => true,
            Self::Time(time) => estimate.time_ms <= TIME_KEPT_WITHIN * time,
        }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Level(level) => write!(f, "level {level} ({} %)", 100.0 * level.error()),
            Self::Error(error) => write!(f, "an error of {} %", 100.0 * error),
            Self::Promise(error) => write!(f, "a promise of {} % of the unoccluded value", 100.0 * error),
            Self::Time(time) => write!(f, "{time} ms"),
        }
    }
}
