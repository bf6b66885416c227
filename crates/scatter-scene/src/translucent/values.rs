//! What a shot says about points and lines whose file does not.

use crate::error::{Checked, Fault};
use crate::limits::MAX_COORDINATE;

/// Values for points and lines that have none of their own; without them such points and lines are left out.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct OccluderValues {
    /// `[particles]`.
    pub particles: Option<ParticleValues>,
    /// `[strands]`.
    pub strands: Option<StrandValues>,
}

/// Values of particles, each where it is given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ParticleValues {
    pub radius: Option<f64>,
    pub density: Option<f64>,
}

/// Values of strands, each where it is given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct StrandValues {
    pub radius: Option<f64>,
    pub opacity: Option<f64>,
}

/// A radius.
pub(crate) fn checked_radius(
    value: f64,
    what: impl FnOnce() -> String,
    place: impl FnOnce() -> String,
) -> Checked<f64> {
    if (0.0..=MAX_COORDINATE).contains(&value) {
        return Ok(value);
    }
    Err(Fault::invalid(place(), format!("{} is {value}", what()), "give a number from 0 to 1e15"))
}

/// A density.
pub(crate) fn checked_density(
    value: f64,
    what: impl FnOnce() -> String,
    place: impl FnOnce() -> String,
) -> Checked<f64> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Fault::invalid(place(), format!("{} is {value}", what()), "give a finite number ≥ 0"))
}

/// An opacity.
pub(crate) fn checked_opacity(
    value: f64,
    what: impl FnOnce() -> String,
    place: impl FnOnce() -> String,
) -> Checked<f64> {
    if (0.0..=1.0).contains(&value) {
        return Ok(value);
    }
    Err(Fault::invalid(place(), format!("{} is {value}", what()), "give a number from 0 to 1"))
}
