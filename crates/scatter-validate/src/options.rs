//! The options that a technique runs with: those set by hand, and a baseline's step count where it is not.

use scatter_core::{Quality, Technique};

use crate::baseline::Baseline;
use crate::judge_error::JudgeError;
use crate::judged_shot::MapJudgedShot;
use crate::settings::{Options, Settings, pairs};

/// The options by hand; if the technique is the baseline, its cheapest step count that reaches the level (its most if
/// none does) where that is not set by hand.
pub(crate) fn at_level(
    technique: &dyn Technique,
    baseline: Option<&Baseline<'_>>,
    (settings, level): (&Settings, Quality),
    judged: &MapJudgedShot,
) -> Result<Options, JudgeError> {
    let mut options = settings.by_hand(technique);
    if let Some(baseline) = baseline
        && baseline.is(technique.info().id)
        && options.iter().all(|(key, _)| key != baseline.knob)
    {
        let [steps] = baseline.cheapest([level], judged, &pairs(&options))?;
        options.push((baseline.knob.into(), steps.unwrap_or(baseline.most).to_string()));
    }
    Ok(options)
}
