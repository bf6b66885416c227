//! A slice's samples as the columns of its fan see them: what every pixel of a column takes of the slice (Yusov 2012, Section 6.6,
//! the half of the bilinear weights that runs along slices).
//!
//! A slice borders two gaps, and each gap has a few pixels a column: what depends on slice and column alone is worked out once.

use super::line_samples::LineSamples;

/// Two neighbouring samples of one slice, around the middle of a column.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Where their rays end.
    pub ends: [f32; 2],
    /// Weights of the two: 0 for both where the place is beyond the slice.
    pub parts: [f32; 2],
    /// Which they are.
    pub indices: [usize; 2],
}

/// One slice's samples, interpolated to columns; a buffer.
#[derive(Debug, Default)]
pub struct LineColumns {
    /// The nearer and the farther end of the two samples beside each column: −∞ and ∞ where it is beyond the slice.
    pub nearest: Vec<f32>,
    /// As above.
    pub farthest: Vec<f32>,
    /// Their interpolated share, `[channel][column]`.
    pub shares: [Vec<f32>; 3],
    /// The first of the two samples, and the second one's part.
    befores: Vec<u32>,
    parts: Vec<f32>,
}

impl LineColumns {
    /// Room for so many columns, in some channels.
    pub fn reserve(&mut self, columns: usize, channels: usize) {
        for buffer in [&mut self.nearest, &mut self.farthest, &mut self.parts]
            .into_iter()
            .chain(&mut self.shares[..channels])
        {
            buffer.clear();
            buffer.reserve(columns);
        }
        self.befores.clear();
        self.befores.reserve(columns);
    }

    /// Interpolates samples to `count` columns from `first` on.
    #[inline(always)]
    pub fn fill(&mut self, samples: &LineSamples, first: u32, count: usize, channels: usize) {
        let Self { nearest, farthest, shares, befores, parts } = self;
        nearest.resize(count, 0.0);
        farthest.resize(count, 0.0);
        parts.resize(count, 0.0);
        befores.resize(count, 0);
        if samples.count == 0 {
            nearest.fill(f32::NEG_INFINITY);
            farthest.fill(f32::INFINITY);
            shares[..channels].iter_mut().for_each(|shares| shares.resize(count, 0.0));
            return;
        }
        let per_column = 1.0 / samples.step;
        let start = (f64::from(first) + 0.5 - samples.first) * per_column;
        let last = (samples.count - 1) as f32;
        let last_before = samples.count.saturating_sub(2) as f32;
        let slack = slack(samples);
        let columns = nearest.iter_mut().zip(&mut *farthest).zip(&mut *parts).zip(&mut *befores);
        for (offset, (((nearest, farthest), part), before)) in columns.enumerate() {
            let place = (start + per_column * offset as f64) as f32;
            let clamped = place.max(0.0).min(last);
            // Not negative, so that a cast rounds down.
            let one = clamped.min(last_before) as i32;
            *part = clamped - one as f32;
            *before = one as u32;
            let beyond = place < -slack || place > last + slack;
            *nearest = if beyond { f32::NEG_INFINITY } else { f32::INFINITY };
            *farthest = if beyond { f32::INFINITY } else { 0.0 };
        }
        let step = usize::from(samples.count > 1);
        let columns = nearest.iter_mut().zip(farthest).zip(&*befores);
        for ((nearest, farthest), &before) in columns {
            let (a, b) = (samples.ends[before as usize], samples.ends[before as usize + step]);
            *nearest = nearest.min(a.min(b));
            *farthest = farthest.max(a.max(b));
        }
        for (own, all) in shares[..channels].iter_mut().zip(&samples.shares) {
            own.resize(count, 0.0);
            for ((share, &before), &part) in own.iter_mut().zip(&*befores).zip(&*parts) {
                let (a, b) = (all[before as usize], all[before as usize + step]);
                *share = (1.0 - part) * a + part * b;
            }
        }
    }

    /// The two samples beside a column, which were interpolated to it.
    pub fn pair(&self, samples: &LineSamples, offset: usize) -> Pair {
        if samples.count == 0 {
            return Pair { ends: [0.0; 2], parts: [0.0; 2], indices: [0; 2] };
        }
        let before = self.befores[offset] as usize;
        let indices = [before, (before + 1).min(samples.count - 1)];
        let part = self.parts[offset];
        let is_beyond = self.nearest[offset] == f32::NEG_INFINITY;
        let parts = if is_beyond { [0.0; 2] } else { [1.0 - part, part] };
        Pair { ends: indices.map(|index| samples.ends[index]), parts, indices }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let shares: usize = self.shares.iter().map(Vec::capacity).sum();
        4 * (shares
            + self.nearest.capacity()
            + self.farthest.capacity()
            + self.befores.capacity()
            + self.parts.capacity())
    }
}

/// How far beyond its samples a slice still counts \[samples\]: pixels a sample or a pixel before the first one still see it, and
/// half a one more, so that rounding does not decide.
#[inline(always)]
fn slack(samples: &LineSamples) -> f32 {
    1.0f32.max((1.0 / samples.step.abs()) as f32) + 0.5
}
