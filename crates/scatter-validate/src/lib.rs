//! The judge: closed forms, error figures, the technique × shot matrix and its report.
//!
//! A shot is staged once ([`StagedShot`]: caster and maps) and rendered by the truths ([`JudgedShot`]) and by each
//! technique ([`measure`](measure::measure)); a measurement's [`errors`](JudgedShot::errors) are judged by the
//! [`Tolerances`]. The [`Matrix`] does that for a list of techniques, which it knows through their trait alone. What comes out are [`Row`]s: a table, a JSON
//! document, a report. [`closed_form`] stands apart: it shares no physics with the crates that it checks.

pub mod closed_form;

pub mod scenario;
pub mod texel_cells;

pub mod checks;
pub mod contender;
pub mod mutants;
pub mod stress;
pub mod with_options;

mod beyond_border;
pub mod staged_shot;

pub mod measure;
pub mod planned;
pub mod truths;

pub mod figures;
mod judge_error;
pub mod judged_shot;
mod settings;

pub mod baseline;
pub mod matrix;
mod options;
pub mod step_search;
pub mod survey;
pub mod tolerance;

pub mod cascade_gain;
mod columns;
pub mod machine;
pub mod maps_table;
pub mod regression;
pub mod report;
pub mod row;
pub mod table;

pub mod plot;
pub mod tradeoff;

pub use baseline::Baseline;
pub use cascade_gain::{CascadeGain, MapError, cascade_gain};
pub use contender::Contender;
pub use figures::{CompareError, Figures, Labelled, compare};
pub use judge_error::JudgeError;
pub use judged_shot::{JudgedShot, MapJudgedShot};
pub use machine::Machine;
pub use maps_table::maps_table;
pub use matrix::{ForeignImage, Matrix, Pictures, ShotResult, Twin};
pub use planned::{AUTO, PlannedPass, Planner};
pub use regression::{Regression, RegressionError};
pub use row::{Document, Errors, Row, TwinDistance, Verdict};
pub use settings::Settings;
pub use staged_shot::{StageError, StagedShot};
pub use step_search::StepSearch;
pub use survey::{Survey, survey};
pub use table::table;
pub use tolerance::{ToleranceError, Tolerances};
pub use truths::{HEIGHT_FIELD_TRUTH, RAYCAST_TRUTH, SHADOW_MAP_TRUTH};
pub use with_options::{ByHand, WithOptions};
