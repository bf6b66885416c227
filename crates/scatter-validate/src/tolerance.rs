//! The tolerance file: how far each technique may be from the truths, and why (`tolerances.toml`).
//!
//! A row names method, shot (`*` stands for any), figure, max and reason. All rows that match a measured row apply.
//! Beside them two rules need no row: nothing may be non-finite, and a technique must reach its quality level. A `[[miss]]`
//! (method, shot, reason) says that a technique is not made to reach levels there: its row is shown as a miss with the reason,
//! and is no failure. A `[[stress]]` (method, group, max, reason) is a limit of its own in a group of the stress matrix; a
//! `[[brighter]]` (method, group, reason) says that modes that promise no error may be brighter there than with all of the light.

use serde::Deserialize;

use crate::row::Row;

/// One limit.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// A technique's id, or `*`.
    pub method: String,
    /// A shot's name, or `*`.
    pub shot: String,
    /// Which figure: `shadow_map.rel_rmse`, `raycast.bias`, … (see [`FIGURES`]).
    pub figure: String,
    /// Largest magnitude of the figure, a fraction ≥ 0.
    pub max: f64,
    /// Where the limit comes from: a derivation, not "what it happened to be".
    pub reason: String,
}

/// Where a technique is known to miss quality levels by its nature.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownMiss {
    /// A technique's id.
    method: String,
    /// A shot's name, or `*`.
    shot: String,
    /// Why no setting mends it.
    reason: String,
}

/// A limit of its own in the stress matrix.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct StressLimit {
    /// A technique's id.
    method: String,
    /// A heading of the matrix.
    group: String,
    /// Largest p99 and RMS, as shares of the unoccluded values, where something casts a shadow.
    max: f64,
    /// Where the limit comes from.
    reason: String,
}

/// Where modes that promise no error may be brighter than the unoccluded value.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Brighter {
    /// A technique's id.
    method: String,
    /// A heading of the matrix.
    group: String,
    /// Why no share of light bounds them.
    reason: String,
}

/// All limits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tolerances {
    rows: Vec<Tolerance>,
    misses: Vec<KnownMiss>,
    stress: Vec<StressLimit>,
    brighter: Vec<Brighter>,
}

/// A tolerance file that does not say what it must.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ToleranceError {
    /// Not TOML, a missing key or an unknown one.
    #[error("line {line}: {problem}; rows are [[row]] with method, shot, figure, max, reason")]
    Syntax {
        /// Line in the file, from 1.
        line: usize,
        /// What is wrong there.
        problem: String,
    },
    /// A row whose value means nothing.
    #[error("row {number} ({method}, {shot}): {problem}")]
    Row {
        /// Which row, from 1.
        number: usize,
        /// Its method.
        method: String,
        /// Its shot.
        shot: String,
        /// What is wrong, and what to give instead.
        problem: String,
    },
}

/// The figures that a row can limit, against each of the truths.
pub const FIGURES: [&str; 5] = ["rel_rmse", "p99", "p99_lit", "max", "bias"];

impl Tolerances {
    /// The limits that are built in.
    pub fn built_in() -> Result<Self, ToleranceError> {
        Self::parse(include_str!("../tolerances.toml"))
    }

    /// Reads a tolerance file's text.
    pub fn parse(text: &str) -> Result<Self, ToleranceError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            #[serde(default)]
            row: Vec<Tolerance>,
            #[serde(default)]
            miss: Vec<KnownMiss>,
            #[serde(default)]
            stress: Vec<StressLimit>,
            #[serde(default)]
            brighter: Vec<Brighter>,
        }
        let file: File = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            let line = 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|&&b| b == b'\n').count();
            ToleranceError::Syntax { line, problem: error.message().replace('\n', " ") }
        })?;
        for (index, row) in file.row.iter().enumerate() {
            if let Some(problem) = row.problem() {
                return Err(ToleranceError::Row {
                    number: index + 1,
                    method: row.method.clone(),
                    shot: row.shot.clone(),
                    problem,
                });
            }
        }
        for (index, miss) in file.miss.iter().enumerate() {
            let problem = if miss.method == "*" {
                "method is *; a miss is one technique's"
            } else if miss.reason.trim().is_empty() {
                "the reason is empty; say why no setting mends it"
            } else {
                continue;
            };
            return Err(ToleranceError::Row {
                number: index + 1,
                method: miss.method.clone(),
                shot: miss.shot.clone(),
                problem: format!("[[miss]]: {problem}"),
            });
        }
        for (index, limit) in file.stress.iter().enumerate() {
            if limit.max > 0.0 && limit.max < 1.0 && !limit.reason.trim().is_empty() {
                continue;
            }
            return Err(ToleranceError::Row {
                number: index + 1,
                method: limit.method.clone(),
                shot: limit.group.clone(),
                problem: "[[stress]]: give a max in (0, 1) and a reason".into(),
            });
        }
        if let Some(number) = file.brighter.iter().position(|brighter| brighter.reason.trim().is_empty()) {
            let Brighter { method, group, .. } = &file.brighter[number];
            return Err(ToleranceError::Row {
                number: number + 1,
                method: method.clone(),
                shot: group.clone(),
                problem: "[[brighter]]: the reason is empty; say why no share of light bounds it".into(),
            });
        }
        Ok(Self { rows: file.row, misses: file.miss, stress: file.stress, brighter: file.brighter })
    }

    /// Why a row may miss its quality level; `None` where it may not.
    pub fn known_miss(&self, row: &Row) -> Option<&str> {
        let of_row =
            |miss: &&KnownMiss| miss.method == row.method && (miss.shot == "*" || miss.shot == row.shot);
        self.misses.iter().find(of_row).map(|miss| miss.reason.as_str())
    }

    /// The limit of a technique's own in a group of the stress matrix; `None` where the film level holds.
    pub fn stress_limit(&self, method: &str, group: &str) -> Option<f64> {
        let limit = self.stress.iter().find(|limit| limit.method == method && limit.group == group);
        limit.map(|limit| limit.max)
    }

    /// Whether modes of a technique that promise no error may be brighter than the unoccluded value in a group of the stress matrix.
    pub fn may_be_brighter(&self, method: &str, group: &str) -> bool {
        self.brighter.iter().any(|brighter| brighter.method == method && brighter.group == group)
    }

    /// What is out of tolerance in a measured row, one sentence each; empty if nothing is.
    pub fn violations(&self, row: &Row) -> Vec<String> {
        let applies = |wanted: &str, name: &str| wanted == "*" || wanted == name;
        self.rows
            .iter()
            .filter(|limit| applies(&limit.method, &row.method) && applies(&limit.shot, &row.shot))
            .filter_map(|limit| {
                let value = figure(row, &limit.figure)?;
                // Not `value > max`: a NaN is out of tolerance too.
                let within = value.abs() <= limit.max;
                (!within).then(|| format!("{} is {value:.3e}, at most {:.3e}", limit.figure, limit.max))
            })
            .collect()
    }
}

impl Tolerance {
    fn problem(&self) -> Option<String> {
        let known = self.figure.split_once('.').is_some_and(|(truth, figure)| {
            ["shadow_map", "raycast", "twin"].contains(&truth) && FIGURES.contains(&figure)
        });
        if !known {
            let figures = FIGURES.join(", ");
            return Some(format!(
                "no figure '{}'; give shadow_map.F, raycast.F or twin.F with F of {figures}",
                self.figure
            ));
        }
        if !(self.max >= 0.0 && self.max.is_finite()) {
            return Some(format!("max is {}; give a finite number ≥ 0", self.max));
        }
        if self.reason.trim().is_empty() {
            return Some("the reason is empty; say where the limit comes from".into());
        }
        None
    }
}

/// The value of `shadow_map.F`, `raycast.F` or `twin.F`; `None` where it was not measured.
fn figure(row: &Row, name: &str) -> Option<f64> {
    let (truth, figure) = name.split_once('.')?;
    let figures = match truth {
        "raycast" => row.errors.raycast,
        "twin" => row.twin.as_ref().map(|twin| twin.figures),
        _ => row.errors.shadow_map,
    }?;
    Some(match figure {
        "rel_rmse" => figures.rel_rmse,
        "p99" => figures.p99,
        "p99_lit" => figures.p99_lit,
        "max" => figures.max,
        _ => figures.bias,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Errors;
    use crate::row::tests::{figures, row};

    const ONE: &str =
        "[[row]]\nmethod = 'm'\nshot = '*'\nfigure = 'shadow_map.p99'\nmax = 0.01\nreason = 'half a step'\n";

    #[test]
    fn a_limit_applies_to_what_it_names_and_to_nothing_else() {
        let limits = Tolerances::parse(ONE).unwrap();
        let measured = |method: &str, p99: f64| {
            let mut row = row(method, "nave");
            row.errors.shadow_map = Some(figures(0.0, p99));
            limits.violations(&row)
        };
        assert!(measured("m", 0.01).is_empty());
        assert_eq!(measured("m", 0.02), ["shadow_map.p99 is 2.000e-2, at most 1.000e-2"]);
        assert_eq!(measured("m", f64::NAN).len(), 1);
        assert!(measured("other", 0.02).is_empty());
    }

    #[test]
    fn a_miss_is_known_of_one_technique_alone_and_has_a_reason() {
        let text = "[[miss]]\nmethod = 'm'\nshot = 'nave'\nreason = 'one sample a cell'\n";
        let limits = Tolerances::parse(text).unwrap();
        assert_eq!(limits.known_miss(&row("m", "nave")), Some("one sample a cell"));
        assert_eq!(limits.known_miss(&row("m", "grove")), None);
        assert_eq!(limits.known_miss(&row("other", "nave")), None);
        let message = |text: &str| Tolerances::parse(text).unwrap_err().to_string();
        assert!(message(&text.replace("'m'", "'*'")).contains("one technique's"));
        assert!(message(&text.replace("one sample a cell", " ")).contains("the reason is empty"));
        // Other figures are judged all the same.
        let limits = Tolerances::parse(&format!("{ONE}{text}")).unwrap();
        let mut measured = row("m", "nave");
        measured.errors.shadow_map = Some(figures(0.0, 0.5));
        assert_eq!(limits.violations(&measured).len(), 1);
    }

    #[test]
    fn a_stress_limit_is_one_groups_alone() {
        let text =
            "[[stress]]\nmethod = 'm'\ngroup = 'the epipole'\nmax = 0.13\nreason = 'one of eight samples'\n";
        let limits = Tolerances::parse(text).unwrap();
        assert_eq!(limits.stress_limit("m", "the epipole"), Some(0.13));
        assert_eq!(limits.stress_limit("m", "laws"), None);
        assert_eq!(limits.stress_limit("other", "the epipole"), None);
        let message = |text: &str| Tolerances::parse(text).unwrap_err().to_string();
        assert!(message(&text.replace("0.13", "1.5")).contains("max in (0, 1)"));
        assert!(message(&text.replace("one of eight samples", "")).contains("a reason"));
    }

    #[test]
    fn who_may_be_brighter_than_all_of_the_light_is_said_with_a_reason() {
        let text = "[[brighter]]\nmethod = 'm'\ngroup = 'the epipole'\nreason = 'one sample of 1/d²'\n";
        let limits = Tolerances::parse(text).unwrap();
        assert!(limits.may_be_brighter("m", "the epipole") && !limits.may_be_brighter("m", "laws"));
        assert!(!limits.may_be_brighter("other", "the epipole"));
        let message = Tolerances::parse(&text.replace("one sample of 1/d²", " ")).unwrap_err().to_string();
        assert!(
            message.contains("row 1 (m, the epipole)") && message.contains("the reason is empty"),
            "{message}"
        );
    }

    #[test]
    fn a_figure_that_was_not_measured_violates_nothing() {
        let mut row = row("m", "nave");
        row.errors = Errors::default();
        assert!(Tolerances::parse(ONE).unwrap().violations(&row).is_empty());
    }

    #[test]
    fn bias_is_limited_in_both_directions() {
        let limits = Tolerances::parse(&ONE.replace("p99", "bias")).unwrap();
        let mut row = row("m", "nave");
        let mut negative = figures(0.0, 0.0);
        negative.bias = -0.5;
        row.errors.shadow_map = Some(negative);
        assert_eq!(limits.violations(&row).len(), 1);
    }

    #[test]
    fn faults_name_the_place_and_the_cure() {
        let message = |text: &str| Tolerances::parse(text).unwrap_err().to_string();
        let unknown = message(&ONE.replace("reason", "because"));
        assert!(unknown.starts_with("line 6: unknown field `because`"), "{unknown}");
        let missing = message(&ONE.replace("max = 0.01\n", ""));
        assert!(missing.contains("missing field `max`"), "{missing}");
        let figure = message(&ONE.replace("shadow_map.p99", "p98"));
        assert!(figure.starts_with("row 1 (m, *): no figure 'p98'"), "{figure}");
        assert!(message(&ONE.replace("0.01", "nan")).contains("max is NaN"));
        assert!(message(&ONE.replace("half a step", " ")).contains("reason is empty"));
        assert!(message("[row]\n").starts_with("line 1"));
    }

    #[test]
    fn the_built_in_file_parses() {
        assert!(!Tolerances::built_in().unwrap().rows.is_empty());
    }
}
