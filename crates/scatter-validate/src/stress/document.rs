//! The stress matrix as JSON: the machine, and one row a cell with the keys of every other command's rows.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};

use super::StressResult;
use super::cell::{Cell, Miss};
use crate::contender::Contender;
use crate::machine::Machine;

/// Everything that `stress --json` prints.
#[derive(Debug, Serialize)]
pub struct StressDocument<'a> {
    /// Where it ran.
    pub machine: &'a Machine,
    /// One object a cell: `{shot, group, method, options, overrides, size, shadow_map, threads, time_ms, error, limit, pixel,
    /// level, verdict}`; `shot` is the row's name.
    pub rows: Vec<Value>,
}

impl<'a> StressDocument<'a> {
    /// The document of these rows.
    pub fn new(
        machine: &'a Machine,
        results: &[StressResult],
        contenders: &[Contender<'_>],
        threads: usize,
    ) -> Self {
        let rows = results.iter().flat_map(|row| {
            row.cells.iter().zip(contenders).map(move |(cell, by)| value(row, cell, by, threads))
        });
        Self { machine, rows: rows.collect() }
    }
}

fn value(row: &StressResult, (cell, time): &(Cell, f64), by: &Contender<'_>, threads: usize) -> Value {
    let options: BTreeMap<_, _> = by.finest().into_iter().collect();
    let overrides: BTreeMap<_, _> = by.by_hand().iter().cloned().collect();
    // JSON has no NaN and no ∞: they are null, and the verdict says more.
    let (error, limit, pixel) = match cell {
        Cell::Ok { error } | Cell::Unpromised { error, .. } => (json!(error), Value::Null, Value::Null),
        Cell::Fail(Miss { error, limit, pixel, .. }) => (json!(error), json!(limit), json!(pixel)),
        Cell::Unsupported(_) | Cell::Refused(_) | Cell::NotRun(_) => (Value::Null, Value::Null, Value::Null),
    };
    let verdict = match cell {
        Cell::Ok { .. } | Cell::Refused(_) => "ok".to_string(),
        other => other.to_string(),
    };
    let is_held_to_film = !by.is_reference() && !matches!(cell, Cell::Unpromised { .. });
    json!({
        "shot": row.name,
        "group": row.group,
        "method": by.id(),
        "options": options,
        "overrides": overrides,
        "size": row.size,
        "shadow_map": row.map_side,
        "threads": threads,
        "time_ms": { "total": time },
        "error": error,
        "limit": limit,
        "pixel": pixel,
        "level": if is_held_to_film { json!("film") } else { Value::Null },
        "verdict": verdict,
    })
}
