//! The numbers of a filtered map, as f32, half floats or normalised bytes (Klehm et al. 2014, Section 3.3 and Appendix A).

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::storage::Storage;

/// A number in [−1, 1] as it is kept.
pub trait Number: Copy + Send + Sync {
    /// Rounds.
    fn pack(value: f32) -> Self;
    /// The rounded number.
    fn unpack(self) -> f32;

    /// Rounds as many numbers as there are.
    #[inline(always)]
    fn pack_all(values: &[f32], out: &mut [Self]) {
        for (out, &value) in out.iter_mut().zip(values) {
            *out = Self::pack(value);
        }
    }

    /// The first [`EIGHT`] of some numbers.
    #[inline(always)]
    fn eight<S: Simd>(simd: S, numbers: &[Self]) -> f32x8<S> {
        let mut values = [0.0; EIGHT];
        for (value, number) in values.iter_mut().zip(numbers) {
            *value = number.unpack();
        }
        f32x8::from_slice(simd, &values)
    }
}

/// Numbers that are read side by side.
pub const EIGHT: usize = 8;

/// Numbers behind the last one, so that what is read side by side may be more than what is asked for.
pub const BEHIND: usize = 2 * EIGHT;

/// Bytes of a line of a CPU's cache: numbers begin at a border, so that eight of them are never in two lines.
const LINE: usize = 64;

impl Number for f32 {
    #[inline(always)]
    fn pack(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn unpack(self) -> f32 {
        self
    }

    #[inline(always)]
    fn eight<S: Simd>(simd: S, numbers: &[Self]) -> f32x8<S> {
        f32x8::from_slice(simd, &numbers[..EIGHT])
    }
}

impl Number for f16 {
    #[inline(always)]
    fn pack(value: f32) -> Self {
        Self::from_f32(value)
    }

    #[inline(always)]
    fn unpack(self) -> f32 {
        self.to_f32()
    }

    /// By the CPU's own instruction where it has one.
    #[inline(always)]
    fn eight<S: Simd>(simd: S, numbers: &[Self]) -> f32x8<S> {
        let mut values = [0.0; EIGHT];
        numbers[..EIGHT].convert_to_f32_slice(&mut values);
        f32x8::from_slice(simd, &values)
    }

    #[inline(always)]
    fn pack_all(values: &[f32], out: &mut [Self]) {
        out.convert_from_f32_slice(values);
    }
}

impl Number for u8 {
    #[inline(always)]
    fn pack(value: f32) -> Self {
        (127.5 * value + 128.0).clamp(0.0, 255.0) as Self
    }

    #[inline(always)]
    fn unpack(self) -> f32 {
        f32::from(self) * (2.0 / 255.0) - 1.0
    }
}

/// Numbers of one kind or another; a buffer.
#[derive(Debug, Default)]
pub struct Numbers {
    floats: Vec<f32>,
    halves: Vec<f16>,
    bytes: Vec<u8>,
}

/// What is done with numbers of any kind.
pub trait Visit {
    /// Does it.
    fn visit<T: Number>(self, numbers: &mut [T]);
}

impl Numbers {
    /// Room for so many numbers of a kind.
    pub fn make_room(&mut self, storage: Storage, count: usize) {
        let count = count + BEHIND + LINE;
        match storage {
            Storage::F32 => self.floats.resize(count, 0.0),
            Storage::F16 => self.halves.resize(count, f16::ZERO),
            Storage::U8 => self.bytes.resize(count, 0),
        }
    }

    /// Visits `count` of a kind, and [`BEHIND`].
    pub fn visit(&mut self, storage: Storage, count: usize, visit: impl Visit) {
        match storage {
            Storage::F32 => visit.visit(aligned(&mut self.floats, count)),
            Storage::F16 => visit.visit(aligned(&mut self.halves, count)),
            Storage::U8 => visit.visit(aligned(&mut self.bytes, count)),
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.floats.capacity() + 2 * self.halves.capacity() + self.bytes.capacity()
    }
}

/// So many numbers and those behind them, from a line's border on, where there is one to be found.
fn aligned<T>(numbers: &mut [T], count: usize) -> &mut [T] {
    let first = numbers.as_ptr().align_offset(LINE).min(LINE);
    &mut numbers[first..][..count + BEHIND]
}
