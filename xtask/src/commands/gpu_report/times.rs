//! Times of the card: three shots, each technique, pass by pass.

use anyhow::Context;
use scatter_gpu::harness::{FrameTimes, GpuTechnique, HarnessDevice, timed};
use scatter_scene::BuiltinShot;
use scatter_validate::StagedShot;
use scatter_validate::staged_shot::resized;
use serde::Serialize;

use crate::flags::GpuReport;
use crate::progress::Progress;
use crate::select::ShotSource;

/// Indoors with glass, in foliage, over terrain: the three whose counts the design has.
pub const SHOTS: [&str; 3] = ["nave", "grove", "valley"];

/// Image and map, and the same with `--quick`.
const FRAMES: [([u32; 2], u32); 2] = [([1920, 1080], 2048), ([96, 54], 64)];

/// One technique on one shot.
#[derive(Debug, Serialize)]
pub struct TimedFrame {
    pub shot: &'static str,
    pub method: &'static str,
    pub size: [u32; 2],
    /// Texels along a side of the map.
    pub shadow_map: u32,
    /// Why it was not rendered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// From submit to the end of waiting \[ms\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub submitted_ms: Option<f64>,
    /// Set-up and recording on the CPU \[ms\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prepare_ms: Option<f64>,
    pub memory_bytes: u64,
    /// Rays that a loop's bound cut short: there must be none.
    pub cut_short: u32,
    pub passes: Vec<TimedPass>,
}

/// One pass.
#[derive(Debug, Serialize)]
pub struct TimedPass {
    pub name: &'static str,
    /// By timestamps \[ms\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ms: Option<f64>,
    pub workgroups: u64,
    /// Texel loads that the plan counts; 0 where they depend on the scene.
    pub loads: u64,
    /// Atomic additions to storage that the plan counts.
    pub atomics: u64,
}

impl TimedFrame {
    /// Whether its image is not what it should be.
    pub fn has_failed(&self) -> bool {
        self.cut_short > 0
    }
}

/// All of them.
pub fn frames(
    device: &HarnessDevice,
    flags: &GpuReport,
    progress: &Progress,
) -> anyhow::Result<Vec<TimedFrame>> {
    let (size, side) = FRAMES[usize::from(flags.quick)];
    // A software driver's times are shown in brackets: one run says as little as nine.
    let runs = if device.is_emulated() { 1 } else { flags.repeat };
    let mut frames = Vec::new();
    for name in SHOTS {
        progress.stage(&format!("{name}: maps"));
        let built_in = BuiltinShot::find(name).with_context(|| format!("{name}: no such shot"))?;
        let mut shot = ShotSource::BuiltIn(built_in).load()?;
        shot.camera = resized(&shot.camera, size)?;
        let staged = StagedShot::new(shot, side)?;
        for (method, technique) in timed(size) {
            progress.stage(&format!("{name}: {method}"));
            let outcome = staged.with_frame(0, staged.camera(), |frame| {
                GpuTechnique::new(technique).times(device, frame, runs)
            })?;
            let frame = TimedFrame {
                shot: name,
                method,
                size,
                shadow_map: side,
                refused: None,
                submitted_ms: None,
                prepare_ms: None,
                memory_bytes: 0,
                cut_short: 0,
                passes: Vec::new(),
            };
            frames.push(match outcome {
                Ok(times) => frame.with(times),
                Err(error) => TimedFrame { refused: Some(error.to_string()), ..frame },
            });
        }
    }
    Ok(frames)
}

impl TimedFrame {
    fn with(self, times: FrameTimes) -> Self {
        let passes = times.passes.into_iter();
        Self {
            submitted_ms: Some(times.submitted_ms),
            prepare_ms: Some(times.prepare_ms),
            memory_bytes: times.memory_bytes,
            cut_short: times.cut_short,
            passes: passes
                .map(|pass| TimedPass {
                    name: pass.name,
                    ms: pass.ms,
                    workgroups: pass.workgroups,
                    loads: pass.loads,
                    atomics: pass.atomics,
                })
                .collect(),
            ..self
        }
    }
}
