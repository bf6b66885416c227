//! One slice answers pixels from its filtered rows, and integrates those exactly whose certificate does not suffice.
//!
//! All stages of a slice run one after the other on the same few kilobytes ([`PrefixScratch`]); only shares come out.

mod filtering;
mod open_rays;
mod scratch;

use epipolar::SliceIntegrator;
use epipolar::driver::{SliceQueries, SliceRoom, SliceSetup, SliceView, TileUse, channels_of};
use scatter_core::{Light, RenderStats};

use self::scratch::PrefixScratch;
use crate::exact::{ExactTask, LampFactors, Ways, band_ratio, has_many_edges};
use crate::moments::Answer;
use crate::options::{Basis, Depths, Filter, Options, Weighting};
use crate::projective::OwnMap;
use crate::runs::Runs;
use crate::weights::{Fog, Weights};

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
        let Options { depths, basis, storage, coefficients, .. } = self.options;
        if depths != Depths::Places {
            scratch.depths.reserve(columns, runs, queries);
        }
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
        scratch.counts = scratch::Counts::default();
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
        scratch.find_runs(slice, runs, queries);
        let exact_at_once =
            self.options.certified && self.options.filter == Filter::Auto && self.ways.is_plain_sun;
        if exact_at_once {
            scratch.asked.take_all(slice, queries, &scratch.query_runs);
        }
        // Sums over all lit runs know what is lit all along, or nowhere.
        if !(exact_at_once && has_many_edges(&runs, &scratch.asked)) {
            scratch.find_open(slice, runs, (queries, channels));
        }
        if scratch.asked.len() > 0 {
            if !exact_at_once {
                scratch.is_doubted[..scratch.asked.len()].fill(false);
                let PrefixScratch { depths, asked, .. } = &mut *scratch;
                if !self.lamp.are_there() {
                    depths.measure(self.options.depths, slice, runs, asked);
                }
                for channel in 0..channels {
                    if self.lamp.are_there() {
                        let PrefixScratch { summed_lamp, asked, answers, .. } = &mut *scratch;
                        summed_lamp.answer(&self.lamp, (slice, runs), (asked, channel), answers);
                    } else {
                        self.answer(slice, runs, channel, scratch);
                    }
                    self.take_answers(queries, channel, scratch);
                }
                scratch.depths.restore(&mut scratch.asked);
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
        scratch::report(scratches, stats);
    }

    fn memory_bytes(&self) -> usize {
        self.weights.memory_bytes() + self.lamp.memory_bytes() + self.own_map.memory_bytes()
    }

    fn scratch_bytes(scratch: &PrefixScratch) -> usize {
        scratch.memory_bytes()
    }
}
