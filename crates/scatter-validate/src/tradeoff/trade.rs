//! What a sweep found on a shot: the settings with their times and errors, the front, the cheapest for each level.

use std::collections::BTreeMap;

use scatter_core::Quality;
use serde::Serialize;

use super::pareto::on_front;
use crate::figures::Figures;
use crate::row::Row;

/// One setting of one technique on one shot.
#[derive(Debug, Clone, Serialize)]
pub struct Rung {
    /// As `render --json` prints it; `level` is the finest that it reaches, `ratio` the baseline's time at that level
    /// over this one's, all threads.
    #[serde(flatten)]
    pub row: Row,
    /// What to ask for to get it; further names of the same thing follow.
    pub setting: Vec<String>,
    /// As the row's `time_ms`, on one thread.
    pub time_ms_one_thread: BTreeMap<String, f64>,
    /// Whether no setting of any technique is both faster (on one thread) and more exact on this shot.
    pub front: bool,
    #[serde(skip)]
    pub(super) reaches: Option<Quality>,
}

/// What a sweep found on one shot.
#[derive(Debug, Clone)]
pub struct ShotTrade {
    /// The shot's name.
    pub shot: String,
    /// The shadow map's own error: its truth against ray-cast truth.
    pub map_error: Figures,
    /// All settings, technique by technique.
    pub rungs: Vec<Rung>,
    /// The id of the baseline.
    pub baseline: Option<&'static str>,
}

impl Rung {
    /// The larger of p99 and relative RMSE against shadow-map truth: what the quality levels limit.
    pub fn error(&self) -> f64 {
        self.row.errors.shadow_map.map_or(f64::NAN, |figures| match figures.non_finite {
            0 => figures.p99.max(figures.rel_rmse),
            _ => f64::NAN,
        })
    }

    /// Time of a frame on one thread \[ms\].
    pub fn one_thread_ms(&self) -> f64 {
        self.time_ms_one_thread.get("total").copied().unwrap_or(f64::NAN)
    }

    /// Whether it was measured: the technique can do the shot.
    pub fn is_measured(&self) -> bool {
        !self.time_ms_one_thread.is_empty()
    }

    /// Whether it reaches that level.
    pub fn reaches(&self, level: Quality) -> bool {
        self.reaches.is_some_and(|reached| reached >= level)
    }
}

impl ShotTrade {
    /// Marks the front among the rungs and fills in their ratios.
    pub(super) fn new(
        shot: String,
        map_error: Figures,
        rungs: Vec<Rung>,
        baseline: Option<&'static str>,
    ) -> Self {
        let mut trade = Self { shot, map_error, rungs, baseline };
        trade.mark_front();
        trade.fill_ratios();
        trade
    }

    /// The ids of the techniques, in the order of their rungs.
    pub fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = Vec::new();
        for rung in &self.rungs {
            if !methods.contains(&rung.row.method.as_str()) {
                methods.push(&rung.row.method);
            }
        }
        methods
    }

    /// The fastest rung of a technique, on one thread, that reaches a level.
    pub fn cheapest(&self, method: &str, level: Quality) -> Option<&Rung> {
        let of_method = self.rungs.iter().filter(|rung| rung.row.method == method && rung.reaches(level));
        of_method.min_by(|a, b| a.one_thread_ms().total_cmp(&b.one_thread_ms()))
    }

    fn mark_front(&mut self) {
        let points: Vec<[f64; 2]> =
            self.rungs.iter().map(|rung| [rung.one_thread_ms(), rung.error()]).collect();
        for (rung, front) in self.rungs.iter_mut().zip(on_front(&points)) {
            rung.front = front;
        }
    }

    fn fill_ratios(&mut self) {
        let Some(baseline) = self.baseline else { return };
        let baseline_ms =
            Quality::ALL.map(|level| self.cheapest(baseline, level).map(|rung| rung.row.total_ms()));
        for rung in &mut self.rungs {
            let of_level = rung.reaches.and_then(|level| baseline_ms[level as usize]);
            rung.row.ratio = of_level.map(|time| time / rung.row.total_ms());
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::row::tests::{figures, row};

    /// A rung with that error and time on one thread; half of it on all threads.
    pub(crate) fn rung(method: &str, error: f64, one_thread_ms: f64) -> Rung {
        let mut row = row(method, "nave");
        row.errors.shadow_map = Some(figures(0.5 * error, error));
        row.errors.raycast = Some(figures(error, 3.0 * error));
        row.time_ms.insert("total".into(), 0.5 * one_thread_ms);
        let reaches = Quality::ALL.into_iter().rev().find(|level| error <= level.error());
        row.level = reaches.map(|level| level.to_string());
        let time_ms_one_thread = BTreeMap::from([("total".to_string(), one_thread_ms)]);
        let setting = vec![format!("e={error}")];
        Rung { row, setting, time_ms_one_thread, front: false, reaches }
    }

    /// The marcher at 40, 9, 2 and 0.5 %, and a technique that reaches film at once and another that never does.
    pub(crate) fn trade() -> ShotTrade {
        let march =
            [(0.4, 2.0), (0.09, 10.0), (0.02, 50.0), (0.005, 200.0)].map(|(e, t)| rung("march", e, t));
        let exact = [(0.004, 20.0), (0.001, 25.0)].map(|(e, t)| rung("exact", e, t));
        let rungs = march.into_iter().chain(exact).chain([rung("rough", 0.2, 1.0)]).collect();
        ShotTrade::new("nave".into(), figures(0.01, 0.3), rungs, Some("march"))
    }

    #[test]
    fn the_cheapest_rung_of_a_level_may_be_one_of_a_finer_level() {
        let trade = trade();
        let cheapest =
            |method, level| trade.cheapest(method, level).map(|rung| (rung.error(), rung.one_thread_ms()));
        assert_eq!(cheapest("exact", Quality::Preview), Some((0.004, 20.0)));
        assert_eq!(cheapest("march", Quality::Preview), Some((0.09, 10.0)));
        assert_eq!(cheapest("march", Quality::Film), Some((0.005, 200.0)));
        assert_eq!(cheapest("rough", Quality::Preview), None);
    }

    #[test]
    fn the_front_runs_over_all_techniques() {
        let front: Vec<bool> = trade().rungs.iter().map(|rung| rung.front).collect();
        assert_eq!(front, [false, true, false, false, true, true, true]);
    }

    #[test]
    fn the_ratio_is_that_of_the_level_that_is_reached() {
        let ratios: Vec<Option<f64>> = trade().rungs.iter().map(|rung| rung.row.ratio).collect();
        assert_eq!(ratios, [None, Some(1.0), Some(1.0), Some(1.0), Some(10.0), Some(8.0), None]);
    }

    #[test]
    fn a_rung_that_is_not_finite_has_no_error_to_compare() {
        let mut broken = rung("march", 0.001, 1.0);
        broken.row.errors.shadow_map.as_mut().unwrap().non_finite = 1;
        assert!(broken.error().is_nan());
    }
}
