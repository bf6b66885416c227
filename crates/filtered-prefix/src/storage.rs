//! How filtered rows are kept: as f32, as half floats, or as normalised bytes (Klehm et al. 2014, Section 3.3 and Appendix A).
//!
//! What is kept are running means of numbers in [−1, 1], which stay there: bytes hold them in steps of 2/255.

use half::f16;

/// Numbers of a filtered row in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Storage {
    /// Four bytes: to rounding.
    #[default]
    F32,
    /// Two bytes: steps of 2⁻¹¹ below 1.
    F16,
    /// One byte: steps of 2/255, the paper's.
    U8,
}

impl Storage {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 => 2,
            Self::U8 => 1,
        }
    }
}

/// Means of a row, `[run][coefficient]`; a buffer.
#[derive(Debug, Default)]
pub struct Means {
    storage: Storage,
    stride: usize,
    floats: Vec<f32>,
    halves: Vec<u16>,
    bytes: Vec<u8>,
}

impl Means {
    /// Room for `runs` runs of `stride` numbers each.
    pub fn make_room(&mut self, storage: Storage, runs: usize, stride: usize) {
        (self.storage, self.stride) = (storage, stride);
        let length = runs * stride;
        match storage {
            Storage::F32 if self.floats.len() < length => self.floats.resize(length, 0.0),
            Storage::F16 if self.halves.len() < length => self.halves.resize(length, 0),
            Storage::U8 if self.bytes.len() < length => self.bytes.resize(length, 0),
            _ => {}
        }
    }

    /// Keeps the means of a run.
    #[inline(always)]
    pub fn put(&mut self, run: usize, means: &[f32]) {
        let range = run * self.stride..run * self.stride + means.len();
        match self.storage {
            Storage::F32 => self.floats[range].copy_from_slice(means),
            Storage::F16 => {
                for (kept, &mean) in self.halves[range].iter_mut().zip(means) {
                    *kept = f16::from_f32(mean).to_bits();
                }
            }
            Storage::U8 => {
                for (kept, &mean) in self.bytes[range].iter_mut().zip(means) {
                    *kept = (127.5 * mean + 128.0).clamp(0.0, 255.0) as u8;
                }
            }
        }
    }

    /// The means of a run.
    #[inline(always)]
    pub fn get(&self, run: usize, out: &mut [f32]) {
        let range = run * self.stride..run * self.stride + out.len();
        match self.storage {
            Storage::F32 => out.copy_from_slice(&self.floats[range]),
            Storage::F16 => {
                for (out, &kept) in out.iter_mut().zip(&self.halves[range]) {
                    *out = f16::from_bits(kept).to_f32();
                }
            }
            Storage::U8 => {
                for (out, &kept) in out.iter_mut().zip(&self.bytes[range]) {
                    *out = f32::from(kept) * (2.0 / 255.0) - 1.0;
                }
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.floats.capacity() + 2 * self.halves.capacity() + self.bytes.capacity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_come_back_to_half_a_step() {
        let values: Vec<f32> = (0..=2000).map(|n| n as f32 / 1000.0 - 1.0).collect();
        for (storage, most) in
            [(Storage::F32, 0.0), (Storage::F16, 0.5f32.powi(12)), (Storage::U8, 1.0 / 254.9)]
        {
            let mut means = Means::default();
            means.make_room(storage, 3, values.len());
            for run in [2, 0, 1] {
                means.put(run, &values);
            }
            let mut found = vec![0.0; values.len()];
            means.get(2, &mut found);
            let worst = values.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            println!("{storage:?}: {worst} of {most}");
            assert!(worst <= most);
        }
    }
}
