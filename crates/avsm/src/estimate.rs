//! What the technique predicts of itself: blocks and texels that rays visit, and the curves of smoke.

use scatter_core::{CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, UnitCost};

use crate::options::{Curve, ID, Opaque, Options};

static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "map-texel", nanoseconds: 1.9 },
        UnitCost { name: "ray", nanoseconds: 180.0 },
        UnitCost { name: "node", nanoseconds: 62.0 },
        UnitCost { name: "texel", nanoseconds: 28.0 },
        UnitCost { name: "dimmed-texel", nanoseconds: 4.5 },
    ],
    thread_gain: 0.95,
};

/// What lit stretches of a lamp, and glass, cost beside those of a sun.
const LAMP: f64 = 1.6;
const GLASS: f64 = 1.15;

/// What curves of 16 nodes are off by where smoke dims the light: p99 and RMS as met on the smoke and hair of the built-in
/// variants (README) are below it.
const CURVE_ERROR: f64 = 8e-3;

/// Time, error and memory with these options.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    let (sample, facts) = (outlook.sample, &outlook.sample.facts);
    if options.opaque != Opaque::Map {
        return Err(NoEstimate::because("with opaque=curve its error was not modelled"));
    }
    if facts.translucent && options.curve != Curve::Avsm && options.curve != Curve::Uncompressed {
        return Err(NoEstimate::because("of its curves, avsm and uncompressed alone were modelled"));
    }
    let map_texels: f64 = outlook.frame.shadow().layers().map(|layer| layer.texels().len() as f64).sum();
    let pixels = sample.pixels();
    let mut factor = 1.0;
    if facts.light != LightKind::Directional {
        factor *= LAMP;
    }
    if facts.textured {
        factor *= GLASS;
    }
    let dimmed = if facts.translucent { pixels * sample.mean(|ray| ray.texels) } else { 0.0 };
    let shared = factor
        * COSTS.nanoseconds([
            map_texels / factor,
            pixels,
            pixels * sample.mean(|ray| ray.nodes),
            pixels * sample.mean(|ray| ray.leaf_texels),
            dimmed,
        ]);
    let error = match (facts.translucent, options.curve) {
        (false, _) | (true, Curve::Uncompressed) => PredictedError::rounding(1e-6, 1e-6),
        (true, _) => PredictedError { p99: CURVE_ERROR, rel_rmse: 0.25 * CURVE_ERROR },
    };
    let curves = if facts.translucent { 8.0 * map_texels } else { 0.0 };
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(ID, &COSTS, 0.0, shared),
        error,
        keeps: error.worst(),
        memory_bytes: (0.13 * map_texels + curves) as u64,
    })
}
