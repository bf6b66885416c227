//! Depths of a filtered map's rows: each has its own range, that of the view rays which the image shows of it, in a measure that
//! counts directions nearly evenly.
//!
//! Klehm et al. (2014) have one range of z for the frustum, z being the tangent of the angle to the light's normal. Where the epipole is
//! near, most of that range is that of a few view rays; `t/(1 + |t|)` of the tangent grows with the angle to within a factor of
//! two (their depth warp of Section 5). What lies before all rays of a row, or behind, is no part of the basis.

use scatter_core::Camera;

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

    /// The same at places between the middles of rows: first depths, and inverses.
    #[inline(always)]
    pub fn at<const L: usize>(&self, places: &[f32; L]) -> [[f32; L]; 2] {
        let last = (self.ranges.len() - 2) as u32;
        let (mut rows, mut parts) = ([0u32; L], [0.0f32; L]);
        for lane in 0..L {
            let place = (places[lane] - 0.5).max(0.0);
            rows[lane] = (place as u32).min(last);
            parts[lane] = (place - rows[lane] as f32).min(1.0);
        }
        let mut ends = [[0.0f32; L]; 4];
        for lane in 0..L {
            let row = rows[lane] as usize;
            let [a, b] = [self.ranges[row], self.ranges[row + 1]];
            (ends[0][lane], ends[1][lane], ends[2][lane], ends[3][lane]) = (a[0], a[1], b[0], b[1]);
        }
        let mut out = [[0.0f32; L]; 2];
        for lane in 0..L {
            out[0][lane] = ends[0][lane] + parts[lane] * (ends[2][lane] - ends[0][lane]);
            out[1][lane] = ends[1][lane] + parts[lane] * (ends[3][lane] - ends[1][lane]);
        }
        out
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * self.ranges.capacity()
    }
}
