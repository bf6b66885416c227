//! Each technique's settings, and the best of them for a budget.

use std::cmp::Ordering;

use scatter_core::{Estimate, NoEstimate, Outlook, Quality, Target, Technique};

use super::budget::Budget;

/// Below it two errors are as good as each other: nobody sees a thousandth.
const INVISIBLE_ERROR: f64 = 1e-3;

/// Power of the time over a budget that an error is charged with: at the quarter that may be over
/// ([`TIME_KEPT_WITHIN`](super::budget::TIME_KEPT_WITHIN)) eight times less error is worth it.
const OVERRUN_POWER: f64 = 9.3;

/// A setting and what is predicted of it.
pub struct Candidate {
    /// Of this technique.
    pub technique: &'static dyn Technique,
    /// What it is configured for.
    pub target: Target,
    /// Over its own choice.
    pub overrides: Vec<(&'static str, String)>,
    /// What is predicted.
    pub estimate: Estimate,
}

/// A technique that was not chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Its id.
    pub id: &'static str,
    /// Why: it refuses the frame, it is slower, it does not reach the error.
    pub reason: String,
    /// What its best setting would take and be off by, where that is known.
    pub estimate: Option<Estimate>,
}

impl Candidate {
    /// The overrides as they are given.
    pub fn pairs(&self) -> Vec<(&str, &str)> {
        pairs(&self.overrides)
    }

    /// Better ones first: what keeps the budget before what does not; then the faster one, within a time the one that is less
    /// off, where a time that is predicted to be over counts as an error that is larger by a power of it: the larger the time, the
    /// smaller the error that is chosen.
    pub fn compare(&self, other: &Self, budget: Budget) -> Ordering {
        let [a, b] = [&self.estimate, &other.estimate];
        let kept = budget.is_kept_by(b).cmp(&budget.is_kept_by(a));
        let time = a.time_ms.total_cmp(&b.time_ms);
        kept.then_with(|| match budget {
            Budget::Time(own) if budget.is_kept_by(a) => {
                let charged = |estimate: &Estimate| {
                    let over = (estimate.time_ms / own).max(1.0);
                    estimate.keeps.max(INVISIBLE_ERROR) * over.powf(OVERRUN_POWER)
                };
                charged(a).total_cmp(&charged(b)).then(time)
            }
            Budget::Time(_) | Budget::Promise(_) => time,
            Budget::Level(_) | Budget::Error(_) if budget.is_kept_by(a) => time,
            // Nothing keeps it: what is nearest.
            Budget::Level(_) | Budget::Error(_) => a.keeps.total_cmp(&b.keeps),
        })
    }
}

/// The best setting of one technique, or why it has none.
pub fn best_of(
    technique: &'static dyn Technique,
    budget: Budget,
    outlook: &Outlook<'_>,
) -> Result<Candidate, Rejected> {
    let id = technique.info().id;
    let refused = |reason: String, estimate| Rejected { id, reason, estimate };
    let facts = &outlook.sample.facts;
    // What its preset refuses, its other settings refuse too: they differ in how fine they are.
    let preset = match budget {
        Budget::Promise(error) => technique.configure(Target::Error(error), &[], facts),
        _ => technique.configure(Target::Quality(Quality::default()), &[], facts),
    };
    let preset = preset.map_err(|error| refused(format!("it promises nothing here: {error}"), None))?;
    preset.supports(outlook.frame).map_err(|unsupported| refused(unsupported.to_string(), None))?;
    let mut none = NoEstimate::because("it has no settings");
    let mut best: Option<Candidate> = None;
    for (target, overrides) in settings(technique, budget) {
        match technique.estimate(target, &pairs(&overrides), outlook) {
            Ok(estimate) => {
                let candidate = Candidate { technique, target, overrides, estimate };
                let is_better = best.as_ref().is_none_or(|best| candidate.compare(best, budget).is_lt());
                if is_better {
                    best = Some(candidate);
                }
            }
            Err(reason) => none = reason,
        }
    }
    let best = best.ok_or_else(|| refused(format!("nothing is known of its cost: {none}"), None))?;
    // A time that nothing fits gets the fastest there is; an error that nobody keeps gets no plan.
    match budget.error() {
        Some(error) if !budget.is_kept_by(&best.estimate) => {
            let off = 100.0 * best.estimate.keeps;
            let reason =
                format!("off by up to {off:.2} % at its best, where {} % are asked for", 100.0 * error);
            Err(refused(reason, Some(best.estimate)))
        }
        _ => Ok(best),
    }
}

fn pairs<'a>(overrides: &'a [(&'static str, String)]) -> Vec<(&'a str, &'a str)> {
    overrides.iter().map(|(key, value)| (*key, value.as_str())).collect()
}

/// Presets and rungs. The same for every error and every time, so that a looser budget has no fewer to choose from.
fn settings(technique: &dyn Technique, budget: Budget) -> Vec<(Target, Vec<(&'static str, String)>)> {
    if let Budget::Promise(error) = budget {
        return vec![(Target::Error(error), Vec::new())];
    }
    let mut levels = Quality::ALL;
    // Of presets that are alike, that of the level that was asked for is named.
    if let Budget::Level(asked) = budget {
        levels.sort_by_key(|level| *level != asked);
    }
    let presets = levels.map(|level| (Target::Quality(level), Vec::new()));
    let rungs = technique.ladder().into_iter().filter(|rung| !rung.is_empty());
    let rungs = rungs.map(|rung| (Target::Quality(Quality::default()), rung));
    presets.into_iter().chain(rungs).collect()
}
