//! The lit part of every query's ray as closed forms between its edges.

use scatter_core::exp_f32;

use super::absorption::{
    FogInSlice, HeightFog, absorbed, length_at_densest, ln_densest, mild_depth, steep_depth,
};
use crate::driver::{EMPTY, SliceQueries, SliceView};
use crate::rows::{LitEdges, TexturedRow};

/// Edges that are evaluated side by side, at least: few stay in the innermost cache, many make long loops.
const BATCH: usize = 1024;

/// Scale heights that a ray may descend through thin air: f32 knows the exponent there to 2.4e-4, which is what density is off
/// by. Pixels that look deeper before they see fog are left to be walked, in f64.
const DEEPEST: f32 = 4096.0;

/// Logarithm of an extinction that leaves no light, over however short a stretch of what f32 holds.
const LN_OPAQUE: f32 = 200.0;

/// Logarithm of an optical depth from which on light is lost in proportion to it: to 3e-14.
const LN_THIN: f32 = -30.0;

/// Scale heights that mild rays descend, and logarithms of their extinction: products of their exponentials stay within f32.
const MILD: [f32; 2] = [20.0, 50.0];

/// The rays of a slice's queries, by the fog along them.
#[derive(Debug, Default)]
struct FogRays {
    /// 1/sin β of each; of mild rays times the extinction at the eye.
    factors: Vec<f32>,
    /// `−d(ln ρ)/dγ`.
    slopes: Vec<f32>,
    /// `ln σt·ρ(eye)`; of thin rays larger: light is lost in proportion, and f32 holds no 1e-39.
    ln_extinctions: Vec<f32>,
    /// Optical depth to the end.
    depths: Vec<f32>,
    /// Whether no ray comes near the limits of f32: each depth is an exponential cheaper.
    are_mild: bool,
}

impl FogRays {
    fn reserve(&mut self, count: usize) {
        for list in [&mut self.factors, &mut self.slopes, &mut self.ln_extinctions, &mut self.depths] {
            list.resize(count.max(list.len()), 0.0);
        }
    }

    /// The rays of some queries.
    #[inline(always)]
    fn fill(&mut self, fog: &FogInSlice, slice: &SliceView<'_>, columns: &[u32], gammas: &[f32]) {
        self.reserve(columns.len());
        let (sines, cosines) = (slice.sines(), slice.cosines());
        let rays = self.factors.iter_mut().zip(&mut self.slopes).zip(columns);
        for ((cosecant, slope), &column) in rays {
            *cosecant = 1.0 / sines[column as usize];
            *slope = cosines[column as usize];
        }
        let rays = self.factors.iter().zip(&mut self.slopes);
        let rays = rays.zip(self.ln_extinctions.iter_mut().zip(&mut self.depths)).zip(gammas);
        for (((&cosecant, slope), (ln_extinction, depth)), &gamma) in rays {
            *slope = fog.slope(cosecant, *slope);
            let length = length_at_densest(cosecant, *slope, gamma);
            let ln_at_densest = fog.ln_extinction + ln_densest(*slope, gamma);
            let lift = LN_THIN - (ln_at_densest + ln_below(length));
            let lift = if lift > 0.0 { lift } else { 0.0 };
            *ln_extinction = fog.ln_extinction + lift;
            *depth = length * exp_f32(ln_at_densest + lift);
        }
        let [deepest, largest] = MILD;
        let mut are_mild = true;
        for ((&slope, &ln_extinction), &gamma) in self.slopes.iter().zip(&self.ln_extinctions).zip(gammas) {
            are_mild &= (-slope * gamma < deepest) & (ln_extinction.abs() < largest);
        }
        self.are_mild = are_mild;
        if are_mild {
            let rays = self.factors.iter_mut().zip(&self.slopes);
            let rays = rays.zip(self.ln_extinctions.iter().zip(&mut self.depths)).zip(gammas);
            for (((factor, &slope), (&ln_extinction, depth)), &gamma) in rays {
                *factor *= exp_f32(ln_extinction);
                *depth = mild_depth(*factor, slope, gamma);
            }
        }
    }

    /// A query's edge.
    #[inline(always)]
    fn edge(&self, query: usize, gamma: f32) -> Edge {
        [gamma, self.factors[query], self.slopes[query], self.ln_extinctions[query]]
    }

    /// Optical depths up to edges.
    #[inline(always)]
    fn find_depths(&self, edges: &[Edge], depths: &mut [f32]) {
        if self.are_mild {
            for (depth, &[gamma, factor, slope, _]) in depths.iter_mut().zip(edges) {
                *depth = mild_depth(factor, slope, gamma);
            }
        } else {
            for (depth, &[gamma, cosecant, slope, ln_extinction]) in depths.iter_mut().zip(edges) {
                *depth = steep_depth(cosecant, slope, ln_extinction, gamma);
            }
        }
    }
}

/// A logarithm that is at most as large as that of a number > 0, by less than 0.7: its binary exponent.
#[inline(always)]
fn ln_below(number: f32) -> f32 {
    ((number.to_bits() >> 23) as i32 - 127) as f32 * std::f32::consts::LN_2
}

/// An edge of a query's ray: its light ray, and factor, slope and logarithm of the extinction of the query.
type Edge = [f32; 4];

/// Buffers of a worker.
#[derive(Debug, Default)]
pub struct ExactScratch {
    rays: FogRays,
    edges: LitEdges,
    batch: Vec<Edge>,
    /// Optical depth up to each edge, and the light that is lost up to there.
    depths: Vec<f32>,
    losses: Vec<f32>,
    /// Queries of the batch, and the edge behind the last of each.
    batched: Vec<[u32; 2]>,
    /// Edges that were evaluated, and pixels that are left to be walked.
    pub counts: ExactCounts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExactCounts {
    /// Closed forms between lit and dark stretches.
    pub edges: u64,
    /// Queries that look deeper into dense fog than f32 knows.
    pub too_deep: u64,
}

/// A slice's lit light rays and who asks for them.
#[derive(Clone, Copy)]
pub struct LitRuns<'a> {
    /// γ where each run starts; and the end of the last.
    pub starts: &'a [f32],
    /// Columns, counted from the light, that see each lit.
    pub lit: &'a [u32],
    /// The run in which each query's ray ends.
    pub ends: &'a [u32],
    /// Colours of the runs, where light passes a texture.
    pub colours: Option<&'a TexturedRow>,
}

impl ExactScratch {
    /// Room for slices of so many runs, columns and queries.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize) {
        self.rays.reserve(queries);
        self.edges.reserve(runs, columns);
        let most = BATCH + runs + 2;
        self.batch.resize(most.max(self.batch.len()), [0.0; 4]);
        for list in [&mut self.depths, &mut self.losses] {
            list.resize(most.max(list.len()), 0.0);
        }
        // A query may have no edge at all.
        self.batched.resize(queries.max(self.batched.len()), [0; 2]);
        self.counts = ExactCounts::default();
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let rays = [&self.rays.factors, &self.rays.slopes, &self.rays.ln_extinctions, &self.rays.depths];
        let floats = rays.into_iter().chain([&self.depths, &self.losses]).map(Vec::capacity).sum::<usize>();
        4 * floats + 16 * self.batch.capacity() + 8 * self.batched.capacity() + self.edges.memory_bytes()
    }

    /// Writes the share of its unoccluded light that every query's view ray sees lit.
    ///
    /// O(runs + edges that change + edges of all queries) closed forms; with a texture O(runs · queries).
    #[inline(always)]
    pub fn sum(
        &mut self,
        fog: &HeightFog,
        slice: &SliceView<'_>,
        runs: LitRuns<'_>,
        queries: &mut SliceQueries,
    ) {
        let count = queries.len();
        if count == 0 {
            return;
        }
        // A row keeps to its room, but for maps that are finer than the frame's room counts them.
        if self.batch.len() < BATCH + runs.lit.len() + 2 {
            let counts = self.counts;
            self.reserve(runs.lit.len(), 0, count);
            self.counts = counts;
        }
        let in_slice = fog.in_slice(&slice.plane);
        self.rays.fill(&in_slice, slice, queries.columns(), queries.gammas());
        match runs.colours {
            None => self.sum_edges(fog, slice, runs, queries),
            Some(colours) => self.sum_coloured(fog, slice, (runs, colours), queries),
        }
        if in_slice.ln_extinction + DEEPEST > LN_OPAQUE {
            return;
        }
        for channel in 0..if runs.colours.is_some() { 3 } else { fog.channels() } {
            let open = queries.open(0..count);
            let mut too_deep = 0;
            for ((share, &slope), &gamma) in
                open.shares[channel].iter_mut().zip(&self.rays.slopes).zip(open.gammas)
            {
                let deep = ln_densest(slope, gamma) > DEEPEST;
                *share = if deep { EMPTY } else { *share };
                too_deep += u64::from(deep);
            }
            self.counts.too_deep += if channel == 0 { too_deep } else { 0 };
        }
    }

    #[inline(always)]
    fn sum_edges(
        &mut self,
        fog: &HeightFog,
        slice: &SliceView<'_>,
        runs: LitRuns<'_>,
        queries: &mut SliceQueries,
    ) {
        let order = slice.order;
        let open = queries.open(0..queries.len());
        let count = open.columns.len();
        let rank = |query: usize| order.rank(order.columns[0] + open.columns[query]);
        let [a, b] = [rank(0), rank(count - 1)];
        let first = a.min(b);
        let used = runs.ends.iter().fold(0, |a, &b| a.max(b)) as usize + 1;
        let Self { rays, edges, batch, depths, losses, batched, counts } = self;
        edges.fill(&runs.lit[..used], first, (a.max(b) - first) as usize + 1);
        let (mut filled, mut asked) = (0, 0);
        for step in 0..count {
            let query = if order.ascending { count - 1 - step } else { step };
            edges.advance((rank(query) - first) as usize);
            let mut edge_of_query = rays.edge(query, 0.0);
            let mut is_lit = false;
            edges.up_to(runs.ends[query] as usize, |edge| {
                edge_of_query[0] = runs.starts[edge];
                batch[filled] = edge_of_query;
                // No light is lost up to the eye.
                filled += usize::from(edge > 0);
                is_lit = !is_lit;
            });
            edge_of_query[0] = open.gammas[query];
            batch[filled] = edge_of_query;
            filled += usize::from(is_lit);
            batched[asked] = [query as u32, filled as u32];
            asked += 1;
            if filled < BATCH && step + 1 < count {
                continue;
            }
            counts.edges += filled as u64;
            let (depths, losses) = (&mut depths[..filled], &mut losses[..filled]);
            rays.find_depths(&batch[..filled], depths);
            for channel in 0..fog.channels() {
                let relative = fog.relative(channel);
                for (loss, &depth) in losses.iter_mut().zip(&*depths) {
                    *loss = absorbed(relative * depth);
                }
                let shares = &mut *open.shares[channel];
                let mut from = 0;
                for &[query, to] in &batched[..asked] {
                    let own = &losses[from..to as usize];
                    // An odd number: the first stretch begins at the eye.
                    let (start, stretches) = own.split_at(own.len() % 2);
                    let mut sum = start.first().copied().unwrap_or(0.0);
                    for stretch in stretches.as_chunks::<2>().0 {
                        sum += stretch[1] - stretch[0];
                    }
                    shares[query as usize] = sum;
                    from = to as usize;
                }
            }
            (filled, asked) = (0, 0);
        }
        for channel in 0..fog.channels() {
            let relative = fog.relative(channel);
            for (share, &depth) in open.shares[channel].iter_mut().zip(&rays.depths) {
                *share = share_of(*share, absorbed(relative * depth), 1.0);
            }
        }
    }

    /// Every texel of a texture is a run of its own.
    #[inline(always)]
    fn sum_coloured(
        &mut self,
        fog: &HeightFog,
        slice: &SliceView<'_>,
        (runs, colours): (LitRuns<'_>, &TexturedRow),
        queries: &mut SliceQueries,
    ) {
        let order = slice.order;
        let open = queries.open(0..queries.len());
        for (query, (&column, &gamma)) in open.columns.iter().zip(open.gammas).enumerate() {
            let rank = order.rank(order.columns[0] + column);
            let end = runs.ends[query] as usize;
            let Self { rays, batch, depths, losses, counts, .. } = self;
            counts.edges += end as u64 + 1;
            let (batch, depths, losses) =
                (&mut batch[..end + 2], &mut depths[..end + 2], &mut losses[..end + 2]);
            let own = rays.edge(query, gamma);
            batch.fill(own);
            for (edge, &start) in batch.iter_mut().zip(&runs.starts[..=end]) {
                edge[0] = start;
            }
            rays.find_depths(batch, depths);
            for channel in 0..3 {
                let relative = if fog.channels() == 1 { 1.0 } else { fog.relative(channel) };
                for (loss, &depth) in losses.iter_mut().zip(&*depths) {
                    *loss = absorbed(relative * depth);
                }
                let colour = &colours.colour(channel)[..=end];
                let mut sum = 0.0;
                for ((pair, &colour), &lit) in losses.windows(2).zip(colour).zip(runs.lit) {
                    sum += if lit > rank { colour * (pair[1] - pair[0]) } else { 0.0 };
                }
                open.shares[channel][query] = share_of(sum, losses[end + 1], f32::MAX);
            }
        }
    }
}

/// The share that a lit part has of a whole; of nothing all.
#[inline(always)]
fn share_of(lit: f32, whole: f32, brightest: f32) -> f32 {
    let share = lit / whole;
    let share = if share > 0.0 { share } else { 0.0 };
    let share = if share < brightest { share } else { brightest };
    if whole > 0.0 { share } else { 1.0 }
}
