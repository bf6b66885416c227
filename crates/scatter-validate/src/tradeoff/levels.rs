//! What users want to know: how long each technique takes to each quality level, and against the baseline.

use scatter_core::Quality;
use serde::Serialize;

use super::trade::{Rung, ShotTrade};

/// One technique at one level on one shot, at its cheapest setting that reaches it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelRow {
    /// The shot's name.
    pub shot: String,
    /// The technique's id.
    pub method: String,
    /// The level.
    pub level: String,
    /// The cheapest setting that reaches it, on one thread; none if no setting does.
    pub reached: Option<Reached>,
    /// Why the technique has no setting at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unsupported: Option<String>,
}

/// What reaching a level costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reached {
    /// What to ask for to get it.
    pub setting: String,
    /// Time of a frame on one thread \[ms\].
    pub one_thread_ms: f64,
    /// Time of a frame on all threads \[ms\].
    pub all_threads_ms: f64,
    /// The baseline's time at its own cheapest over this one, one thread.
    pub one_thread_ratio: Option<f64>,
    /// The same on all threads.
    pub all_threads_ratio: Option<f64>,
}

/// A row a technique and level.
pub fn level_rows(trade: &ShotTrade) -> Vec<LevelRow> {
    let baseline = Quality::ALL.map(|level| trade.baseline.and_then(|id| trade.cheapest(id, level)));
    let row = |method: &str, level: Quality| {
        let unsupported = trade.rungs.iter().find(|rung| rung.row.method == method && !rung.is_measured());
        LevelRow {
            shot: trade.shot.clone(),
            method: method.into(),
            level: level.to_string(),
            reached: trade.cheapest(method, level).map(|rung| reached(rung, baseline[level as usize])),
            unsupported: unsupported
                .and_then(|rung| rung.row.verdict.as_ref())
                .map(|verdict| verdict.to_string()),
        }
    };
    let methods = trade.methods();
    methods.iter().flat_map(|method| Quality::ALL.map(|level| row(method, level))).collect()
}

fn reached(rung: &Rung, baseline: Option<&Rung>) -> Reached {
    let (one_thread_ms, all_threads_ms) = (rung.one_thread_ms(), rung.row.total_ms());
    Reached {
        setting: rung.setting.first().cloned().unwrap_or_default(),
        one_thread_ms,
        all_threads_ms,
        one_thread_ratio: baseline.map(|baseline| baseline.one_thread_ms() / one_thread_ms),
        all_threads_ratio: baseline.map(|baseline| baseline.row.total_ms() / all_threads_ms),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::trade::tests::trade;

    #[test]
    fn times_are_compared_at_equal_level_and_a_miss_is_none() {
        let rows = level_rows(&trade());
        assert_eq!(rows.len(), 9);
        let ratio = |method: &str, level: &str| {
            let row = rows.iter().find(|row| row.method == method && row.level == level).unwrap();
            row.reached.as_ref().map(|reached| (reached.one_thread_ms, reached.one_thread_ratio.unwrap()))
        };
        // The same rung of `exact` serves all levels: 20 ms against 10, 50 and 200 of the marcher.
        let exact = ["preview", "game", "film"].map(|level| ratio("exact", level).unwrap());
        assert_eq!(exact, [(20.0, 0.5), (20.0, 2.5), (20.0, 10.0)]);
        assert_eq!(ratio("march", "game"), Some((50.0, 1.0)));
        assert_eq!(ratio("rough", "preview"), None);
    }

    #[test]
    fn the_document_has_its_keys() {
        let json = serde_json::to_value(&level_rows(&trade())[0]).unwrap();
        assert_eq!(json["shot"], "nave");
        for key in ["setting", "one_thread_ms", "all_threads_ms", "one_thread_ratio", "all_threads_ratio"] {
            assert!(!json["reached"][key].is_null(), "{key}: {json}");
        }
        assert!(json.get("unsupported").is_none());
    }
}
