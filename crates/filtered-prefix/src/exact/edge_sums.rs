//! A sun: a lit stretch is a difference of two transmittances, in a uniform medium and in height fog, many of them at a time.

use epipolar::driver::SliceQueries;
use epipolar::rows::LitEdges;

use super::task::ExactTask;
use crate::weights::{Fog, absorbed};

/// Edges that are evaluated side by side, at least.
const BATCH: usize = 1024;

/// Buffers for the stretches of a slice.
#[derive(Debug, Default)]
pub struct EdgeSums {
    /// Up to the rays' edges, in a uniform medium: lengths; in fog: light rays, and then depths of the thickest channel.
    lengths: Vec<f32>,
    /// Column of each edge, for fog.
    columns: Vec<u32>,
    /// What is absorbed up to there.
    losses: Vec<f32>,
    /// Queries of the batch, and the edge behind the last of each.
    batched: Vec<[u32; 2]>,
}

impl EdgeSums {
    /// Room for slices of so many runs and queries.
    pub fn reserve(&mut self, runs: usize, queries: usize) {
        let most = BATCH + runs + 2;
        for list in [&mut self.lengths, &mut self.losses] {
            list.resize(most.max(list.len()), 0.0);
        }
        self.columns.resize(most.max(self.columns.len()), 0);
        self.batched.resize(queries.max(self.batched.len()), [0; 2]);
    }

    /// Writes the shares of the view rays in doubt, which come in `places`, nearer and nearer to the light, of which the one farthest
    /// away has the rank `first`; returns how many edges they had. A closed form an edge and channel.
    #[inline(always)]
    pub fn sum(
        &mut self,
        task: &ExactTask<'_>,
        edges: &mut LitEdges,
        (first, places): (u32, impl Iterator<Item = usize>),
        fog: Option<&Fog>,
        queries: &mut SliceQueries,
    ) -> u64 {
        self.reserve(task.runs.lit.len(), task.asked.len());
        let sigma_t = task.slice.frame().medium().sigma_t().map(|sigma| sigma as f32);
        let factors = fog.map_or(sigma_t, |fog| fog.shares());
        let Self { lengths, columns, losses, batched } = self;
        let (mut filled, mut asked, mut total) = (0, 0, 0);
        let count = task.asked.len();
        for (step, ray) in places.enumerate() {
            let column = task.asked.columns[ray];
            let (cosecant, start) = (1.0 / task.slice.sines()[column as usize], filled);
            let factor = if fog.is_some() { 1.0 } else { cosecant };
            edges.advance((task.asked.ranks[ray] - first) as usize);
            let mut is_lit = false;
            edges.up_to(task.asked.ends[ray] as usize, |edge| {
                lengths[filled] = task.runs.starts[edge] * factor;
                // Nothing is absorbed up to the eye.
                filled += usize::from(edge > 0);
                is_lit = !is_lit;
            });
            let end = task.asked.gammas[ray] * factor;
            lengths[filled] = end;
            filled += usize::from(is_lit);
            // Last of each query, whatever it sees: the whole ray.
            lengths[filled] = end;
            filled += 1;
            if fog.is_some() {
                columns[start..filled].fill(column);
            }
            batched[asked] = [task.asked.queries[ray], filled as u32];
            asked += 1;
            if filled < BATCH && step + 1 < count {
                continue;
            }
            total += filled as u64;
            if let Some(fog) = fog {
                fog.find_depths(task.slice, &columns[..filled], &mut lengths[..filled]);
            }
            let open = queries.open(0..queries.len());
            for (shares, sigma) in open.shares.into_iter().zip(factors).take(task.channels) {
                for (loss, &length) in losses[..filled].iter_mut().zip(&lengths[..filled]) {
                    *loss = absorbed(sigma * length);
                }
                let mut from = 0;
                for &[query, to] in &batched[..asked] {
                    let (own, whole) = losses[from..to as usize].split_at(to as usize - from - 1);
                    // An odd number: the first stretch begins at the eye.
                    let (start, stretches) = own.split_at(own.len() % 2);
                    let mut sum = start.first().copied().unwrap_or(0.0);
                    for stretch in stretches.as_chunks::<2>().0 {
                        sum += stretch[1] - stretch[0];
                    }
                    let share = sum / whole[0];
                    // A ray without light has no shadow.
                    let share = if whole[0] > 0.0 { share } else { 1.0 };
                    shares[query as usize] = share.clamp(0.0, 1.0);
                    from = to as usize;
                }
            }
            (filled, asked) = (0, 0);
        }
        total
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.lengths.capacity() + self.columns.capacity() + self.losses.capacity())
            + 8 * self.batched.capacity()
    }
}
