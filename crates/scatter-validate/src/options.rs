//! The options that a technique runs with: those set by hand, and a baseline's step count where it is not.

use scatter_core::{Quality, Technique};

use crate::baseline::Baseline;
use crate::matrix::{MatrixError, Settings};
use crate::measure::Measurement;
use crate::staged_shot::StagedShot;

/// Keys and values.
pub(crate) type Options = Vec<(String, String)>;

/// The options by hand that the technique has.
pub(crate) fn by_hand(settings: &Settings, technique: &dyn Technique) -> Options {
    let has = |key: &str| technique.info().option(key).is_ok();
    settings.overrides.iter().filter(|(key, _)| has(key)).cloned().collect()
}

/// Options as [`Technique::configure`] takes them.
pub(crate) fn pairs(options: &[(String, String)]) -> Vec<(&str, &str)> {
    options.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}

/// The options by hand; if the technique is the baseline, its cheapest step count that reaches the level (its most if
/// none does) where that is not set by hand.
pub(crate) fn at_level(
    technique: &dyn Technique,
    baseline: Option<&Baseline<'_>>,
    (settings, level): (&Settings, Quality),
    (shot, truth): (&StagedShot, &Measurement),
) -> Result<Options, MatrixError> {
    let mut options = by_hand(settings, technique);
    if let Some(baseline) = baseline
        && baseline.technique.info().id == technique.info().id
        && options.iter().all(|(key, _)| key != baseline.knob)
    {
        let [steps] = baseline.cheapest([level], shot, truth, &pairs(&options))?;
        options.push((baseline.knob.into(), steps.unwrap_or(baseline.most).to_string()));
    }
    Ok(options)
}
