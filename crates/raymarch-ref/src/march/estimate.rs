//! What the marcher predicts of itself: pixels × steps, and how much of the light a step's edges move.

use scatter_core::{CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, UnitCost};

use super::options::Options;

/// Of a sun, a lamp and a spot; and what glass and height fog add to a step.
const STEPS: [f64; 3] = [0.76, 2.9, 2.9];
const GLASS_STEP: f64 = 1.1;
const FOG_STEP: f64 = 1.0;

static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "pixel", nanoseconds: 90.0 },
        UnitCost { name: "coloured-pixel", nanoseconds: 58.0 },
        UnitCost { name: "lamp-pixel", nanoseconds: 150.0 },
        UnitCost { name: "nanosecond-of-steps", nanoseconds: 1.0 },
    ],
    thread_gain: 0.95,
};

/// How much more than the spread of random edges a picture's p99 and RMS are taken for: edges of straight walls lie in step
/// with each other, and a sample of some hundred rays does not see the rarest.
const CAUTION: f64 = 1.25;

/// Time, error and memory of a march with these options.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    let (sample, facts) = (outlook.sample, &outlook.sample.facts);
    let steps = f64::from(options.steps);
    let is_lit = !facts.casts_shadow && !facts.textured;
    let a_step = STEPS[match facts.light {
        LightKind::Directional => 0,
        LightKind::Point => 1,
        LightKind::Spot => 2,
    }] + if facts.textured { GLASS_STEP } else { 0.0 }
        + if facts.log_density.is_some() { FOG_STEP } else { 0.0 };
    // A sun that nothing shadows is one closed form a pixel.
    let marched = if is_lit && facts.light == LightKind::Directional { 1.0 } else { steps };
    let pixels = sample.pixels();
    let of = |is: bool| if is { pixels } else { 0.0 };
    let shared = COSTS.nanoseconds([
        pixels,
        of(!facts.grey_extinction),
        of(facts.light != LightKind::Directional),
        pixels * marched * a_step,
    ]);
    let error = if facts.translucent {
        return Err(NoEstimate::because("smoke and hair are not in its model"));
    } else {
        let [p99, rms] = sample.march_error(steps);
        // A lit lamp's steps follow phase function and cone by midpoints: 6 % at 32 steps, falling with their square.
        let midpoints = if facts.light == LightKind::Directional { 1e-5 } else { 60.0 / (steps * steps) };
        PredictedError { p99: p99 + midpoints, rel_rmse: rms + midpoints }
    };
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(super::MARCH_ID, &COSTS, 0.0, shared),
        error,
        keeps: CAUTION * error.worst(),
        memory_bytes: 1 << 16,
    })
}
