//! What the survey measures, a row each.

use serde::Serialize;

/// Below it errors are rounding, whose ratio says nothing.
pub const ROUNDING: f64 = 1e-3;

/// A technique at a level on a shot.
#[derive(Debug, Clone, Serialize)]
pub struct SurveyRow {
    pub shot: String,
    pub size: [u32; 2],
    pub threads: usize,
    pub method: &'static str,
    pub level: String,
    pub time_ms: f64,
    pub predicted_ms: f64,
    pub p99: f64,
    pub predicted_p99: f64,
    pub rel_rmse: f64,
    pub predicted_rel_rmse: f64,
}

/// What `auto` took for a level.
#[derive(Debug, Clone, Serialize)]
pub struct AutoRow {
    pub shot: String,
    pub size: [u32; 2],
    pub threads: usize,
    pub level: String,
    pub method: String,
    pub setting: String,
    pub time_ms: f64,
    pub best_method: &'static str,
    pub best_ms: f64,
    pub p99: f64,
    pub rel_rmse: f64,
    pub reached: bool,
    pub plan_ms: f64,
}

/// What a shot's map itself is off by: rel_rmse of shadow-map truth against ray-cast truth.
#[derive(Debug, Clone, Serialize)]
pub struct MapRow {
    pub shot: String,
    pub side: u32,
    pub error: f64,
    pub predicted_error: f64,
}

/// What `auto` took for a time.
#[derive(Debug, Clone, Serialize)]
pub struct TimeRow {
    pub shot: String,
    pub budget_ms: f64,
    pub method: String,
    pub setting: String,
    pub time_ms: f64,
    /// The larger of p99 and rel_rmse.
    pub error: f64,
    /// The least of those rows whose time is within the budget; `None` where there is none.
    pub best_error: Option<f64>,
}

/// All that was measured.
#[derive(Debug, Default, Serialize)]
pub struct Survey {
    pub rows: Vec<SurveyRow>,
    pub auto: Vec<AutoRow>,
    pub times: Vec<TimeRow>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub maps: Vec<MapRow>,
}
