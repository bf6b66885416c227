//! What a worker keeps for one slice, and what it counts.

use epipolar::rows::{Row, RunIndex, TexturedRow};
use scatter_core::RenderStats;

use crate::exact::{ExactSums, SummedLamp};
use crate::fourier::{FourierRow, Terms};
use crate::measured_depths::MeasuredDepths;
use crate::moments::{Answer, MomentRow};
use crate::runs::{Asked, Extremes};
use crate::weights::BandWeights;

/// Buffers of a worker for one slice.
#[derive(Debug, Default)]
pub struct PrefixScratch {
    pub(super) row: Row,
    pub(super) textured: TexturedRow,
    pub(super) index: RunIndex,
    pub(super) query_runs: Vec<u32>,
    pub(super) extremes: Extremes,
    pub(super) asked: Asked,
    pub(super) depths: MeasuredDepths,
    pub(super) band: BandWeights,
    pub(super) moments: [MomentRow; 2],
    pub(super) fourier: [FourierRow; 2],
    pub(super) terms: Terms,
    pub(super) answers: Vec<Answer>,
    pub(super) shares: Vec<f32>,
    /// Whether a view ray is in doubt.
    pub(super) is_doubted: Vec<bool>,
    pub(super) exact: ExactSums,
    pub(super) summed_lamp: SummedLamp,
    pub(super) counts: Counts,
}

impl PrefixScratch {
    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        self.row.memory_bytes()
            + self.textured.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * (self.query_runs.capacity() + self.shares.capacity())
            + size_of::<Answer>() * self.answers.capacity()
            + self.is_doubted.capacity()
            + self.extremes.memory_bytes()
            + self.asked.memory_bytes()
            + self.depths.memory_bytes()
            + self.band.memory_bytes()
            + self.moments.iter().map(MomentRow::memory_bytes).sum::<usize>()
            + self.fourier.iter().map(FourierRow::memory_bytes).sum::<usize>()
            + self.exact.memory_bytes()
            + self.summed_lamp.memory_bytes()
    }
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub texels: u64,
    pub runs: u64,
    pub filtered: u64,
    pub uniform: u64,
    pub answered: u64,
    pub summed: u64,
    pub exact: u64,
}

/// Adds the counts of all workers to the statistics of the frame.
pub(super) fn report(scratches: &mut dyn Iterator<Item = &PrefixScratch>, stats: &mut RenderStats) {
    let mut sums = Counts::default();
    let mut stretches = 0;
    for scratch in scratches {
        let Counts { texels, runs, filtered, uniform, answered, summed, exact } = scratch.counts;
        sums.texels += texels;
        sums.runs += runs;
        sums.filtered += filtered;
        sums.uniform += uniform;
        sums.answered += answered;
        sums.summed += summed;
        sums.exact += exact;
        stretches += scratch.exact.stretches;
    }
    stats.counts.push("texel columns", sums.texels);
    stats.counts.push("runs", sums.runs);
    stats.counts.push("filtered runs", sums.filtered);
    stats.counts.push("uniform queries", sums.uniform);
    stats.counts.push("filtered queries", sums.answered);
    stats.counts.push("summed queries", sums.summed);
    stats.counts.push("exact queries", sums.exact);
    stats.counts.push("exact edges", stretches);
}
