//! From a frame and a budget to a technique and its options, with what they will cost and be off by.
//!
//! An engine plans once for a view, or when the scene changes, and keeps [`Plan::instance`]: its buffers serve the frames that
//! follow. A plan walks some hundred pixels ([`SceneSample`], about 2 ms) and asks every technique of the build what it predicts
//! of its presets and of the rungs of its ladder ([`Technique::estimate`]); nothing is rendered. The same frame, machine and
//! number of threads give the same plan.

mod budget;
mod candidates;
mod map_advice;
mod plan_error;
mod sentence;

use std::fmt;

use scatter_core::{Estimate, Frame, Machine, Outlook, SceneSample, Target, Technique, VolumetricShadow};

pub use budget::Budget;
use candidates::Candidate;
pub use candidates::Rejected;
pub use map_advice::{MapAdvice, MapKindAdvice};
pub use plan_error::PlanError;

/// What was chosen.
pub struct Plan {
    /// The technique.
    pub technique: &'static dyn Technique,
    /// What it is configured for.
    pub target: Target,
    /// Options over its own choice for that target.
    pub overrides: Vec<(&'static str, String)>,
    /// The technique so configured: keep it.
    pub instance: Box<dyn VolumetricShadow>,
    /// What it will take and be off by.
    pub estimate: Estimate,
    /// Whether the budget is kept, as far as can be predicted. A time that nothing fits gets the fastest there is.
    pub keeps_budget: bool,
    /// Techniques that were not chosen, each with its reason.
    pub rejected: Vec<Rejected>,
    /// What the shadow map itself is good for.
    pub map: MapAdvice,
    /// How many rays were walked.
    pub sampled_rays: usize,
    /// All of it in one sentence.
    pub sentence: String,
}

/// Chooses among all techniques of this build.
pub fn plan(frame: &Frame<'_>, budget: Budget, machine: &Machine) -> Result<Plan, PlanError> {
    plan_among(crate::TECHNIQUES, frame, budget, machine)
}

/// Chooses among these techniques.
pub fn plan_among(
    techniques: &[&'static dyn Technique],
    frame: &Frame<'_>,
    budget: Budget,
    machine: &Machine,
) -> Result<Plan, PlanError> {
    budget.check()?;
    let sample = SceneSample::of(frame);
    let outlook = Outlook { frame, sample: &sample, machine };
    let mut rejected = Vec::new();
    let mut best: Vec<Candidate> = Vec::new();
    for &technique in techniques {
        match candidates::best_of(technique, budget, &outlook) {
            Ok(candidate) => best.push(candidate),
            Err(own) => rejected.push(own),
        }
    }
    best.sort_by(|a, b| a.compare(b, budget));
    let map = MapAdvice::of(&sample, budget);
    let mut choice = None;
    for candidate in best {
        let overrides = candidate.pairs();
        let id = candidate.technique.info().id;
        if choice.is_none() {
            let instance = candidate.technique.configure(candidate.target, &overrides, &sample.facts)?;
            match instance.supports(frame) {
                Ok(()) => choice = Some((candidate, instance)),
                Err(unsupported) => {
                    rejected.push(Rejected { id, reason: unsupported.to_string(), estimate: None })
                }
            }
            continue;
        }
        let reason = choice.as_ref().map(|(chosen, _)| sentence::why_not(&candidate, chosen, budget));
        rejected.push(Rejected {
            id,
            reason: reason.unwrap_or_default(),
            estimate: Some(candidate.estimate),
        });
    }
    let Some((chosen, instance)) = choice else {
        let reasons: Vec<_> = rejected.iter().map(|own| format!("{}: {}", own.id, own.reason)).collect();
        let reasons = if reasons.is_empty() { "it has none".to_string() } else { reasons.join("; ") };
        return Err(PlanError::Nothing { reasons });
    };
    let keeps_budget = budget.is_kept_by(&chosen.estimate);
    let sentence = sentence::of(&chosen, budget, keeps_budget, &map, machine);
    Ok(Plan {
        technique: chosen.technique,
        target: chosen.target,
        overrides: chosen.overrides,
        instance,
        estimate: chosen.estimate,
        keeps_budget,
        rejected,
        map,
        sampled_rays: sample.rays.len(),
        sentence,
    })
}

impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Plan")
            .field("technique", &self.technique.info().id)
            .field("target", &self.target)
            .field("overrides", &self.overrides)
            .field("estimate", &self.estimate)
            .field("keeps_budget", &self.keeps_budget)
            .field("rejected", &self.rejected)
            .field("map", &self.map)
            .field("sampled_rays", &self.sampled_rays)
            .finish_non_exhaustive()
    }
}
