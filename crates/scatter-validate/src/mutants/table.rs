//! The mutants as text: what is wrong, how far the correct technique and the mutant were off at the rung that must
//! reject it, and that rung.

use std::fmt::Write;

use super::{MutantOutcome, MutantResult};
use crate::stress::cell::{Cell, Miss};

/// Two lines a mutant; `methods` head the columns.
pub fn table(results: &[MutantResult], methods: &[&str]) -> String {
    let mut text = format!("{:<40}", "");
    for method in methods {
        let _ = write!(text, "  {method:<26}");
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    for result in results {
        let mut line = format!("{:<40}", result.name);
        for outcome in &result.outcomes {
            // What is made around something else than the columns' techniques says so.
            let own = if methods.contains(&outcome.method) { "" } else { outcome.method };
            let verdict = format!("{own} {}", verdict(outcome));
            let _ = write!(line, "  {:<26}", verdict.trim_start());
        }
        let _ = writeln!(text, "{}\n    by {}", line.trim_end(), result.rung);
    }
    for result in results.iter().filter(|result| !result.is_rejected()) {
        for outcome in result.outcomes.iter().filter(|outcome| !outcome.is_rejected()) {
            let MutantOutcome { method, correct, mutant } = outcome;
            let _ = writeln!(
                text,
                "{} {method}, {}: correct {correct}; mutant {mutant}",
                outcome.verdict(),
                result.name
            );
        }
    }
    text
}

/// `rejected`, with the figure of the mutant over that of the correct technique where there are figures.
fn verdict(outcome: &MutantOutcome) -> String {
    if outcome.says_nothing() || !outcome.is_rejected() {
        return outcome.verdict().into();
    }
    match (&outcome.correct, &outcome.mutant) {
        (Cell::Ok { error }, Cell::Fail(Miss { error: wrong, .. })) if wrong.is_finite() => {
            format!("rejected {wrong:.0e} ({error:.0e})")
        }
        (Cell::Unpromised { error, .. }, Cell::Unpromised { error: wrong, .. }) => {
            format!("rejected {wrong:.0e} ({error:.0e})")
        }
        (Cell::Unpromised { error, .. }, Cell::Fail(Miss { error: wrong, .. })) if wrong.is_finite() => {
            format!("rejected {wrong:.0e} ({error:.0e})")
        }
        _ => "rejected".into(),
    }
}
