//! What a technique predicts of itself before it renders: time, error, memory.

use std::fmt;

use crate::frame::Frame;
use crate::machine::Machine;
use crate::scene_sample::SceneSample;

/// What a prediction rests on.
#[derive(Clone, Copy)]
pub struct Outlook<'a> {
    /// The frame that is to be rendered.
    pub frame: &'a Frame<'a>,
    /// What it looks like.
    pub sample: &'a SceneSample,
    /// What it is to be rendered on.
    pub machine: &'a Machine,
}

/// A prediction for one frame and one setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Wall-clock time of a warm render \[ms\], ≥ 0.
    pub time_ms: f64,
    /// Error against shadow-map truth, as it is to be expected.
    pub error: PredictedError,
    /// The error that both figures are to stay within: what budgets of errors are held against. Above what is expected: a preset
    /// is made to keep its level, and is mostly well below it.
    pub keeps: f64,
    /// Bytes held between frames.
    pub memory_bytes: u64,
}

/// The figures that levels are judged by (MODEL.md, "Error figures"), as fractions, ≥ 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedError {
    /// The 99th percentile of the pixels' relative errors.
    pub p99: f64,
    /// RMS error over the picture's mean.
    pub rel_rmse: f64,
}

/// Why a technique predicts nothing for a setting: its options are none that were measured, say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoEstimate {
    /// One clause that names the setting.
    pub reason: String,
}

impl PredictedError {
    /// Of a technique whose pixels are right to rounding.
    pub const fn rounding(p99: f64, rel_rmse: f64) -> Self {
        Self { p99, rel_rmse }
    }

    /// The larger of the two: at most ε at a level ε.
    pub fn worst(&self) -> f64 {
        self.p99.max(self.rel_rmse)
    }
}

impl NoEstimate {
    /// With that reason.
    pub fn because(reason: impl Into<String>) -> Self {
        Self { reason: reason.into() }
    }
}

impl fmt::Display for NoEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl std::error::Error for NoEstimate {}
