//! What the technique predicts of itself: the cells of its grid, and those that are sampled.

use scatter_core::{CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, UnitCost};

use crate::options::{ID, Options};

static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "pixel", nanoseconds: 25.0 },
        UnitCost { name: "froxel", nanoseconds: 0.43 },
        UnitCost { name: "sample", nanoseconds: 3.7 },
        UnitCost { name: "lamp-sample", nanoseconds: 7.8 },
        UnitCost { name: "spot-sample", nanoseconds: 12.3 },
        UnitCost { name: "fog-sample", nanoseconds: 3.4 },
        UnitCost { name: "glass-sample", nanoseconds: 6.0 },
    ],
    thread_gain: 0.95,
};

/// What a grid of columns is off by where pixels see edges, whatever its slices are: it was met between 1.7 and 33 % on the
/// built-in shots (README), and no count of the sample says which. Taken as a number that reaches no level.
const COLUMN_ERROR: f64 = 0.12;

/// Time, error and memory of a grid with these options.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    let (sample, facts) = (outlook.sample, &outlook.sample.facts);
    let is_lit = !facts.casts_shadow && !facts.textured;
    let [columns, rows, slices] = options.grid.map(f64::from);
    let [width, height] = facts.size.map(f64::from);
    let froxels = columns.min(width) * rows.min(height) * slices * f64::from(options.frames);
    // Slices end with the longest ray; those behind a column's own surface are not sampled.
    let longest = sample.rays.iter().map(|ray| ray.length).fold(0.0, f64::max);
    let share = if longest > 0.0 { sample.mean(|ray| ray.length) / longest } else { 1.0 };
    let samples = froxels * share;
    let of = |is: bool| if is { samples } else { 0.0 };
    let light = facts.light;
    let shared = if is_lit {
        COSTS.nanoseconds([2.0 * sample.pixels(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    } else {
        COSTS.nanoseconds([
            sample.pixels(),
            froxels,
            of(light == LightKind::Directional),
            of(light == LightKind::Point),
            of(light == LightKind::Spot),
            of(facts.log_density.is_some()),
            of(facts.textured),
        ])
    };
    let error = if is_lit {
        PredictedError::rounding(1e-5, 1e-5)
    } else {
        let [p99, rms] = sample.march_error(slices * f64::from(options.frames) * share);
        PredictedError { p99: p99 + COLUMN_ERROR, rel_rmse: rms + 0.1 * COLUMN_ERROR }
    };
    let row = columns.min(width) * slices * 4.0 * 3.0;
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(ID, &COSTS, 0.0, shared),
        error,
        keeps: error.worst(),
        memory_bytes: (2.0 * row * outlook.machine.threads() as f64) as u64,
    })
}
