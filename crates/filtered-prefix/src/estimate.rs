//! What the technique predicts of its presets, whose spacing it measures on the frame itself.
//!
//! As of all techniques on slices, the model is one of the picture ([`epipolar::estimate`]); rows of lamps and of height fog cost
//! more than those of a sun in a uniform medium.

use epipolar::estimate::{SliceModel, expected, level_error};
use scatter_core::{CostModel, Estimate, NoEstimate, Outlook, PredictedError, UnitCost};

use crate::options::{Basis, Fetch, ID, Options};

static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "frame", nanoseconds: 2e5 },
        UnitCost { name: "fitted-nanosecond", nanoseconds: 1.1 },
    ],
    thread_gain: 0.93,
};

/// Fitted as epipolar's own.
const SLICES: SliceModel = SliceModel {
    levels: [5.886, 6.132, 6.185],
    megapixels: -0.278,
    lamp: 0.906,
    missed: 0.524,
    roughness: -0.176,
    lit_share: -0.195,
    fog: 1.965,
    glass: 1.048,
};

/// Time, error and memory of a frame.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    let sample = outlook.sample;
    let Some(target) = options.target else {
        return Err(NoEstimate::because(
            "its presets alone were modelled, and those from 180 pixels across on",
        ));
    };
    if options.basis != Basis::Moments || options.fetch != Fetch::Exact {
        return Err(NoEstimate::because(
            "of its bases and fetches, basis=moments with fetch=exact alone was modelled",
        ));
    }
    let target = f64::from(target.error);
    let is_lit = !sample.facts.casts_shadow && !sample.facts.textured;
    let slices = if is_lit { 40.0 * sample.pixels() } else { SLICES.nanoseconds(sample, target) };
    let shared = COSTS.nanoseconds([1.0, slices]);
    let workers = outlook.machine.threads() as f64;
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(ID, &COSTS, 0.0, shared),
        error: if is_lit { PredictedError::rounding(1e-5, 1e-5) } else { expected(target) },
        keeps: if is_lit { 1e-5 } else { level_error(target) },
        memory_bytes: ((8.0 + 6.0 * workers) * sample.pixels()) as u64 + (4 << 20),
    })
}
