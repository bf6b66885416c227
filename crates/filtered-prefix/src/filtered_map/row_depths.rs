//! Depths of a filtered map's rows: each has its own range, that of the view rays which the image shows of it, in a measure that
//! counts directions nearly evenly.
//!
//! Klehm et al. (2014) have one range of z for the frustum, z being the tangent of the angle to the light's normal. Where the epipole is
//! near, most of that range is that of a few view rays; `t/(1 + |t|)` of the tangent grows with the angle to within a factor of
//! two (Section 5 wants a depth warp and gives none). What lies before all rays of a row, or behind, is no part of the basis.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use scatter_core::Camera;

use super::turned::{LANES, by_number};
use crate::projective::{OwnMap, Rectification};

/// Narrowest range of a row over the widest: rows at the image's corners show one direction, and their neighbours some.
const NARROWEST: f64 = 1.0 / 16.0;

/// The ranges of all rows; a buffer.
#[derive(Debug, Default)]
pub struct RowDepths {
    /// First depth, and the range's inverse; the last row's twice.
    ranges: Vec<[f32; 2]>,
}

/// The measure of a slope, −1 to 1; grows.
#[inline(always)]
pub fn measure(slope: f32) -> f32 {
    slope / (1.0 + slope.abs())
}

/// Cosine between the slice y and the bisectrix: z times it is the slope of a view ray in its slice.
#[inline(always)]
pub fn cosine(y: f32) -> f32 {
    1.0 / (1.0 + y * y).sqrt()
}

impl RowDepths {
    /// Ranges of a map's rows. O(rows).
    pub fn fill(&mut self, map: &OwnMap, rectification: &Rectification, camera: &Camera) {
        let rows = (0..map.row_count()).map(|row| {
            let y = map.row_middle(rectification, row);
            let own = cosine(y as f32);
            rectification.depths_of_slice(camera, y).map(|z| measure(z as f32 * own))
        });
        self.ranges.clear();
        self.ranges.extend(rows);
        let widest = self.ranges.iter().fold(0.0, |widest: f32, [first, last]| widest.max(last - first));
        let narrowest = (NARROWEST as f32 * widest).max(1e-6);
        for [first, last] in &mut self.ranges {
            let missing = 0.5 * (narrowest - (*last - *first)).max(0.0);
            (*first, *last) = (*first - missing, *last + missing);
            *last = 1.0 / (*last - *first);
        }
        self.ranges.extend(self.ranges.last().copied());
    }

    /// First depth and the inverse of the range, of one row.
    #[inline(always)]
    pub fn of_row(&self, row: usize) -> [f32; 2] {
        self.ranges[row]
    }

    /// The same between the middles of rows: first depths, and inverses; `parts` are those of the rows behind `rows`.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, rows: u32x16<S>, parts: f32x16<S>) -> [f32x16<S>; 2] {
        let mut two = [[0.0f32; 4]; LANES];
        for (two, &row) in two.iter_mut().zip(rows.as_slice()) {
            two.copy_from_slice(self.ranges[row as usize..][..2].as_flattened());
        }
        let [first, inverse, next_first, next_inverse] = by_number(simd, &two);
        [parts.mul_add(next_first - first, first), parts.mul_add(next_inverse - inverse, inverse)]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * self.ranges.capacity()
    }
}
