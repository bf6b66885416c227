//! What the integrator predicts of its presets, whose spacing it measures on the frame itself.
//!
//! How many slices a frame needs is not counted but found by trial, so that the model is one of the picture: the share of pixels
//! at which interpolation over a pixel would miss the target ([`Triple::kink`](scatter_core::Triple)), how rough the picture is as a
//! whole, how often neighbours end at different depths, and how much is lit. Powers of these, fitted to measured times of 28 shots,
//! 14 of them at two sizes, at three levels.

use scatter_core::{
    CostModel, Estimate, LightKind, NoEstimate, Outlook, PredictedError, Quality, SceneSample, UnitCost,
};

use crate::driver::ErrorTarget;
use crate::options::{ID, Options};

/// What a technique on slices predicts of its presets by.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredSlices {
    /// The technique's id.
    pub id: &'static str,
    /// A frame's fixed work, and nanoseconds of `slices` as they are on the machine.
    pub costs: CostModel,
    /// Time of the presets' slices: e to the power of a sum of logarithms.
    pub slices: SliceModel,
    /// Bytes a pixel that each worker holds.
    pub worker_bytes: f64,
}

const OWN: MeasuredSlices = MeasuredSlices {
    id: ID,
    costs: CostModel {
        units: &[
            UnitCost { name: "frame", nanoseconds: 1.5e5 },
            UnitCost { name: "fitted-nanosecond", nanoseconds: 1.0 },
        ],
        thread_gain: 0.93,
    },
    slices: SliceModel {
        levels: [6.863, 7.086, 7.511],
        megapixels: -0.156,
        lamp: 0.427,
        missed: 0.331,
        roughness: -0.101,
        depth_breaks: 0.425,
        lit_share: -0.146,
        fog: 0.225,
        glass: 0.568,
    },
    worker_bytes: 4.0,
};

/// Factors of the logarithms that the time of measured slices is made of; milliseconds a megapixel.
#[derive(Debug, Clone, Copy)]
pub struct SliceModel {
    /// At preview, game and film.
    pub levels: [f64; 3],
    /// Of the picture's megapixels over those of 640×480: larger pictures share more.
    pub megapixels: f64,
    /// Of lamps.
    pub lamp: f64,
    /// Of the share of pixels that interpolation over a pixel misses.
    pub missed: f64,
    /// Of the RMS of what it misses.
    pub roughness: f64,
    /// Of the share of neighbouring pixels whose rays end at different depths.
    pub depth_breaks: f64,
    /// Of the lit share of the light.
    pub lit_share: f64,
    /// Of height fog.
    pub fog: f64,
    /// Of a light with coloured glass before it.
    pub glass: f64,
}

/// What measured spacing keeps of its level, as met on the same shots: p99 and RMS over the level's error, at preview, game
/// and film.
const KEPT: [[f64; 2]; 3] = [[0.30, 0.066], [0.39, 0.070], [0.43, 0.115]];

impl SliceModel {
    /// Nanoseconds of all slices of a picture, for a target p99.
    fn nanoseconds(&self, sample: &SceneSample, target: f64) -> f64 {
        let facts = &sample.facts;
        let triples = &sample.triples;
        let count = triples.len() as f64;
        let missed = triples.iter().filter(|triple| triple.kink > target).count() as f64;
        // A third of a pixel more: none in fifty is not none.
        let missed = ((missed + 0.3) / (count + 1.0)).ln();
        let squares = triples.iter().map(|triple| triple.kink_of_mean.powi(2)).sum::<f64>();
        let roughness = ((squares / count.max(1.0)).sqrt() + 1e-3).ln();
        let megapixels = 1e-6 * sample.pixels();
        let of = |is: bool, factor: f64| if is { factor } else { 0.0 };
        let sum = self.levels[level(target)]
            + self.megapixels * (megapixels / 0.3072).ln()
            + of(facts.light != LightKind::Directional, self.lamp)
            + self.missed * missed
            + self.roughness * roughness
            + self.depth_breaks * (sample.depth_breaks + 0.01).ln()
            + self.lit_share * (sample.lit_share() + 0.02).ln()
            + of(facts.log_density.is_some(), self.fog)
            + of(facts.textured, self.glass);
        1e6 * megapixels * sum.exp()
    }
}

/// Which level a target p99 belongs to: 0 is preview.
fn level(target: f64) -> usize {
    if target > 0.033 {
        0
    } else if target > 0.014 {
        1
    } else {
        2
    }
}

/// The error of the level whose preset aims at a p99.
fn level_error(target: f64) -> f64 {
    [Quality::Preview, Quality::Game, Quality::Film][level(target)].error()
}

/// What that preset is off by, as it is to be expected.
fn expected(target: f64) -> PredictedError {
    let [p99, rel_rmse] = KEPT[level(target)].map(|share| share * level_error(target));
    PredictedError { p99, rel_rmse }
}

/// Time, error and memory of a frame with these options.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    OWN.predicted(options.target, outlook)
}

impl MeasuredSlices {
    /// Time, error and memory of a frame whose spacing is measured for a target.
    pub fn predicted(
        &self,
        target: Option<ErrorTarget>,
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        let sample = outlook.sample;
        let Some(target) = target else {
            return Err(NoEstimate::because(
                "its presets alone were modelled, and those from 180 pixels across on",
            ));
        };
        let target = f64::from(target.error);
        let is_lit = !sample.facts.casts_shadow && !sample.facts.textured;
        let slices = if is_lit { 40.0 * sample.pixels() } else { self.slices.nanoseconds(sample, target) };
        let shared = self.costs.nanoseconds([1.0, slices]);
        let workers = outlook.machine.threads() as f64;
        Ok(Estimate {
            time_ms: outlook.machine.milliseconds(self.id, &self.costs, 0.0, shared),
            error: if is_lit { PredictedError::rounding(1e-5, 1e-5) } else { expected(target) },
            keeps: if is_lit { 1e-5 } else { level_error(target) },
            memory_bytes: ((8.0 + self.worker_bytes * workers) * sample.pixels()) as u64 + (4 << 20),
        })
    }
}
