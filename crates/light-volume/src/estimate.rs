//! What the technique predicts of itself: the mesh of a map, and the crossings of the rays with it.

use scatter_core::{CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, UnitCost};

use crate::options::{Accumulate, ID, Options, Surface};

static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "map-texel", nanoseconds: 24.0 },
        UnitCost { name: "ray", nanoseconds: 110.0 },
        UnitCost { name: "lit-run", nanoseconds: 160.0 },
        UnitCost { name: "texel-column", nanoseconds: 0.25 },
        UnitCost { name: "nanosecond-of-lamp-faces", nanoseconds: 1.0 },
    ],
    thread_gain: 0.9,
};

/// What a ray takes for the faces of a lamp's mesh \[ns\], of cubes and of spots, and what the mesh's threshold moves its p99 by.
const THRESHOLDS: [(f32, [f64; 2], f64); 3] =
    [(0.0, [8000.0, 2000.0], 3e-5), (0.003, [3500.0, 600.0], 7e-4), (0.01, [1700.0, 400.0], 5e-3)];

/// Time, error and memory with these options.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    let (sample, facts) = (outlook.sample, &outlook.sample.facts);
    let is_exact = options.surface == Surface::Stepped && options.accumulate == Accumulate::Intervals;
    if !is_exact {
        return Err(NoEstimate::because(
            "its error was modelled for surface=stepped, accumulate=intervals alone",
        ));
    }
    let map_texels: f64 = outlook.frame.shadow().layers().map(|layer| layer.texels().len() as f64).sum();
    let pixels = sample.pixels();
    let known = THRESHOLDS.iter().find(|(threshold, ..)| *threshold == options.threshold);
    let is_sun = facts.light == LightKind::Directional;
    let (faces, p99) = match known {
        Some(&(threshold, _, p99)) if is_sun && threshold == 0.0 => (0.0, p99),
        Some(&(_, faces, p99)) if !is_sun => (faces[usize::from(facts.light == LightKind::Spot)], p99),
        _ => return Err(NoEstimate::because("with that threshold its error was not modelled")),
    };
    let lamp = faces * pixels;
    let shared = COSTS.nanoseconds([
        map_texels * if lamp > 0.0 { 0.6 } else { 1.0 },
        pixels,
        pixels * sample.mean(|ray| ray.lit_runs),
        pixels * sample.mean(|ray| ray.texels),
        lamp,
    ]);
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(ID, &COSTS, 0.0, shared),
        error: PredictedError { p99, rel_rmse: 0.3 * p99 },
        keeps: p99,
        memory_bytes: (40.0 * map_texels) as u64,
    })
}
