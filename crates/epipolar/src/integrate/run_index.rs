//! Which run a light ray is in: a table of buckets over γ, and a few steps from there.

/// Buckets of a row. More make the table slower to fill, fewer the steps longer.
const BUCKETS: usize = 1024;

/// An index over the runs of one row.
#[derive(Debug, Clone)]
pub struct RunIndex {
    first: [u32; BUCKETS + 1],
    per_gamma: f32,
}

impl Default for RunIndex {
    fn default() -> Self {
        Self { first: [0; BUCKETS + 1], per_gamma: 0.0 }
    }
}

impl RunIndex {
    /// Indexes runs by their starts, 0 first and ∞ last, for light rays up to `reach` ≥ 0.
    #[inline(always)]
    pub fn fill(&mut self, starts: &[f32], reach: f32) {
        let runs = starts.len() - 1;
        self.per_gamma = if reach < f32::MAX { BUCKETS as f32 / reach.max(f32::MIN_POSITIVE) } else { 0.0 };
        let mut filled = 0;
        for (run, &start) in starts[..runs].iter().enumerate().skip(1) {
            let bucket = self.bucket(start);
            while filled <= bucket {
                self.first[filled] = run as u32 - 1;
                filled += 1;
            }
            if filled > BUCKETS {
                return;
            }
        }
        self.first[filled..].fill(runs as u32 - 1);
    }

    #[inline(always)]
    fn bucket(&self, gamma: f32) -> usize {
        /// 2²³: an f32 that it is added to shows its nearest integer in its lowest bits.
        const INTEGERS: f32 = 8_388_608.0;
        let integer = (gamma * self.per_gamma + INTEGERS).to_bits().wrapping_sub(INTEGERS.to_bits());
        // What is larger, infinite or NaN is in the last one.
        (integer as usize).min(BUCKETS)
    }

    /// The run that holds γ; `near` is one where it may well be, such as that of a neighbouring pixel.
    #[inline(always)]
    pub fn find(&self, starts: &[f32], gamma: f32, near: u32) -> u32 {
        // Nothing lies behind ∞, where the last run ends.
        let gamma = gamma.min(f32::MAX);
        let mut run = near as usize;
        if starts[run] <= gamma && gamma < starts[run + 1] {
            return near;
        }
        run = self.first[self.bucket(gamma)] as usize;
        // Most buckets hold a border or none: a step that may be none costs less than a branch that nobody can foresee.
        run += usize::from(starts[run + 1] <= gamma);
        while starts[run + 1] <= gamma {
            run += 1;
        }
        run as u32
    }
}
