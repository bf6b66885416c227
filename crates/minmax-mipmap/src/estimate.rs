//! What exact mode predicts of itself: nodes, texels and lit runs of every pixel's ray.

use scatter_core::{CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, UnitCost};

use crate::options::{ID, Mode, Options};

/// Fitted on 29 shots at two sizes (PLANNER.md): a sample's nodes stand for those of all rays.
static COSTS: CostModel = CostModel {
    units: &[
        UnitCost { name: "map-texel", nanoseconds: 0.30 },
        UnitCost { name: "ray", nanoseconds: 4.0 },
        UnitCost { name: "node", nanoseconds: 3.36 },
        UnitCost { name: "texel", nanoseconds: 2.08 },
        UnitCost { name: "lit-run", nanoseconds: 25.7 },
        UnitCost { name: "lamp-ray", nanoseconds: 58.0 },
        UnitCost { name: "lamp-run", nanoseconds: 105.0 },
        UnitCost { name: "glass-run", nanoseconds: 144.0 },
        UnitCost { name: "fog-ray", nanoseconds: 31.9 },
        UnitCost { name: "coloured-ray", nanoseconds: 124.0 },
    ],
    thread_gain: 0.95,
};

/// Time, error and memory of a frame.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    if options.mode != Mode::Exact {
        return Err(NoEstimate::because("mode=exact alone was modelled"));
    }
    let (sample, facts) = (outlook.sample, &outlook.sample.facts);
    let map_texels: f64 = outlook.frame.shadow().layers().map(|layer| layer.texels().len() as f64).sum();
    let rays = sample.pixels();
    let runs = rays * sample.mean(|ray| ray.lit_runs);
    let of = |is: bool, count: f64| if is { count } else { 0.0 };
    let is_lamp = facts.light != LightKind::Directional;
    let shared = COSTS.nanoseconds([
        map_texels,
        rays,
        rays * sample.mean(|ray| ray.nodes),
        rays * sample.mean(|ray| ray.leaf_texels),
        runs,
        of(is_lamp, rays),
        of(is_lamp, runs),
        of(facts.textured, runs),
        of(facts.log_density.is_some(), rays),
        of(!facts.grey_extinction, rays),
    ]);
    // The mipmap, and a tile of 64×32 pixels a worker.
    let memory = map_texels / 3.0 + 1e6 * outlook.machine.threads() as f64;
    Ok(Estimate {
        time_ms: outlook.machine.milliseconds(ID, &COSTS, 0.0, shared),
        error: PredictedError::rounding(1e-6, 5e-7),
        keeps: 1e-5,
        memory_bytes: memory as u64,
    })
}
