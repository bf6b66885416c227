//! A lamp in a uniform medium: sums over all lit runs by the factors of its integrand, for all view rays of a slice at once, with a
//! certificate a view ray.

use std::ops::Range;

use epipolar::baran::{BandTables, Bands, Factorisation, Integrand, Precision, Table};
use epipolar::driver::{SliceRoom, SliceSetup, SliceView};
use epipolar::geometry::STEEPEST;

use super::column_sums::{ColumnSums, Terms, WeighedRuns};
use crate::moments::Answer;
use crate::runs::{Asked, Runs};

/// Part of a tolerance that factors are asked for: with it all shares of a fiftieth and more are certain.
const PART_OF_FACTORS: f64 = 0.02;

/// Part of a tolerance that factors may be off by; of those that are not so good nearly all shares would be in doubt.
const MOST_OF_FACTORS: f64 = 0.5;

/// Errors of factors below which more terms gain nothing in f32.
const LEAST_ERROR: f64 = 1e-4;

/// Largest ratio of neighbouring bands of 1/sin β; a lamp's bands are its factors' own.
const WIDEST_BAND: f64 = 2.0;

/// The factors of a frame's lamp: `Σ Γₖ(γ)·Bₖ(β)` in place of its integrand (Baran et al. 2010, Section 9), as tables.
#[derive(Debug, Default)]
pub struct LampFactors {
    integrand: Integrand,
    /// What shares are off by at the most, as it was measured between the points of the fit; `None` where that is too much.
    error: Option<f32>,
}

impl LampFactors {
    /// For a frame whose light is a lamp, and certificates of a tolerance; 0 has no factors.
    pub fn rebuild(&mut self, setup: &SliceSetup<'_>, tolerance: f64) {
        self.error = None;
        if tolerance <= 0.0 {
            return;
        }
        let SliceSetup { setup, epipole, slices, longest_ray } = *setup;
        let bands = Bands::cover(setup.camera(), &epipole, slices, WIDEST_BAND, STEEPEST);
        let error = (PART_OF_FACTORS * tolerance).max(LEAST_ERROR);
        let precision = Precision { factorisation: Factorisation::Chebyshev, rank: None, error };
        self.integrand.rebuild(setup, bands, longest_ray, precision);
        let error = self.integrand.lamp_error();
        self.error = (error <= MOST_OF_FACTORS * tolerance).then_some(error as f32);
    }

    /// No factors: the frame's light is no lamp.
    pub fn clear(&mut self) {
        self.error = None;
    }

    /// Whether there are any.
    pub fn are_there(&self) -> bool {
        self.error.is_some()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.integrand.memory_bytes()
    }
}

/// Buffers for the sums of a slice.
#[derive(Debug, Default)]
pub struct SummedLamp {
    columns: ColumnSums,
    /// β of each column.
    views: Vec<f32>,
    cone: Vec<f32>,
    /// Tables of a band: with the cone, and without.
    tables: [Vec<f32>; 2],
    /// Up to runs' starts, of whole runs, and of columns.
    at_starts: Vec<f32>,
    weights: Vec<f32>,
    of_views: Vec<f32>,
    /// Up to the ends of view rays, with the cone and without; and what they have lit before their last runs.
    at_ends: [Vec<f32>; 2],
    lit: Vec<f32>,
}

impl SummedLamp {
    /// Room for the slices of a frame.
    pub fn reserve(&mut self, factors: &LampFactors, room: &SliceRoom<'_>, runs: usize) {
        if factors.are_there() {
            let SliceRoom { columns, queries, .. } = *room;
            self.make_room((runs, columns, queries), factors.integrand.lanes());
            self.cone.clear();
            self.cone.reserve(factors.integrand.buffer_len());
            for tables in &mut self.tables {
                tables.resize(factors.integrand.buffer_len().max(tables.len()), 0.0);
            }
        }
    }

    fn make_room(&mut self, (runs, columns, queries): (usize, usize, usize), terms: usize) {
        self.columns.reserve(runs, columns, queries, terms);
        let [with_cone, without] = &mut self.at_ends;
        for (list, count) in [
            (&mut self.at_starts, (runs + 1) * terms),
            (&mut self.weights, (runs + 1) * terms),
            (&mut self.of_views, columns * terms),
            (&mut self.views, columns),
            (with_cone, queries * terms),
            (without, queries * terms),
            (&mut self.lit, queries * terms),
        ] {
            list.resize(count.max(list.len()), 0.0);
        }
    }

    /// Finds a channel's shares of all view rays, and what they are off by at the most.
    ///
    /// A band costs a few additions a term and run, and as many and a few wide ones a view ray, whatever the row holds.
    #[inline(always)]
    pub fn answer(
        &mut self,
        factors: &LampFactors,
        (slice, runs): (&SliceView<'_>, Runs<'_>),
        (asked, channel): (&Asked, usize),
        answers: &mut [Answer],
    ) {
        let Some(error) = factors.error else { return };
        let integrand = &factors.integrand;
        let own_channel = channel.min(integrand.channels() - 1);
        let count = slice.order.count();
        self.make_room((asked.used_runs(), count, asked.len()), integrand.lanes());
        for ((view, sine), cosine) in self.views.iter_mut().zip(slice.sines()).zip(slice.cosines()) {
            *view = sine.atan2(*cosine);
        }
        integrand.fill_cone(slice.spot(), &slice.plane, &mut self.cone);
        let mut first = 0;
        while first < asked.len() {
            let views = &self.views[..count];
            let (band, [from, to]) = integrand.band_of(own_channel, views[asked.columns[first] as usize]);
            let is_beyond = |&column: &u32| !(from..to).contains(&views[column as usize]);
            let end = asked.columns[first + 1..].iter().position(is_beyond);
            let end = end.map_or(asked.len(), |more| first + 1 + more);
            let [mut with_cone, mut without] = std::mem::take(&mut self.tables);
            let (tables, lanes) = integrand.tables(own_channel, band, &self.cone, &mut with_cone);
            let is_spot = !self.cone.is_empty();
            let bare = is_spot.then(|| integrand.tables(own_channel, band, &[], &mut without).0);
            let task = Band { runs, asked, rays: first..end, channel, error, tables, bare };
            match lanes {
                1 => self.sum_band::<1>(task, &mut answers[first..end]),
                2 => self.sum_band::<2>(task, &mut answers[first..end]),
                4 => self.sum_band::<4>(task, &mut answers[first..end]),
                _ => self.sum_band::<8>(task, &mut answers[first..end]),
            }
            self.tables = [with_cone, without];
            first = end;
        }
    }

    #[inline(always)]
    fn sum_band<const N: usize>(&mut self, band: Band<'_>, answers: &mut [Answer]) {
        let Band { runs, asked, rays, channel, error, tables, bare } = band;
        let (columns, ranks) = (&asked.columns[rays.clone()], &asked.ranks[rays.clone()]);
        let (ends, gammas) = (&asked.ends[rays.clone()], &asked.gammas[rays]);
        let count = ends.len();
        let used = ends.iter().fold(0, |a, &b| a.max(b)) as usize;
        let at_starts = &mut self.at_starts.as_chunks_mut::<N>().0[..=used];
        let table = Table::<N>::new(tables.prefix, 0.0, tables.per_gamma);
        table.read(&runs.starts[..=used], at_starts);
        let [at_ends, bare_ends] =
            self.at_ends.each_mut().map(|list| &mut list.as_chunks_mut::<N>().0[..count]);
        table.read(gammas, at_ends);
        if let Some(bare) = &bare {
            Table::<N>::new(bare.prefix, 0.0, bare.per_gamma).read(gammas, bare_ends);
        }
        // Only view rays that end in it ask for the last run.
        let weights = &mut self.weights.as_chunks_mut::<N>().0[..=used];
        weights[used] = [0.0; N];
        for (weight, pair) in weights.iter_mut().zip(at_starts.windows(2)) {
            *weight = std::array::from_fn(|term| pair[1][term] - pair[0][term]);
        }
        let colour = runs.colour(channel);
        if let Some(colour) = colour {
            for (weight, &colour) in weights[..used].iter_mut().zip(colour) {
                weight.iter_mut().for_each(|weight| *weight *= colour);
            }
        }
        let [a, b] = [ranks[0], ranks[count - 1]];
        let first = a.min(b);
        let lit = &mut self.lit.as_chunks_mut::<N>().0[..count];
        let span = (a.max(b) - first) as usize + 1;
        let weighed = WeighedRuns { lit: &runs.lit[..=used], weights, first, columns: span };
        self.columns.sum(weighed, (ranks, ends), lit);
        let [from, to] = [columns[0] as usize, columns[count - 1] as usize];
        let of_views = &mut self.of_views.as_chunks_mut::<N>().0[..=to - from];
        let views = Table::<N>::new(tables.weights, tables.first_view as f32, tables.per_view);
        views.read(&self.views[from..=to], of_views);
        let by = |terms: &Terms<N>, of_view: &Terms<N>| {
            terms.iter().zip(of_view).fold(0.0, |sum, (term, of_view)| sum + term * of_view)
        };
        let brightest = if colour.is_none() { 1.0 } else { f32::MAX };
        let error =
            error * colour.map_or(1.0, |colour| colour[..=used].iter().fold(1.0, |a: f32, &b| a.max(b)));
        let rays = answers.iter_mut().zip(columns.iter().zip(ranks)).zip(ends);
        let sums = lit.iter_mut().zip(&*at_ends).zip(&*bare_ends);
        for (((answer, (&column, &rank)), &run), ((lit, at_end), bare_end)) in rays.zip(sums) {
            let (run, of_view) = (run as usize, &of_views[column as usize - from]);
            let is_lit = if runs.lit[run] > rank { 1.0 } else { 0.0 };
            let own = is_lit * colour.map_or(1.0, |colour| colour[run]);
            for ((lit, end), start) in lit.iter_mut().zip(at_end).zip(&at_starts[run]) {
                *lit += own * (end - start);
            }
            let (lit, whole) = (by(lit, of_view), by(at_end, of_view));
            let share = (lit / whole).max(0.0).min(brightest);
            // The error is one of the light without a cone, for the worst visibility: what is lit and what is not cannot both gain by it.
            let certificate = match bare {
                Some(_) => error * (by(bare_end, of_view) / whole),
                None => error,
            };
            // A ray without light has no shadow; beside a cone the factors know little of it.
            *answer = if whole > 0.0 {
                Answer { share, certificate }
            } else {
                Answer { share: 1.0, certificate: f32::INFINITY }
            };
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = [&self.views, &self.cone, &self.at_starts, &self.weights, &self.of_views, &self.lit];
        let lists = lists.into_iter().chain(&self.tables).chain(&self.at_ends);
        self.columns.memory_bytes() + 4 * lists.map(Vec::capacity).sum::<usize>()
    }
}

/// View rays of a slice whose factors are the same.
struct Band<'a> {
    runs: Runs<'a>,
    asked: &'a Asked,
    rays: Range<usize>,
    channel: usize,
    error: f32,
    /// Factors with the cone.
    tables: BandTables<'a>,
    /// Without it, if there is one.
    bare: Option<BandTables<'a>>,
}
