//! A run against an earlier one: errors must not have grown beyond rounding; times are shown as ratios.
//!
//! The earlier run is any `--json` document with `rows` as `validate` prints them. Rows are matched by shot, method,
//! level, image size and map size, and by their options where that leaves a choice.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::{Deserialize, Serialize};

use crate::row::{Row, Verdict};

/// An earlier run.
#[derive(Debug, Clone)]
pub struct Regression {
    rows: Vec<EarlierRow>,
}

/// A file that is no earlier run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RegressionError {
    /// Not JSON, or not what `--json` prints.
    #[error("{0}; give what validate --json printed")]
    Document(String),
    /// No row in common: nothing would be compared.
    #[error(
        "none of its {count} rows was run now ({example}, …); run the same shots, methods, --quality, --size and --shadow-map"
    )]
    NothingInCommon {
        /// Rows of the earlier run.
        count: usize,
        /// The first of them.
        example: String,
    },
}

/// What a comparison found.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Rows of both runs.
    pub rows: Vec<ComparedRow>,
    /// Rows of the earlier run that were not run now.
    pub missing: Vec<String>,
    /// Rows that the earlier run does not have.
    pub new: Vec<String>,
}

/// A row of both runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedRow {
    /// Shot, method and what tells it from others.
    pub row: String,
    /// Time now over time then; none where one was not timed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_ratio: Option<f64>,
    /// What got worse, one sentence each.
    pub worse: Vec<String>,
}

/// Rounding that an error figure may grow by, as a share of 1 + the figure.
///
/// The same build on the same machine gives the same bits, and all figures are equal. Another instruction set rounds sums
/// of a pixel's radiance in another order: each of some hundred partial sums by half an ulp of f32, 2⁻²⁴, at random, so
/// ten of them, and a few in every other factor. Pixels change by 16·2⁻²⁴ of their value, and so does, at the most, the
/// difference to the truth that a figure is made of.
const ROUNDING: f64 = 16.0 / (1u64 << 24) as f64;

/// A row as an earlier run wrote it. Keys that are not needed are not looked at, so documents may grow.
#[derive(Debug, Clone, Deserialize)]
struct EarlierRow {
    shot: String,
    method: String,
    #[serde(default)]
    requested: Option<String>,
    #[serde(default)]
    level: Option<String>,
    size: [u32; 2],
    shadow_map: u32,
    #[serde(default)]
    cascades: Option<u32>,
    #[serde(default)]
    options: BTreeMap<String, String>,
    /// None in documents from when `options` held them.
    #[serde(default)]
    overrides: Option<BTreeMap<String, String>>,
    #[serde(default)]
    time_ms: BTreeMap<String, Option<f64>>,
    #[serde(default)]
    errors: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    #[serde(default)]
    verdict: Option<String>,
}

impl Regression {
    /// Reads an earlier run's document.
    pub fn parse(text: &str) -> Result<Self, RegressionError> {
        #[derive(Deserialize)]
        struct Document {
            rows: Vec<EarlierRow>,
        }
        let document: Document =
            serde_json::from_str(text).map_err(|error| RegressionError::Document(error.to_string()))?;
        if document.rows.is_empty() {
            return Err(RegressionError::Document("it has no rows".into()));
        }
        Ok(Self { rows: document.rows })
    }

    /// Holds a run against the earlier one.
    pub fn compare(&self, rows: &[Row]) -> Result<Comparison, RegressionError> {
        let mut left: Vec<Option<&EarlierRow>> = self.rows.iter().map(Some).collect();
        let mut found = Comparison::default();
        for row in rows {
            let alike: Vec<usize> = (0..left.len()).filter(|&index| self.rows[index].is_of(row)).collect();
            let exact = |&&index: &&usize| *self.rows[index].overrides() == row.overrides;
            let chosen = match alike.as_slice() {
                // Options that follow from the level may differ: that is what is compared.
                [only] => Some(*only),
                several => several.iter().find(exact).copied(),
            };
            match chosen.and_then(|index| left[index].take()) {
                Some(earlier) => found.rows.push(earlier.compared(row)),
                None => found.new.push(label(&row.shot, &row.method, row.level.as_deref())),
            }
        }
        let label_of = |row: &EarlierRow| label(&row.shot, &row.method, row.level.as_deref());
        found.missing = left.into_iter().flatten().map(label_of).collect();
        if found.rows.is_empty() {
            let example = found.missing.into_iter().next().unwrap_or_default();
            return Err(RegressionError::NothingInCommon { count: self.rows.len(), example });
        }
        Ok(found)
    }
}

fn label(shot: &str, method: &str, level: Option<&str>) -> String {
    match level {
        Some(level) => format!("{method} on {shot} ({level})"),
        None => format!("{method} on {shot}"),
    }
}

impl EarlierRow {
    fn overrides(&self) -> &BTreeMap<String, String> {
        self.overrides.as_ref().unwrap_or(&self.options)
    }

    fn is_of(&self, row: &Row) -> bool {
        self.shot == row.shot
            && self.requested == row.requested
            && (self.method == row.method || row.requested.is_some())
            && self.level == row.level
            && self.size == row.size
            && self.shadow_map == row.shadow_map
            && self.cascades == row.cascades
    }

    fn compared(&self, row: &Row) -> ComparedRow {
        let mut worse = Vec::new();
        for (truth, figures) in [("shadow_map", row.errors.shadow_map), ("raycast", row.errors.raycast)] {
            let Some(now) = figures else { continue };
            let figures = [
                ("rel_rmse", now.rel_rmse),
                ("p99", now.p99),
                ("p99_lit", now.p99_lit),
                ("max", now.max),
                ("bias", now.bias.abs()),
            ];
            for (name, now) in figures {
                // What is no number in the document (null) was none then, and cannot get worse.
                let Some(then) = self.figure(truth, name) else { continue };
                if !(now <= then + ROUNDING * (1.0 + then)) {
                    worse.push(format!("{truth}.{name} grew from {then:.4e} to {now:.4e}"));
                }
            }
            let non_finite = self.figure(truth, "non_finite").unwrap_or(0.0);
            if now.non_finite as f64 > non_finite {
                worse.push(format!("{truth}.non_finite grew from {non_finite} to {}", now.non_finite));
            }
        }
        let was_well = self.verdict.as_deref().is_some_and(|verdict| verdict == "ok");
        if let (true, Some(verdict)) = (was_well, row.verdict.as_ref().filter(|v| **v != Verdict::Ok)) {
            worse.push(format!("it was ok and is {verdict}"));
        }
        let then = self.time_ms.get("total").copied().flatten();
        let time_ratio = then.filter(|then| *then > 0.0).map(|then| row.total_ms() / then);
        ComparedRow {
            row: label(&row.shot, &row.method, row.level.as_deref()),
            time_ratio: time_ratio.filter(|ratio| ratio.is_finite()),
            worse,
        }
    }

    fn figure(&self, truth: &str, name: &str) -> Option<f64> {
        self.errors.get(truth)?.get(name).copied().flatten().map(f64::abs)
    }
}

impl Comparison {
    /// Rows that got worse.
    pub fn worse_count(&self) -> usize {
        self.rows.iter().filter(|row| !row.worse.is_empty()).count()
    }

    /// Time ratios, then what got worse, then what could not be compared.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for ComparedRow { row, time_ratio, worse } in &self.rows {
            let ratio = time_ratio.map_or_else(|| "-".to_string(), |ratio| format!("{ratio:.2}"));
            let mark = if worse.is_empty() { "" } else { "  WORSE" };
            let _ = writeln!(text, "{row:<40}  time × {ratio:>5}{mark}");
        }
        for ComparedRow { row, worse, .. } in &self.rows {
            for sentence in worse {
                let _ = writeln!(text, "WORSE {row}: {sentence}");
            }
        }
        for row in &self.missing {
            let _ = writeln!(text, "only in the baseline, not run now: {row}");
        }
        for row in &self.new {
            let _ = writeln!(text, "not in the baseline: {row}");
        }
        let _ = writeln!(
            text,
            "{} rows compared, {} worse, {} not run now, {} new",
            self.rows.len(),
            self.worse_count(),
            self.missing.len(),
            self.new.len()
        );
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::{figures, row};

    fn measured(method: &str, shot: &str, rel_rmse: f64) -> Row {
        let mut row = row(method, shot);
        row.errors.shadow_map = Some(figures(rel_rmse, 0.02));
        row.verdict = Some(Verdict::Ok);
        row
    }

    fn earlier(rows: &[Row]) -> Regression {
        let document = serde_json::json!({ "machine": {}, "rows": rows });
        Regression::parse(&document.to_string()).unwrap()
    }

    #[test]
    fn the_same_rows_are_no_worse_and_their_times_are_ratios() {
        let then = [measured("a", "nave", 0.01), measured("b", "nave", 0.02)];
        let mut now = then.clone();
        now[1].time_ms.insert("total".into(), 5.0);
        let found = earlier(&then).compare(&now).unwrap();
        assert_eq!((found.rows.len(), found.worse_count()), (2, 0));
        assert_eq!(found.rows[1].time_ratio, Some(2.0));
        assert!(found.missing.is_empty() && found.new.is_empty(), "{}", found.text());
    }

    #[test]
    fn an_error_that_grew_is_worse_and_rounding_is_not() {
        let then = [measured("a", "nave", 0.01)];
        let of = |rel_rmse: f64| earlier(&then).compare(&[measured("a", "nave", rel_rmse)]).unwrap();
        assert_eq!(of(0.01 + 0.5 * ROUNDING).worse_count(), 0);
        assert_eq!(of(0.005).worse_count(), 0, "less is no worse");
        let worse = of(0.010_01);
        assert_eq!(worse.worse_count(), 1);
        assert!(worse.text().contains("WORSE a on nave: shadow_map.rel_rmse grew"), "{}", worse.text());
        assert_eq!(of(f64::NAN).worse_count(), 1, "no number is worse than any");
    }

    #[test]
    fn a_bias_of_either_sign_counts_and_so_do_values_that_are_not_finite_and_verdicts() {
        let then = [measured("a", "nave", 0.01)];
        let compared = |change: fn(&mut Row)| {
            let mut now = then[0].clone();
            change(&mut now);
            earlier(&then).compare(&[now]).unwrap().rows[0].worse.clone()
        };
        let figures = |row: &mut Row| row.errors.shadow_map.unwrap();
        assert!(figures(&mut then[0].clone()).bias == 0.0);
        assert!(compared(|row| row.errors.shadow_map.as_mut().unwrap().bias = -0.1)[0].contains("bias grew"));
        assert!(
            compared(|row| row.errors.shadow_map.as_mut().unwrap().non_finite = 2)[0].contains("non_finite")
        );
        assert!(
            compared(|row| row.verdict = Some(Verdict::Unsupported("x".into())))[0].contains("was ok and is")
        );
    }

    #[test]
    fn rows_are_matched_by_size_map_level_and_options() {
        let mut other_size = measured("a", "nave", 0.01);
        other_size.size = [9, 9];
        let mut other_map = measured("a", "nave", 0.01);
        other_map.shadow_map += 1;
        let mut film = measured("a", "nave", 0.01);
        film.level = Some("film".into());
        let then = earlier(&[measured("a", "nave", 0.01)]);
        for now in [other_size, other_map, film] {
            let found = then.compare(&[measured("a", "nave", 0.01), now.clone()]).unwrap();
            assert_eq!((found.rows.len(), found.new.len()), (1, 1));
            let error = then.compare(&[now]).unwrap_err().to_string();
            assert!(error.contains("a on nave") && !error.contains('\n'), "{error}");
        }
        // Two rungs of a ladder, which only their options tell apart.
        let rung = |steps: &str, rel_rmse: f64| {
            let mut row = measured("a", "nave", rel_rmse);
            row.overrides.insert("steps".into(), steps.into());
            row
        };
        let then = earlier(&[rung("8", 0.2), rung("16", 0.1)]);
        let found = then.compare(&[rung("16", 0.1), rung("32", 0.05), rung("8", 0.2)]).unwrap();
        assert_eq!((found.rows.len(), found.worse_count()), (2, 0));
        assert_eq!(found.new.len(), 1);
    }

    #[test]
    fn rows_that_are_not_in_both_are_said() {
        let then = earlier(&[measured("a", "nave", 0.01), measured("gone", "nave", 0.01)]);
        let found = then.compare(&[measured("a", "nave", 0.01), measured("fresh", "nave", 0.9)]).unwrap();
        let text = found.text();
        assert!(
            text.contains("not run now: gone on nave") && text.contains("baseline: fresh on nave"),
            "{text}"
        );
        assert!(text.ends_with("1 rows compared, 0 worse, 1 not run now, 1 new\n"), "{text}");
    }

    #[test]
    fn what_is_no_run_is_one_line() {
        for text in ["", "{", "[]", "{\"rows\": 3}", "{\"rows\": []}", "{\"rows\": [{\"shot\": 3}]}"] {
            let error = Regression::parse(text).unwrap_err().to_string();
            assert!(error.contains("validate --json") && !error.contains('\n'), "{error}");
        }
    }
}
