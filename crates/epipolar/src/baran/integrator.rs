//! One slice answers pixels: its light rays are rectified, and the lit part of each pixel's ray is summed.
//!
//! All stages of a slice run one after the other on the same few kilobytes, so that rectified rows never leave the
//! innermost caches; only shares come out.

use std::ops::Range;

use scatter_core::RenderStats;

use super::bands::Bands;
use super::fog::{ExactScratch, HeightFog, LitRuns};
use super::integrand::{BandTables, Integrand, Precision};
use super::settings::{BaranSettings, Cells};
use super::sums::problem::{Problem, Queries, Runs, SumScratch};
use super::sums::{SumAlgorithm, sum_lit_runs};
use super::tables::{Table, Views, share_of};
use crate::driver::{
    OpenQueries, SliceIntegrator, SliceLight, SliceQueries, SliceRoom, SliceSetup, SliceView, TileUse,
};
use crate::geometry::STEEPEST;
use crate::paper::leave_ring;
use crate::rows::{Row, RunIndex, TexturedRow};

/// Length of a view ray that never ends: far enough for any lamp, and its products stay within f32.
const FARTHEST: f64 = 1e18;

/// Largest ratio of 1/sin β within a band. Wider bands need more terms, narrower ones more sweeps around the epipole.
const WIDEST_BAND: f64 = 2.0;

/// Error of a lamp's factors beyond which pixels are walked: well below a film's. Only backward lobes over long rays in thin
/// fog miss it.
const WORST_LAMP_ERROR: f64 = 0.004;

/// Baran's integrator (Baran et al. 2010, Sections 4 to 7): the integrand as a sum of products `Σ Γₖ(γ)·Bₖ(β)`, summed over
/// the lit light rays before each pixel.
///
/// In a slice of d texel columns, with q queries and r runs that end at different view rays: O(d) to rectify, O(q + r) to
/// sum. The error of a share is at most the factors' ([`Factors::bound`](super::Factors::bound); a lamp's is measured) and
/// the rounding of f32 sums; 0 and 1 are exact.
///
/// Height fog under a sun is not factorised: a query costs a closed form for each edge between lit and dark on its ray (with a
/// texture: for each run), and its share is exact but for roundings, 4e-6 where it was met worst. Rank, factorisation and algorithm
/// are not asked.
#[derive(Debug)]
pub struct Baran {
    settings: BaranSettings,
    integrand: Integrand,
    /// The frame's height fog: it has no factors, its lit stretches are summed in closed form.
    fog: Option<HeightFog>,
    /// Whether the frame's light is a lamp.
    is_lamp: bool,
}

impl Baran {
    /// With some settings.
    pub fn new(settings: BaranSettings) -> Self {
        Self { settings, integrand: Integrand::default(), fog: None, is_lamp: false }
    }
}

/// Buffers of a worker for one slice.
#[derive(Debug, Default)]
pub struct BaranScratch {
    row: Row,
    textured: TexturedRow,
    index: RunIndex,
    /// The run in which each query's ray ends.
    query_runs: Vec<u32>,
    /// The factors' coordinate of each column.
    views: Vec<f32>,
    /// The factors of each column of a band.
    view_terms: Vec<f32>,
    cone: Vec<f32>,
    lamp_prefix: Vec<f32>,
    prefix: Vec<f32>,
    band: BandBuffers,
    sums: SumScratch,
    fog: ExactScratch,
    counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    texels: u64,
    runs: u64,
}

impl SliceIntegrator for Baran {
    type Scratch = BaranScratch;

    fn set_up(&mut self, setup: &SliceSetup<'_>) {
        let SliceSetup { setup, epipole, slices, longest_ray } = *setup;
        self.is_lamp = setup.light().position().is_some();
        self.fog = HeightFog::of(setup.medium(), setup.camera().eye());
        if self.fog.is_some() {
            return;
        }
        let ring = self.settings.ring_sine;
        let steepest = if ring > 0.0 { 1.0 / ring } else { STEEPEST };
        let bands = Bands::cover(setup.camera(), &epipole, slices, WIDEST_BAND, steepest);
        let BaranSettings { factorisation, rank, factor_error, .. } = self.settings;
        let precision = Precision { factorisation, rank, error: factor_error };
        self.integrand.rebuild(setup, bands, longest_ray, precision);
    }

    fn is_accurate(&self) -> bool {
        self.fog.is_some() || self.integrand.lamp_error() <= self.settings.factor_error.max(WORST_LAMP_ERROR)
    }

    fn leaves_texels_uncut(&self) -> bool {
        self.settings.uncut_columns > 0.0
    }

    fn tiles(&self) -> TileUse {
        if self.settings.cells == Cells::Exact { TileUse::IfWorthwhile } else { TileUse::Never }
    }

    fn channels(&self) -> usize {
        self.fog.map_or(self.integrand.channels(), |fog| fog.channels())
    }

    fn longest_ray(&self) -> f64 {
        if self.is_lamp || self.fog.is_some() { FARTHEST } else { self.integrand.longest() }
    }

    fn reserve(&self, room: &SliceRoom<'_>, scratch: &mut BaranScratch) {
        scratch.reserve(room, &self.integrand);
        if self.fog.is_some() {
            let texture = room.frame.texture().map_or(0, |texture| {
                let [width, height] = texture.projection().size();
                2 * width.max(height) as usize + 4
            });
            scratch.fog.reserve(room.runs + texture, room.columns, room.queries);
        }
    }

    #[inline(always)]
    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut BaranScratch) {
        if self.fog.is_none() {
            view_coordinates(slice, &mut scratch.views);
            self.integrand.fill_cone(slice.spot(), &slice.plane, &mut scratch.cone);
        }
        scratch.counts.texels += match self.settings.cells {
            Cells::Exact => slice.rectify(self.settings.uncut_columns, &mut scratch.row),
            Cells::Sampled(cells) => cells.rectify(slice, &mut scratch.row),
        };
        let texture = slice.frame().texture();
        if let Some(texture) = texture {
            scratch.textured.fill(&scratch.row, slice.texture_line(texture).as_ref(), texture);
        }
        let starts = if texture.is_some() { scratch.textured.starts() } else { scratch.row.starts() };
        // In height fog rays may be endless; behind the start of the last run there is nothing to be found.
        let reach =
            if self.fog.is_some() { slice.reach().min(starts[starts.len() - 2]) } else { slice.reach() };
        scratch.index.fill(starts, reach, queries.len());
        scratch.index.find(starts, queries.gammas(), &mut scratch.query_runs);
        scratch.counts.runs += starts.len() as u64 - 1;
        if let Some(fog) = &self.fog {
            let BaranScratch { row, textured, query_runs, fog: sums, .. } = scratch;
            let colours = texture.map(|_| &*textured);
            let (starts, lit) = colours.map_or((row.starts(), row.lit()), |row| (row.starts(), row.lit()));
            let ends = &query_runs[..queries.len()];
            sums.sum(fog, slice, LitRuns { starts, lit, ends, colours }, queries);
        } else {
            for factors in 0..self.integrand.channels() {
                self.sum_bands(factors, slice, queries, scratch);
            }
        }
        if self.settings.ring_sine > 0.0 {
            let channels = if texture.is_some() { 3 } else { self.channels() };
            leave_ring(self.settings.ring_sine as f32, slice, queries, channels);
        }
    }

    fn report(&self, scratches: &mut dyn Iterator<Item = &BaranScratch>, stats: &mut RenderStats) {
        let (mut texels, mut runs, mut edges, mut too_deep) = (0, 0, 0, 0);
        for scratch in scratches {
            texels += scratch.counts.texels;
            runs += scratch.counts.runs;
            edges += scratch.fog.counts.edges;
            too_deep += scratch.fog.counts.too_deep;
        }
        if self.fog.is_some() {
            stats.counts.push("edges", edges);
            stats.counts.push("too deep in fog", too_deep);
        } else {
            stats.counts.push("bands", self.integrand.band_count() as u64);
            stats.counts.push("rank", self.integrand.rank() as u64);
        }
        stats.counts.push("texel columns", texels);
        stats.counts.push("runs", runs);
    }

    fn memory_bytes(&self) -> usize {
        self.integrand.memory_bytes()
    }

    fn scratch_bytes(scratch: &BaranScratch) -> usize {
        scratch.memory_bytes()
    }
}

impl BaranScratch {
    /// Grows all buffers to what any slice of such a frame may need.
    fn reserve(&mut self, room: &SliceRoom<'_>, integrand: &Integrand) {
        let SliceRoom { frame, columns, queries, mut runs, .. } = *room;
        let terms = integrand.lanes();
        self.row.clear(runs);
        if let Some(texture) = frame.texture() {
            let [width, height] = texture.projection().size();
            let side = width.max(height) as usize;
            self.textured.reserve(runs, side);
            runs += 2 * side + 4;
        }
        let grow = |buffer: &mut Vec<f32>, length: usize| buffer.resize(length.max(buffer.len()), 0.0);
        grow(&mut self.views, columns);
        grow(&mut self.prefix, (runs + 1) * terms);
        grow(&mut self.view_terms, columns * terms);
        let BandBuffers { ranks, ends, sums, wholes } = &mut self.band;
        for indices in [ranks, &mut self.query_runs] {
            if indices.len() < queries {
                indices.resize(queries, 0);
            }
        }
        grow(wholes, queries);
        grow(ends, queries * terms);
        grow(sums, queries * terms);
        grow(&mut self.lamp_prefix, integrand.buffer_len());
        // A lamp without a cone must not shine through that of the frame before.
        self.cone.clear();
        self.cone.reserve(integrand.buffer_len());
        self.sums.reserve(runs, columns, queries, terms);
        self.counts = Counts::default();
    }

    /// Bytes held.
    fn memory_bytes(&self) -> usize {
        let floats = [
            &self.views,
            &self.view_terms,
            &self.cone,
            &self.lamp_prefix,
            &self.prefix,
            &self.band.ends,
            &self.band.sums,
            &self.band.wholes,
        ];
        self.row.memory_bytes()
            + self.textured.memory_bytes()
            + self.sums.memory_bytes()
            + self.fog.memory_bytes()
            + size_of::<RunIndex>()
            + 4 * (self.band.ranks.capacity() + self.query_runs.capacity())
            + 4 * floats.iter().map(|buffer| buffer.capacity()).sum::<usize>()
    }
}

/// The factors' coordinate of each view ray: 1/sin β for a sun, β for a lamp.
#[inline(always)]
fn view_coordinates(slice: &SliceView<'_>, views: &mut [f32]) {
    let views = views.iter_mut().zip(slice.sines());
    match slice.light {
        SliceLight::Sun => {
            for (view, sine) in views {
                *view = 1.0 / sine;
            }
        }
        SliceLight::Lamp { .. } => {
            for ((view, sine), cosine) in views.zip(slice.cosines()) {
                *view = sine.atan2(*cosine);
            }
        }
    }
}

impl Baran {
    /// Sums what has the same factors, band by band: columns of one band follow each other.
    #[inline(always)]
    fn sum_bands(
        &self,
        factors: usize,
        slice: &SliceView<'_>,
        queries: &mut SliceQueries,
        scratch: &mut BaranScratch,
    ) {
        let order = slice.order;
        // Colours of a texture share the factors of grey media.
        let channels = match (self.integrand.channels(), slice.frame().texture()) {
            (1, None) => 0..1,
            (1, Some(_)) => 0..3,
            _ => factors..factors + 1,
        };
        let mut first = 0;
        while first < queries.len() {
            let column = queries.columns()[first] as usize;
            let views = &scratch.views[..order.count()];
            let (band, [from, to]) = self.integrand.band_of(factors, views[column]);
            let beyond = |&view: &f32| !(view >= from && view < to);
            let end = views[column..].iter().position(beyond).map_or(views.len(), |width| column + width);
            // A view that is not a number is in a band of its own.
            let end = end.max(column + 1);
            let last = first + queries.columns()[first..].partition_point(|&column| (column as usize) < end);
            let mut prefix = std::mem::take(&mut scratch.lamp_prefix);
            let (tables, lanes) = self.integrand.tables(factors, band, &scratch.cone, &mut prefix);
            let (range, channels) = (first..last, channels.clone());
            match lanes {
                1 => self.sum_band::<1>(&tables, (range, channels), slice, queries, scratch),
                2 => self.sum_band::<2>(&tables, (range, channels), slice, queries, scratch),
                4 => self.sum_band::<4>(&tables, (range, channels), slice, queries, scratch),
                _ => self.sum_band::<8>(&tables, (range, channels), slice, queries, scratch),
            }
            scratch.lamp_prefix = prefix;
            first = last;
        }
    }

    /// Sums the queries `range`, whose columns are of one band, for some channels.
    #[inline(always)]
    fn sum_band<const N: usize>(
        &self,
        tables: &BandTables<'_>,
        (range, channels): (Range<usize>, Range<usize>),
        slice: &SliceView<'_>,
        queries: &mut SliceQueries,
        scratch: &mut BaranScratch,
    ) {
        let order = slice.order;
        let textured = slice.frame().texture().map(|_| &scratch.textured);
        let (starts, lit) = match textured {
            Some(textured) => (textured.starts(), textured.lit()),
            None => (scratch.row.starts(), scratch.row.lit()),
        };
        let query_runs = &scratch.query_runs[range.clone()];
        let OpenQueries { columns, gammas, shares, .. } = queries.open(range);
        let count = columns.len();
        let runs = query_runs.iter().fold(0, |a, &b| a.max(b)) as usize + 1;
        // ∫Γ up to the starts of runs, and up to the ends of the pixels' rays.
        let table = Table::<N>::new(tables.prefix, 0.0, tables.per_gamma);
        let prefix = &mut scratch.prefix.as_chunks_mut::<N>().0[..=runs];
        table.read(&starts[..=runs], prefix);
        let BandBuffers { ranks, ends, sums, wholes } = &mut scratch.band;
        let (ends, sums) =
            (&mut ends.as_chunks_mut::<N>().0[..count], &mut sums.as_chunks_mut::<N>().0[..count]);
        table.read(gammas, ends);
        // B of the columns.
        let [from, to] = [columns[0], columns[count - 1]];
        let views = &mut scratch.view_terms.as_chunks_mut::<N>().0[..=(to - from) as usize];
        let weights = Table::<N>::new(tables.weights, tables.first_view as f32, tables.per_view);
        weights.read(&scratch.views[from as usize..][..views.len()], views);
        let views = Views { terms: views, first: from };
        let wholes = &mut wholes[..count];
        sums.copy_from_slice(ends);
        views.weigh(columns, sums, wholes);

        let ranks = &mut ranks[..count];
        for (rank, &column) in ranks.iter_mut().zip(columns) {
            *rank = order.rank(order.columns[0] + column);
        }
        let [a, b] = [ranks[0], ranks[count - 1]];
        let algorithm = self.settings.algorithm.unwrap_or_else(|| SumAlgorithm::fastest_for(count, runs));
        for channel in channels {
            let problem = Problem {
                runs: Runs {
                    lit: &lit[..runs],
                    prefix,
                    colour: textured.map(|textured| &textured.colour(channel)[..runs]),
                    columns: [a.min(b), a.max(b) + 1],
                },
                queries: Queries { ranks, runs: query_runs },
                ends,
                ascending: order.ascending,
            };
            sum_lit_runs(algorithm, &problem, &mut scratch.sums, sums);
            let shares = &mut shares[channel][..count];
            views.weigh(columns, sums, shares);
            // A texture may brighten.
            let brightest = if textured.is_some() { f32::MAX } else { 1.0 };
            share_of(wholes, brightest, shares);
        }
    }
}

/// What a band's queries are answered with: a number each, or one a term.
#[derive(Debug, Default)]
struct BandBuffers {
    /// Column, counted from the light.
    ranks: Vec<u32>,
    /// `∫Γ` up to the end of its ray, the lit part of it, and the whole one weighed by the column's B.
    ends: Vec<f32>,
    sums: Vec<f32>,
    wholes: Vec<f32>,
}
