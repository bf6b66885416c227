//! Which run a light ray is in: a table of buckets over γ, and a few steps from there.

/// Most buckets of a row.
const MOST: usize = 4096;

/// Fewest buckets of a row.
const FEWEST: usize = 256;

/// An index over the runs of one row.
#[derive(Debug, Clone)]
pub struct RunIndex {
    /// Per bucket the last run that begins before it.
    first: [u32; MOST + 1],
    last: u32,
    per_gamma: f32,
}

impl Default for RunIndex {
    fn default() -> Self {
        Self { first: [0; MOST + 1], last: 0, per_gamma: 0.0 }
    }
}

impl RunIndex {
    /// Indexes runs by their starts, 0 first and ∞ last, for some light rays up to `reach` ≥ 0. Where more are to be
    /// found, finding them faster is worth more buckets.
    #[inline(always)]
    pub fn fill(&mut self, starts: &[f32], reach: f32, queries: usize) {
        let buckets = (queries + starts.len()).clamp(FEWEST, MOST).next_power_of_two();
        self.last = buckets as u32;
        self.per_gamma = if reach < f32::MAX { buckets as f32 / reach.max(f32::MIN_POSITIVE) } else { 0.0 };
        let first = &mut self.first[..=buckets];
        first.fill(0);
        for (run, &start) in starts[..starts.len() - 1].iter().enumerate() {
            // The last one that begins in a bucket is where the next one begins.
            let next = bucket(start, self.per_gamma, self.last) as usize + 1;
            if let Some(first) = first.get_mut(next) {
                *first = run as u32;
            }
        }
        let mut run = 0;
        for first in first {
            run = run.max(*first);
            *first = run;
        }
    }

    /// The runs that hold light rays ≥ 0.
    #[inline(always)]
    pub fn find(&self, starts: &[f32], gammas: &[f32], runs: &mut [u32]) {
        for (run, &gamma) in runs.iter_mut().zip(gammas) {
            *run = bucket(gamma, self.per_gamma, self.last);
        }
        for (found, &gamma) in runs.iter_mut().zip(gammas) {
            // Nothing lies behind ∞, where the last run ends.
            let gamma = if gamma < f32::MAX { gamma } else { f32::MAX };
            let mut run = self.first[*found as usize] as usize;
            // Most buckets hold a border or none: a step that may be none costs less than a branch that nobody can foresee.
            run += usize::from(starts[run + 1] <= gamma);
            while starts[run + 1] <= gamma {
                run += 1;
            }
            *found = run as u32;
        }
    }
}

/// The bucket of a light ray; what is larger, infinite or NaN is in the last one.
#[inline(always)]
fn bucket(gamma: f32, per_gamma: f32, last: u32) -> u32 {
    /// 2²³: an f32 that it is added to shows its nearest integer in its lowest bits.
    const INTEGERS: f32 = 8_388_608.0;
    (gamma * per_gamma + INTEGERS).to_bits().wrapping_sub(INTEGERS.to_bits()).min(last)
}
