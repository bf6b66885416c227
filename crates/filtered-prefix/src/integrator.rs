//! One slice answers pixels from its filtered rows, and integrates those exactly whose certificate does not suffice.
//!
//! All stages of a slice run one after the other on the same few kilobytes; only shares come out.

use epipolar::SliceIntegrator;
use epipolar::driver::{SliceQueries, SliceRoom, SliceSetup, SliceView, TileUse, channels_of};
use epipolar::rows::{Row, RunIndex, TexturedRow};
use scatter_core::{Light, RenderStats, at_level};

use crate::exact::{ExactSums, ExactTask, LampFactors, SummedLamp, Ways, band_ratio, has_many_edges};
use crate::fourier::{FourierAnswers, FourierRow, Terms};
use crate::moments::{Answer, MomentAnswers, MomentRow, bias_of};
use crate::options::{Basis, Filter, Options, Weighting};
use crate::projective::OwnMap;
use crate::runs::{Asked, DepthScale, Extremes, Runs};
use crate::storage::Storage;
use crate::weights::{BandWeights, Fog, QueryRays, Weights};

/// Length of a view ray that never ends: far enough for any lamp, and its products stay within f32.
const FARTHEST: f64 = 1e18;

/// Where rays end for the sums: e⁻¹⁷ = 4e-8 of the light is left.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// Part of a certificate's tolerance that blended weights may take.
const PART_OF_WEIGHTS: f64 = 0.2;

/// Part of it that the interpolation of exact sums may take.
const PART_OF_SUMS: f64 = 0.2;

/// Filters the rows of epipolar slices and answers view rays from them (Klehm et al. 2014; Peters et al. 2016).
///
/// In a slice of d texel columns with r runs and q queries: O(d) to rectify, O(r·M) to filter with M coefficients, O(q·M) to
/// answer, whatever the scene holds; and a closed form an edge of the rays that are integrated exactly.
#[derive(Debug)]
pub struct PrefixIntegrator {
    options: Options,
    weights: Weights,
    channels: usize,
    longest: f64,
    is_lamp: bool,
    ways: Ways,
    lamp: LampFactors,
    own_map: OwnMap,
}

/// Buffers of a worker for one slice.
#[derive(Debug, Default)]
pub struct PrefixScratch {
    row: Row,
    textured: TexturedRow,
    index: RunIndex,
    query_runs: Vec<u32>,
    extremes: Extremes,
    asked: Asked,
    band: BandWeights,
    moments: [MomentRow; 2],
    fourier: [FourierRow; 2],
    terms: Terms,
    answers: Vec<Answer>,
    shares: Vec<f32>,
    /// Whether a view ray is in doubt.
    is_doubted: Vec<bool>,
    exact: ExactSums,
    summed_lamp: SummedLamp,
    counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    texels: u64,
    runs: u64,
    filtered: u64,
    uniform: u64,
    answered: u64,
    summed: u64,
    exact: u64,
}

impl PrefixIntegrator {
    /// With options that are in their ranges.
    pub fn new(options: Options) -> Self {
        Self {
            options,
            weights: Weights::default(),
            channels: 1,
            longest: FARTHEST,
            is_lamp: false,
            ways: Ways::default(),
            lamp: LampFactors::default(),
            own_map: OwnMap::default(),
        }
    }

    /// The projective map from which rows are read while it is [filled](OwnMap::is_filled).
    pub fn own_map(&mut self) -> &mut OwnMap {
        &mut self.own_map
    }
}

impl SliceIntegrator for PrefixIntegrator {
    type Scratch = PrefixScratch;

    fn set_up(&mut self, slices: &SliceSetup<'_>) {
        let SliceSetup { setup, longest_ray, .. } = *slices;
        let medium = setup.medium();
        let sigma_t = medium.sigma_t();
        self.is_lamp = !matches!(setup.light(), Light::Directional(_));
        self.channels = channels_of(setup.light(), medium);
        let is_fog = medium.height_falloff().is_some();
        let reach = |sigma: f64| if sigma > 0.0 { NEGLIGIBLE_OPTICAL_DEPTH / sigma } else { f64::MAX };
        self.longest = if self.is_lamp || is_fog {
            FARTHEST
        } else {
            sigma_t.into_iter().map(reach).fold(0.0, f64::max).min(longest_ray).clamp(1e-30, 1e30)
        };
        let Options { weighting, tolerance, certified, filter, .. } = self.options;
        if self.is_lamp && certified && filter == Filter::Auto {
            self.lamp.rebuild(slices, tolerance);
        } else {
            self.lamp.clear();
        }
        let deepest = sigma_t.into_iter().fold(0.0, f64::max) * longest_ray;
        // The light of a lamp has its own way, which may be as long as the view ray's.
        let deepest = if self.is_lamp { 2.0 * deepest } else { deepest };
        let even = match weighting {
            Some(weighting) => weighting == Weighting::Average,
            // Even weights are off by an eighth of the optical depth: switched on only where that cannot matter.
            None => deepest <= 8.0 * PART_OF_WEIGHTS * tolerance && !is_fog,
        };
        let is_plain_sun = !self.is_lamp && !is_fog;
        let ratios = sigma_t.map(|sigma| band_ratio(sigma * self.longest, PART_OF_SUMS * tolerance));
        let fog = if self.is_lamp { None } else { Fog::of(medium) };
        self.ways = Ways { is_plain_sun, fog, ratios };
        self.weights.set_up(setup, even, PART_OF_WEIGHTS * tolerance, longest_ray);
    }

    fn leaves_texels_uncut(&self) -> bool {
        self.options.uncut_columns > 0.0
    }

    fn tiles(&self) -> TileUse {
        if self.own_map.is_filled() { TileUse::Never } else { TileUse::IfWorthwhile }
    }

    fn channels(&self) -> usize {
        self.channels
    }

    fn longest_ray(&self) -> f64 {
        self.longest
    }

    fn reserve(&self, room: &SliceRoom<'_>, scratch: &mut PrefixScratch) {
        let SliceRoom { frame, columns, queries, mut runs, .. } = *room;
        runs += self.own_map.most_runs();
        scratch.row.clear(runs);
        if let Some(texture) = frame.texture() {
            let side = texture.projection().size().into_iter().max().unwrap_or(0) as usize;
            scratch.textured.reserve(runs, side);
            runs += 2 * side + 4;
        }
        scratch.query_runs.resize(queries.max(scratch.query_runs.len()), 0);
        scratch.extremes.reserve(runs);
        scratch.asked.make_room(queries);
        scratch.band.reserve(runs, queries, self.is_lamp);
        let Options { basis, storage, coefficients, .. } = self.options;
        match basis {
            Basis::Moments => scratch.moments.iter_mut().for_each(|row| row.make_room(storage, runs)),
            Basis::Fourier => {
                let count = coefficients as usize;
                scratch.fourier.iter_mut().for_each(|row| row.make_room(storage, runs, count));
            }
        }
        scratch.answers.resize(queries.max(scratch.answers.len()), Answer::default());
        scratch.shares.resize(queries.max(scratch.shares.len()), 0.0);
        scratch.is_doubted.resize(queries.max(scratch.is_doubted.len()), false);
        scratch.exact.reserve(runs, columns, queries);
        scratch.summed_lamp.reserve(&self.lamp, room, runs);
        scratch.counts = Counts::default();
    }

    #[inline(always)]
    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut PrefixScratch) {
        if queries.is_empty() {
            return;
        }
        scratch.counts.texels += self.own_map.rectify(slice, self.options.uncut_columns, &mut scratch.row);
        let texture = slice.frame().texture();
        if let Some(texture) = texture {
            scratch.textured.fill(&scratch.row, slice.texture_line(texture).as_ref(), texture);
        }
        let row = std::mem::take(&mut scratch.row);
        let textured = std::mem::take(&mut scratch.textured);
        let runs = Runs::new(&row, texture.map(|_| &textured));
        scratch.counts.runs += runs.lit.len() as u64;
        let channels = if texture.is_some() { 3 } else { self.channels };
        self.find_runs(slice, runs, queries, scratch);
        let exact_at_once =
            self.options.certified && self.options.filter == Filter::Auto && self.ways.is_plain_sun;
        if exact_at_once {
            scratch.asked.take_all(slice, queries, &scratch.query_runs);
        }
        // Sums over all lit runs know what is lit all along, or nowhere.
        if !(exact_at_once && has_many_edges(&runs, &scratch.asked)) {
            self.find_open(slice, runs, (queries, channels), scratch);
        }
        if scratch.asked.len() > 0 {
            if !exact_at_once {
                scratch.is_doubted[..scratch.asked.len()].fill(false);
                for channel in 0..channels {
                    if self.lamp.are_there() {
                        let PrefixScratch { summed_lamp, asked, answers, .. } = &mut *scratch;
                        summed_lamp.answer(&self.lamp, (slice, runs), (asked, channel), answers);
                    } else {
                        self.answer(slice, runs, channel, scratch);
                    }
                    self.take_answers(queries, channel, scratch);
                }
                let all = scratch.asked.len();
                scratch.asked.keep(&scratch.is_doubted);
                let certain = (all - scratch.asked.len()) as u64;
                let counts = &mut scratch.counts;
                *if self.lamp.are_there() { &mut counts.summed } else { &mut counts.answered } += certain;
            }
            scratch.counts.exact += scratch.asked.len() as u64;
            let task = ExactTask { slice, runs, asked: &scratch.asked, channels };
            scratch.exact.sum(&task, &self.ways, queries);
        }
        (scratch.row, scratch.textured) = (row, textured);
    }

    fn report(&self, scratches: &mut dyn Iterator<Item = &PrefixScratch>, stats: &mut RenderStats) {
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

    fn memory_bytes(&self) -> usize {
        self.weights.memory_bytes() + self.lamp.memory_bytes() + self.own_map.memory_bytes()
    }

    fn scratch_bytes(scratch: &PrefixScratch) -> usize {
        scratch.row.memory_bytes()
            + scratch.textured.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * (scratch.query_runs.capacity() + scratch.shares.capacity())
            + size_of::<Answer>() * scratch.answers.capacity()
            + scratch.is_doubted.capacity()
            + scratch.extremes.memory_bytes()
            + scratch.asked.memory_bytes()
            + scratch.band.memory_bytes()
            + scratch.moments.iter().map(MomentRow::memory_bytes).sum::<usize>()
            + scratch.fourier.iter().map(FourierRow::memory_bytes).sum::<usize>()
            + scratch.exact.memory_bytes()
            + scratch.summed_lamp.memory_bytes()
    }
}

impl PrefixIntegrator {
    /// Finds the run in which each view ray ends.
    #[inline(always)]
    fn find_runs(
        &self,
        slice: &SliceView<'_>,
        runs: Runs<'_>,
        queries: &SliceQueries,
        scratch: &mut PrefixScratch,
    ) {
        // Rays may be endless; behind the start of the last run there is nothing to be found.
        let reach = slice.reach().min(runs.starts[runs.starts.len() - 2]);
        scratch.index.fill(runs.starts, reach, queries.len());
        scratch.index.find(runs.starts, queries.gammas(), &mut scratch.query_runs);
    }

    /// Answers what the row's extremes decide (all of a ray's light is lit, or none), and lists the rest.
    #[inline(always)]
    fn find_open(
        &self,
        slice: &SliceView<'_>,
        runs: Runs<'_>,
        (queries, channels): (&mut SliceQueries, usize),
        scratch: &mut PrefixScratch,
    ) {
        let PrefixScratch { query_runs, extremes, asked, counts, .. } = scratch;
        let last = query_runs[..queries.len()].iter().fold(0, |a, &b| a.max(b));
        extremes.fill(runs.lit, last as usize);
        let is_white = runs.colours.is_none();
        let open = queries.open(0..queries.len());
        let mut shares = open.shares;
        let all_queries = open.columns.len();
        asked.make_room(all_queries);
        let mut count = 0;
        for (query, (&column, &gamma)) in open.columns.iter().zip(open.gammas).enumerate() {
            let rank = slice.order.rank(slice.order.columns[0] + column);
            let [all, any] = extremes.all_and_any(query_runs[query], rank);
            let share = if any { 1.0 } else { 0.0 };
            shares[..channels].iter_mut().for_each(|shares| shares[query] = share);
            // Without a branch: what is settled is overwritten by the next one.
            asked.queries[count] = query as u32;
            asked.columns[count] = column;
            asked.ranks[count] = rank;
            asked.gammas[count] = gamma;
            asked.ends[count] = query_runs[query];
            count += usize::from(any & !(all & is_white));
        }
        asked.truncate(count);
        counts.uniform += (all_queries - count) as u64;
    }

    /// Answers the open view rays from filtered rows, band by band.
    #[inline(always)]
    fn answer(&self, slice: &SliceView<'_>, runs: Runs<'_>, channel: usize, scratch: &mut PrefixScratch) {
        let PrefixScratch { asked, band, moments, fourier, terms, answers, shares, counts, .. } = scratch;
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
            let [a, b] = [asked.ranks[range.start], asked.ranks[range.end - 1]];
            let scale = DepthScale::new([a.min(b), a.max(b)]);
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
    fn take_answers(&self, queries: &mut SliceQueries, channel: usize, scratch: &mut PrefixScratch) {
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
