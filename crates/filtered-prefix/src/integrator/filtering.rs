//! View rays answered from filtered rows, band by band, and which of the answers are held to suffice.

use epipolar::driver::{SliceQueries, SliceView};
use scatter_core::at_level;

use super::PrefixIntegrator;
use super::scratch::PrefixScratch;
use crate::fourier::FourierAnswers;
use crate::moments::{Answer, MomentAnswers, bias_of};
use crate::options::{Basis, DepthRange, Options};
use crate::runs::{DepthScale, Runs};
use crate::storage::Storage;
use crate::weights::QueryRays;

impl PrefixIntegrator {
    /// Answers the open view rays from filtered rows, band by band.
    #[inline(always)]
    pub(super) fn answer(
        &self,
        slice: &SliceView<'_>,
        runs: Runs<'_>,
        channel: usize,
        scratch: &mut PrefixScratch,
    ) {
        let PrefixScratch { asked, depths, band, moments, fourier, terms, answers, shares, counts, .. } =
            scratch;
        let runs = depths.of(runs);
        let count = asked.len();
        let brightest =
            runs.colour(channel).map_or(1.0, |colour| colour.iter().fold(0.0f32, |a, &b| a.max(b)));
        let mut first = 0;
        while first < count {
            let end = self.weights.band_end(channel, slice, &asked.columns, first);
            let range = first..end;
            first = end;
            let used = asked.ends[range.clone()].iter().fold(0, |a, &b| a.max(b)) as usize;
            let rays =
                QueryRays { columns: &asked.columns[range.clone()], gammas: &asked.gammas[range.clone()] };
            // The run in which the last ray ends is added by each ray itself.
            let starts = &runs.starts[..=used];
            self.weights.fill(channel, slice, rays, starts, band);
            let references = if band.blends { 2 } else { 1 };
            // Ranks follow the columns, up or down.
            let told_apart = match self.options.depth_range {
                DepthRange::Band => [range.start, range.end - 1],
                DepthRange::Slice => [0, count - 1],
            };
            let scale = DepthScale::new(depths.range(told_apart, asked));
            terms.clear();
            counts.filtered += (references * used) as u64;
            match self.options.basis {
                Basis::Moments => {
                    for (row, starts) in moments[..references].iter_mut().zip(&band.starts) {
                        row.make_room(self.options.storage, used);
                        row.fill(&runs, channel, &starts[..=used], scale);
                    }
                    let bias = self.bias();
                    let task = MomentAnswers { rows: moments, band, runs, scale, channel, bias, brightest };
                    let simd = slice.scene().simd;
                    match self.options.coefficients {
                        4 => at_level!(simd, simd => task.answer::<2, _>(simd, asked, range, answers)),
                        6 => at_level!(simd, simd => task.answer::<3, _>(simd, asked, range, answers)),
                        _ => at_level!(simd, simd => task.answer::<4, _>(simd, asked, range, answers)),
                    }
                }
                Basis::Fourier => {
                    let terms_of_series = self.options.coefficients as usize;
                    for (row, starts) in fourier[..references].iter_mut().zip(&band.starts) {
                        row.make_room(self.options.storage, used, terms_of_series);
                        row.fill(&runs, channel, &starts[..=used], scale);
                    }
                    let task =
                        FourierAnswers { rows: fourier, band, runs, scale, channel, count: terms_of_series };
                    task.answer(asked, range, terms, shares);
                }
            }
        }
    }

    /// What moments are mixed with, as their storage rounds them.
    fn bias(&self) -> f64 {
        let count = self.options.coefficients;
        match self.options.storage {
            Storage::F32 => bias_of(count),
            // Half a step of 2⁻¹¹ instead of 2⁻²⁴.
            Storage::F16 | Storage::U8 => (bias_of(count) * 6000.0).min(0.2),
        }
    }

    /// Writes the shares of a channel, and marks those whose certificate does not suffice.
    #[inline(always)]
    pub(super) fn take_answers(
        &self,
        queries: &mut SliceQueries,
        channel: usize,
        scratch: &mut PrefixScratch,
    ) {
        let PrefixScratch { asked, answers, shares, is_doubted, .. } = scratch;
        let Options { certified, absolute, basis, .. } = self.options;
        let tolerance = self.options.tolerance as f32;
        let open = queries.open(0..queries.len());
        let Some(out) = open.shares.into_iter().nth(channel) else { return };
        // Factors have a certificate whatever the basis is.
        match if self.lamp.are_there() { Basis::Moments } else { basis } {
            Basis::Moments => {
                let rays = asked.queries.iter().zip(&*answers).zip(is_doubted);
                for ((&query, answer), doubted) in rays {
                    let &Answer { share, certificate } = answer;
                    let floor = if absolute { 1.0 } else { share - certificate };
                    // Also where the certificate is no number.
                    let suffices = certificate <= tolerance * floor;
                    *doubted |= certified && !suffices;
                    // A ray without light has no shadow.
                    out[query as usize] = if share >= 0.0 { share } else { 1.0 };
                }
            }
            Basis::Fourier => {
                for ((&query, &share), doubted) in asked.queries.iter().zip(&*shares).zip(is_doubted) {
                    // A truncated series promises nothing.
                    *doubted |= certified;
                    out[query as usize] = share;
                }
            }
        }
    }
}
