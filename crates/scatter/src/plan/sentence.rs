//! A plan in words.

use std::fmt::Write;

use scatter_core::{Machine, Target};

use super::budget::Budget;
use super::candidates::Candidate;
use super::map_advice::{MapAdvice, MapKindAdvice};

/// What is done, what it takes, and what the map does to it.
pub fn of(chosen: &Candidate, budget: Budget, keeps: bool, map: &MapAdvice, machine: &Machine) -> String {
    let estimate = &chosen.estimate;
    let mut text = format!("For {budget} take {}", setting(chosen));
    let _ = write!(
        text,
        ": about {} on {} thread{}, {}",
        milliseconds(estimate.time_ms),
        machine.threads(),
        if machine.threads() == 1 { "" } else { "s" },
        off_by(estimate.error.worst()),
    );
    if !keeps {
        text.push_str("; nothing fits the budget, and this is the fastest");
    }
    if map.error > 0.0 && map.hides(estimate.error.worst()) {
        let _ =
            write!(text, "; the {}² shadow map itself is off by about {:.1} %", map.side, 100.0 * map.error);
        match (map.kind, map.wanted_side) {
            (MapKindAdvice::NoneSuffices, _) => {
                text.push_str(", and no map up to 16384² shows what is asked for")
            }
            (MapKindAdvice::Cascades, Some(side)) => {
                let _ = write!(text, ", so give four cascades of {}²", side / 2);
            }
            (MapKindAdvice::Keep, Some(side)) if side > map.side => {
                let _ = write!(text, ", so give one of {side}²");
            }
            _ => {}
        }
    }
    text.push('.');
    text
}

/// Why one candidate lost to another.
pub fn why_not(candidate: &Candidate, chosen: &Candidate, budget: Budget) -> String {
    let [own, other] = [&candidate.estimate, &chosen.estimate];
    match budget {
        Budget::Time(_) if !budget.is_kept_by(own) => {
            format!("{} at its fastest", milliseconds(own.time_ms))
        }
        Budget::Time(_) if own.keeps > other.keeps => {
            format!(
                "{} within that time, more than {}",
                off_by(own.error.worst()),
                chosen.technique.info().id
            )
        }
        _ => {
            let times = own.time_ms / other.time_ms.max(1e-6);
            format!("{}, {times:.1} times as long", milliseconds(own.time_ms))
        }
    }
}

fn setting(chosen: &Candidate) -> String {
    let id = chosen.technique.info().id;
    let options: Vec<_> = chosen.overrides.iter().map(|(key, value)| format!("{key}={value}")).collect();
    match (chosen.target, options.as_slice()) {
        (Target::Quality(level), []) => format!("{id} at {level}"),
        (Target::Error(error), []) => format!("{id} with its promise of {error}"),
        (_, options) => format!("{id} with {}", options.join(", ")),
    }
}

fn milliseconds(time: f64) -> String {
    if time < 10.0 { format!("{time:.1} ms") } else { format!("{time:.0} ms") }
}

fn off_by(error: f64) -> String {
    if error < 5e-4 { "exact for its shadow map".into() } else { format!("off by {:.1} %", 100.0 * error) }
}
