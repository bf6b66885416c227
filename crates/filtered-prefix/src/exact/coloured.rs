//! View rays through coloured light: every run of their row is a stretch of its own.

use epipolar::driver::{FrameLight, LightSums, SliceQueries};

use super::task::{BATCH, ExactTask, share_of};

/// Writes the shares of the view rays in doubt; returns how many stretches were integrated. O(runs · rays).
#[inline(always)]
pub fn sum_coloured(task: &ExactTask<'_>, sums: &mut LightSums, queries: &mut SliceQueries) -> u64 {
    let Some(colours) = task.runs.colours else { return 0 };
    let slice = task.slice;
    let light = FrameLight::new(slice.frame());
    let simd = slice.scene().simd;
    let mut stretches = 0;
    for first in (0..task.asked.len()).step_by(BATCH) {
        let batch = first..task.asked.len().min(first + BATCH);
        sums.clear();
        for ray in batch.clone() {
            let (query, column) = (task.asked.queries[ray] as usize, task.asked.columns[ray]);
            let end = f64::from(queries.ends()[query]);
            let index = column as usize;
            let (sine, cosine) = (f64::from(slice.sines()[index]), f64::from(slice.cosines()[index]));
            sums.begin(slice.view_ray(slice.order.columns[0] + column).direction, end as f32);
            let meets = |gamma: f32| slice.light.distance(gamma.into(), sine, cosine).clamp(0.0, end);
            let rank = task.asked.ranks[ray];
            let mut run = 0;
            let last = task.asked.ends[ray] as usize;
            while run <= last {
                if task.runs.lit[run] <= rank {
                    run += 1;
                    continue;
                }
                // As far as the light keeps its colour.
                let colour: [f32; 3] = std::array::from_fn(|channel| colours.colour(channel)[run]);
                let from = meets(task.runs.starts[run]);
                while run <= last
                    && task.runs.lit[run] > rank
                    && (0..3).all(|channel| colours.colour(channel)[run] == colour[channel])
                {
                    run += 1;
                }
                let to = if run > last { end } else { meets(task.runs.starts[run]) };
                if to > from {
                    sums.add_coloured(&light, simd, [from, to], colour);
                    stretches += 1;
                }
            }
        }
        sums.finish(&light, simd, true);
        let open = queries.open(0..queries.len());
        for (channel, shares) in open.shares.into_iter().enumerate() {
            for (ray, &query) in task.asked.queries[batch.clone()].iter().enumerate() {
                shares[query as usize] = share_of(sums, ray, channel, 3, false);
            }
        }
    }
    sums.clear();
    stretches
}
