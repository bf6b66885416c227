//! Numbers of sixteen texels or pixels, turned from number by number to texel by texel and back, in registers.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

/// Texels or pixels side by side.
pub const LANES: usize = 16;

/// What sixteen have, number by number; P is a power of two. Each step moves the lowest bit of a number's place to the top.
#[inline(always)]
pub fn by_number<const P: usize, S: Simd>(simd: S, rows: &[[f32; P]; LANES]) -> [f32x16<S>; P] {
    let flat = rows.as_flattened();
    let mut now: [f32x16<S>; P] =
        std::array::from_fn(|index| f32x16::from_slice(simd, &flat[index * LANES..][..LANES]));
    for _ in 0..P.ilog2() {
        let mut next = now;
        for pair in 0..P / 2 {
            (next[pair], next[P / 2 + pair]) = now[2 * pair].deinterleave(now[2 * pair + 1]);
        }
        now = next;
    }
    now
}

/// The inverse of [`by_number`].
#[inline(always)]
pub fn by_lane<const P: usize, S: Simd>(numbers: [f32x16<S>; P], rows: &mut [[f32; P]; LANES]) {
    let mut now = numbers;
    for _ in 0..P.ilog2() {
        let mut next = now;
        for pair in 0..P / 2 {
            (next[2 * pair], next[2 * pair + 1]) = now[pair].interleave(now[P / 2 + pair]);
        }
        now = next;
    }
    for (out, number) in rows.as_flattened_mut().chunks_exact_mut(LANES).zip(now) {
        number.store_slice(out);
    }
}

#[cfg(test)]
mod tests {
    use scatter_core::{at_level, simd_level};

    use super::*;

    #[test]
    fn numbers_are_turned_and_turned_back() {
        fn check<const P: usize>() {
            let rows: [[f32; P]; LANES] =
                std::array::from_fn(|lane| std::array::from_fn(|k| (100 * k + lane) as f32));
            let mut back = [[0.0; P]; LANES];
            at_level!(simd_level(), simd => {
                let numbers = by_number(simd, &rows);
                for (k, numbers) in numbers.iter().enumerate() {
                    for (lane, &number) in numbers.as_slice().iter().enumerate() {
                        assert_eq!(number, (100 * k + lane) as f32);
                    }
                }
                by_lane(numbers, &mut back);
            });
            assert_eq!(rows, back);
        }
        check::<8>();
        check::<16>();
    }
}
