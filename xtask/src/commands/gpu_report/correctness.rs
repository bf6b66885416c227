//! Images of the card against the CPU's technique and against the truth, on built-in shots.

use scatter::Quality;
use scatter_scene::{MapResolution, builtin_shots};
use scatter_validate::staged_shot::resized;
use scatter_validate::{Matrix, Row, Settings, Tolerances};

use crate::gpu;
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::ShotSource;

use super::times::SHOTS;

/// Odd sides, width and height apart; maps of so many texels a side.
const SIZE: [u32; 2] = [161, 119];
const MAP: u32 = 256;
/// The same with `--quick`.
const QUICK_SIZE: [u32; 2] = [49, 37];
const QUICK_MAP: u32 = 64;

/// A row a technique of the GPU and shot: all built-in ones, or the timed ones alone.
pub fn rows(quick: bool, progress: &Progress) -> anyhow::Result<Vec<Row>> {
    let (size, side) = if quick { (QUICK_SIZE, QUICK_MAP) } else { (SIZE, MAP) };
    in_pool(None, |threads| {
        let matrix = Matrix {
            techniques: gpu::techniques().to_vec(),
            map_row: false,
            raycast_row: false,
            baseline: None,
            planner: None,
            twins: gpu::twins(),
            emulated: gpu::emulated(gpu::techniques()),
            settings: Settings {
                quality: Quality::Game,
                overrides: Vec::new(),
                resolution: MapResolution { side, cascades: 1 },
                raster: None,
                repeat: 1,
                threads,
            },
            tolerances: Tolerances::built_in()?,
        };
        let mut rows = Vec::new();
        for built_in in builtin_shots().iter().filter(|shot| !quick || SHOTS.contains(&shot.name)) {
            let mut shot = ShotSource::BuiltIn(built_in).load()?;
            shot.camera = resized(&shot.camera, size)?;
            rows.extend(matrix.run(shot, &mut |stage| progress.stage(stage))?.rows);
        }
        anyhow::Ok(rows)
    })?
}
