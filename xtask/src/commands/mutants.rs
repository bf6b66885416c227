//! `validate --mutants`: the proof that the checks can fail; exit 1 if a deliberately wrong variant survives.

mod recomposed_slices;

use std::collections::BTreeMap;

use scatter::{TECHNIQUES, Technique};
use scatter_validate::mutants::{MutantResult, recomposed_result, run_mutants, table::table};
use scatter_validate::{Contender, Machine};
use serde_json::{Value, json};

use recomposed_slices::{INFO, RUNG, RecomposedSlices, SliceFault};

use super::stress::{modes, options_line};
use crate::Verdict;
use crate::flags::Validate;
use crate::output::{print, print_json};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{Method, method, options_by_hand};

/// Runs every mutant of the reference and of each technique.
pub fn run(flags: &Validate) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let mut techniques: Vec<&dyn Technique> = Vec::new();
    for id in &rendering.methods {
        if let Method::Technique(technique) = method(id)? {
            techniques.push(technique);
        }
    }
    if rendering.methods.is_empty() {
        techniques = TECHNIQUES.to_vec();
    }
    let by_hand = options_by_hand(&rendering.set, &techniques)?;
    let modes = modes(&techniques, &by_hand);
    let contenders = Contender::of_modes(&modes);
    let progress = Progress::new(None);
    let (results, _) = in_pool(rendering.threads, |threads| {
        let mut results = run_mutants(&contenders, &mut |name| progress.stage(name));
        results.extend(SliceFault::ALL.map(|fault| {
            progress.stage(fault.name());
            let renderers = [None, Some(fault)].map(|fault| RecomposedSlices { fault });
            recomposed_result(fault.name(), RUNG, &INFO, renderers)
        }));
        (results, threads)
    })?;
    drop(progress);
    let methods: Vec<&str> = contenders.iter().map(Contender::id).collect();
    let survivors = results.iter().filter(|result| !result.is_rejected()).count();
    if rendering.json {
        let rows: Vec<Value> = results.iter().flat_map(|result| documents(result, &contenders)).collect();
        print_json(&json!({ "machine": Machine::this(), "rows": rows }))?;
    } else {
        print("what must be rejected; in brackets the error of the correct technique at the same rung\n")?;
        print(&format!("{}\n", options_line(&contenders)))?;
        print(&table(&results, &methods))?;
        print(&format!("{} mutants, {survivors} not proven to be rejected\n", results.len()))?;
    }
    Ok(if survivors == 0 { Verdict::Well } else { Verdict::OutOfTolerance })
}

fn documents(result: &MutantResult, contenders: &[Contender<'_>]) -> Vec<Value> {
    let overrides = |method: &str| -> BTreeMap<&str, String> {
        let by = contenders.iter().find(|by| by.id() == method);
        by.map_or(&[][..], Contender::by_hand).iter().cloned().collect()
    };
    let outcomes = result.outcomes.iter();
    outcomes
        .map(|outcome| {
            json!({
                "mutant": result.name,
                "rung": result.rung,
                "method": outcome.method,
                "overrides": overrides(outcome.method),
                "correct": outcome.correct.to_string(),
                "wrong": outcome.mutant.to_string(),
                "verdict": outcome.verdict(),
            })
        })
        .collect()
}
