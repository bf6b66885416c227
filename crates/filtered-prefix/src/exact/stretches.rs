//! Lit stretches of view rays, by the edges of their slice's row.

use epipolar::driver::{FrameLight, LightSums, SliceQueries};
use epipolar::rows::LitEdges;

use super::coloured::sum_coloured;
use super::edge_sums::EdgeSums;
use super::summed_sun::{SummedSun, mean_edges};
use super::task::{BATCH, ExactTask, Ways, share_of};
use crate::runs::{Asked, Runs};

/// Buffers for the exact integrals of a slice.
#[derive(Debug, Default)]
pub struct ExactSums {
    edges: LitEdges,
    sums: LightSums,
    by_edges: EdgeSums,
    summed: SummedSun,
    /// Lit stretches that were integrated.
    pub stretches: u64,
}

/// Mean edges of a view ray from which on sums over all lit runs cost less than a closed form an edge.
const MANY_EDGES: f32 = 4.0;

/// Whether view rays have so many edges that sums over all lit runs cost less than their closed forms.
#[inline(always)]
pub fn has_many_edges(runs: &Runs<'_>, asked: &Asked) -> bool {
    mean_edges(&runs.lit[..asked.used_runs()], asked.rank_range()) > MANY_EDGES
}

impl ExactSums {
    /// Room for slices of so many runs, columns and queries.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize) {
        self.edges.reserve(runs, columns);
        self.sums.reserve(BATCH);
        self.by_edges.reserve(runs, queries);
        self.summed.reserve(runs, columns, queries);
        self.stretches = 0;
    }

    /// Writes the shares of the view rays in doubt.
    ///
    /// In white light O(runs + edges of all rays), under a plain sun a closed form an edge; with a texture O(runs · rays).
    #[inline(always)]
    pub fn sum(&mut self, task: &ExactTask<'_>, ways: &Ways, queries: &mut SliceQueries) {
        let count = task.asked.len();
        if count == 0 {
            return;
        }
        let is_coloured = task.runs.colours.is_some();
        if ways.is_plain_sun && (is_coloured || has_many_edges(&task.runs, task.asked)) {
            self.summed.sum(task, &ways.ratios, queries);
            return;
        }
        if is_coloured {
            self.stretches += sum_coloured(task, &mut self.sums, queries);
            return;
        }
        let order = task.slice.order;
        let [first, last] = task.asked.rank_range();
        self.edges.fill(&task.runs.lit[..task.asked.used_runs()], first, (last - first) as usize + 1);
        let places = (0..count).map(|step| if order.ascending { count - 1 - step } else { step });
        if ways.is_plain_sun || ways.fog.is_some() {
            let edges = (first, places);
            self.stretches += self.by_edges.sum(task, &mut self.edges, edges, ways.fog.as_ref(), queries);
            return;
        }
        let frame = task.slice.frame();
        let light = FrameLight::new(frame);
        let simd = task.slice.scene().simd;
        let mut batch = [0u32; BATCH];
        let mut batched = 0;
        for (step, ray) in places.enumerate() {
            let (query, column) = (task.asked.queries[ray] as usize, task.asked.columns[ray]);
            let end = f64::from(queries.ends()[query]);
            let index = column as usize;
            let (sine, cosine) =
                (f64::from(task.slice.sines()[index]), f64::from(task.slice.cosines()[index]));
            let view_ray = task.slice.view_ray(task.slice.order.columns[0] + column);
            self.sums.begin(view_ray.direction, end as f32);
            self.edges.advance((task.asked.ranks[ray] - first) as usize);
            let mut from = None;
            let mut found = 0;
            let (edges, sums) = (&self.edges, &mut self.sums);
            edges.up_to(task.asked.ends[ray] as usize, |edge| {
                let gamma = task.runs.starts[edge].into();
                let at = task.slice.light.distance(gamma, sine, cosine).clamp(0.0, end);
                from = match from {
                    None => Some(at),
                    Some(from) => {
                        if at > from {
                            sums.add(&light, simd, [from, at]);
                            found += 1;
                        }
                        None
                    }
                };
            });
            if let Some(from) = from.filter(|&from| end > from) {
                self.sums.add(&light, simd, [from, end]);
                found += 1;
            }
            self.stretches += found;
            batch[batched] = query as u32;
            batched += 1;
            if batched == BATCH || step + 1 == count {
                self.sums.finish(&light, simd, false);
                let open = queries.open(0..queries.len());
                for (channel, shares) in open.shares.into_iter().enumerate().take(task.channels) {
                    for (ray, &query) in batch[..batched].iter().enumerate() {
                        shares[query as usize] = share_of(&self.sums, ray, channel, task.channels, true);
                    }
                }
                self.sums.clear();
                batched = 0;
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.edges.memory_bytes()
            + self.sums.memory_bytes()
            + self.by_edges.memory_bytes()
            + self.summed.memory_bytes()
    }
}
