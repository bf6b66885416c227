//! Deliberately wrong techniques, and the proof that the stress matrix rejects each of them.
//!
//! A mutant is made around any technique, from outside: its input is perturbed as a fault in it would perturb it, or
//! its output is; what no perturbation can show is recomposed from public stages ([`recomposed`]). Nothing of this is
//! in a technique. Each mutant names the rung, a row of the stress matrix, that must reject it, where the correct
//! technique passes.
//!
//! What is recomposed from the stages of a technique that this crate may not name comes from outside:
//! [`recomposed_result`]. (`cargo xtask` does so with `epipolar`'s: a prefix sum that is off by one, slices shifted by
//! one, the minimum of map tiles taken for their maximum.)
//!
//! Waiting for public stages of techniques to come: min and max swapped while a 1D min/max tree is built
//! (`minmax-mipmap`); [`Fault::NearAndFarSwapped`] stands for it.

pub mod fault;
mod input_faults;
mod mutant;
mod optionless;
mod output_faults;
pub mod recomposed;
pub mod table;

use scatter_core::{TechniqueInfo, VolumetricShadow};

use crate::contender::Contender;
use crate::stress::cell::Cell;
use crate::stress::row::StressRow;
use crate::stress::rows::all_rows;
use crate::stress::run;
pub use fault::Fault;
pub use mutant::Mutant;
use optionless::Optionless;
pub use recomposed::{PhysicsFault, Recomposed};

/// What became of one mutant.
#[derive(Debug, Clone)]
pub struct MutantResult {
    /// What is wrong with it.
    pub name: &'static str,
    /// The rung that must reject it, `group: row`.
    pub rung: String,
    /// One outcome a technique.
    pub outcomes: Vec<MutantOutcome>,
}

/// What the rung said.
#[derive(Debug, Clone, PartialEq)]
pub struct MutantOutcome {
    /// Id of what the mutant was made around.
    pub method: &'static str,
    /// To the correct technique.
    pub correct: Cell,
    /// To the mutant.
    pub mutant: Cell,
}

impl MutantOutcome {
    /// The correct one passes and the mutant fails; in a mode that promises no error, the mutant is further off than the correct
    /// technique by what a promise would allow. A rung that the technique does not support proves nothing, and is none of its
    /// faults.
    pub fn is_rejected(&self) -> bool {
        let is_told = match (&self.correct, &self.mutant) {
            (Cell::Ok { .. } | Cell::Unpromised { .. }, Cell::Fail(_)) => true,
            (Cell::Unpromised { error: correct, level, .. }, Cell::Unpromised { error: wrong, .. }) => {
                *wrong > correct + level
            }
            _ => false,
        };
        is_told || self.says_nothing()
    }

    /// One word or three: a rung that the correct technique fails too proves nothing about the mutant, nor does one at which the
    /// mode's own error hides it.
    pub fn verdict(&self) -> &'static str {
        match (&self.correct, &self.mutant) {
            _ if self.says_nothing() => "unsupported",
            _ if self.is_rejected() => "rejected",
            (Cell::Fail(_), _) => "CORRECT ONE FAILS",
            (Cell::Unpromised { .. }, _) => "NOT PROVEN",
            _ => "SURVIVES",
        }
    }

    /// Whether the rung could not be tried.
    pub fn says_nothing(&self) -> bool {
        matches!(self.correct, Cell::Unsupported(_) | Cell::NotRun(_))
    }
}

impl MutantResult {
    /// Whether one technique at least was tried, and every mutant was rejected.
    pub fn is_rejected(&self) -> bool {
        self.outcomes.iter().all(MutantOutcome::is_rejected)
            && self.outcomes.iter().any(|outcome| !outcome.says_nothing())
    }
}

/// Runs every mutant of each contender on its rung, beside the contender itself. `progress` is told what comes next.
pub fn run_mutants(contenders: &[Contender<'_>], progress: &mut dyn FnMut(&str)) -> Vec<MutantResult> {
    let mut results = Vec::new();
    for fault in Fault::ALL {
        progress(fault.name());
        let outcomes = contenders.iter().map(|correct| {
            let mutant = Mutant { good: correct.technique(), fault };
            outcome(fault.rung(), correct, &correct.judged_alike(&mutant))
        });
        results.push(MutantResult {
            name: fault.name(),
            rung: label(fault.rung()),
            outcomes: outcomes.collect(),
        });
    }
    for fault in PhysicsFault::ALL {
        progress(fault.name());
        let renderers = [None, Some(fault)].map(|fault| Recomposed { fault });
        results.push(recomposed_result(fault.name(), fault.rung(), &recomposed::INFO, renderers));
    }
    results
}

/// Runs a recomposed technique, `[correct, wrong]`, on the rung (group and name of a row) that must reject the wrong one.
pub fn recomposed_result(
    name: &'static str,
    rung: (&str, &str),
    info: &'static TechniqueInfo,
    renderers: [impl VolumetricShadow + Copy + Sync + 'static; 2],
) -> MutantResult {
    let [correct, mutant] = renderers.map(|renderer| Optionless { info, renderer });
    let outcome = outcome(rung, &Contender::Technique(&correct), &Contender::Technique(&mutant));
    MutantResult { name, rung: label(rung), outcomes: vec![outcome] }
}

fn label((group, name): (&str, &str)) -> String {
    format!("{group}: {name}")
}

fn outcome(rung: (&str, &str), correct: &Contender<'_>, mutant: &Contender<'_>) -> MutantOutcome {
    let Some(row) = row(rung) else {
        let missing = Cell::fault(format!("the matrix has no row {}", label(rung)));
        return MutantOutcome { method: correct.id(), correct: missing.clone(), mutant: missing };
    };
    let mut cells = run(row, &[*correct, *mutant]).cells.into_iter().map(|(cell, _)| cell);
    let mut next = || cells.next().unwrap_or_else(|| Cell::fault("the row has no cell"));
    MutantOutcome { method: correct.id(), correct: next(), mutant: next() }
}

fn row((group, name): (&str, &str)) -> Option<StressRow> {
    all_rows().into_iter().find(|row| row.group == group && row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mutant_of_a_mode_without_a_promise_must_be_further_off_than_the_mode_itself() {
        let off_by = |error: f64| Cell::Unpromised { error, level: 0.01, why: String::new() };
        let verdict = |correct: Cell, mutant: Cell| {
            let outcome = MutantOutcome { method: "m", correct, mutant };
            (outcome.is_rejected(), outcome.verdict())
        };
        assert_eq!(verdict(off_by(0.2), off_by(0.25)), (true, "rejected"));
        assert_eq!(verdict(off_by(0.2), off_by(0.205)), (false, "NOT PROVEN"));
        assert_eq!(verdict(off_by(0.2), off_by(0.1)), (false, "NOT PROVEN"));
        // A rule that is broken tells it, however far the mode is off.
        assert_eq!(verdict(off_by(0.2), Cell::fault("NaN")), (true, "rejected"));
        assert_eq!(verdict(Cell::Ok { error: 0.0 }, Cell::Ok { error: 1.0 }), (false, "SURVIVES"));
        assert_eq!(verdict(Cell::fault("x"), Cell::fault("x")), (false, "CORRECT ONE FAILS"));
    }
}
