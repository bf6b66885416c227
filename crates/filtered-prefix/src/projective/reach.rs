//! How far view rays go across the light, found from the depth map.

use glam::DVec3;
use scatter_core::{Frame, Level, at_level, parallel};

/// Pixels side by side.
const LANES: usize = 16;

/// Where view rays end across the light, the farthest of each image row; a buffer.
#[derive(Debug, Default)]
pub struct Reach {
    rows: Vec<f64>,
}

impl Reach {
    /// κ of the farthest light ray that a view ray crosses; ∞ if none does. `directions` are the view ray of the first pixel and its
    /// change a column and a row, the light is its bisectrix, its direction and the distance of a lamp. O(pixels).
    pub fn farthest(
        &mut self,
        (frame, simd): (&Frame<'_>, Level),
        directions: &[DVec3; 3],
        (along, to_light, lamp): (DVec3, DVec3, Option<f64>),
    ) -> f64 {
        let [width, height] = frame.size().map(|side| side as usize);
        let parts = directions.map(|v| [along.dot(v), to_light.dot(v)]);
        let (depth, limit) = (frame.depth().texels(), frame.max_distance());
        self.rows.clear();
        self.rows.resize(height, f64::MAX);
        parallel::for_each_row(&mut self.rows, 1, |y, least| {
            let at = |n: usize| [parts[0][n] + parts[2][n] * y as f64, parts[1][n]];
            let row = RowOfPixels {
                across: at(0),
                towards: at(1),
                start: directions[0] + directions[2] * y as f64,
                step: directions[1],
                limit,
                lamp,
            };
            least[0] = at_level!(simd, row.least_column(&depth[y * width..][..width]));
        });
        let least = self.rows.iter().fold(f64::MAX, |least, &own| least.min(own));
        if least == f64::MAX { f64::INFINITY } else { least }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * self.rows.capacity()
    }
}

/// The view rays of an image row: what of them is across the light and towards it, first and a column, and they themselves.
struct RowOfPixels {
    across: [f64; 2],
    towards: [f64; 2],
    start: DVec3,
    step: DVec3,
    limit: f64,
    lamp: Option<f64>,
}

impl RowOfPixels {
    /// The least κ of rays that end at these depths.
    #[inline(always)]
    fn least_column(&self, depth: &[f32]) -> f64 {
        let mut least = [f64::MAX; LANES];
        for (block, depths) in depth.chunks(LANES).enumerate() {
            // A ray without length crosses no light ray.
            let mut ends = [0.0f32; LANES];
            ends[..depths.len()].copy_from_slice(depths);
            for lane in 0..LANES {
                let x = (block * LANES + lane) as f64;
                let (b, a) = (self.across[0] + self.across[1] * x, self.towards[0] + self.towards[1] * x);
                let length = (self.start + self.step * x).length();
                // Both over the ray's length, so that one division does.
                let end = f64::from(ends[lane]).min(self.limit);
                let column = match self.lamp {
                    None => length / (b * end),
                    // An endless ray has a limit.
                    Some(distance) if end < f64::INFINITY => (distance * length - a * end) / (b * end),
                    Some(_) => -a / b,
                };
                let column = if end > 0.0 { column } else { f64::MAX };
                least[lane] = if column < least[lane] { column } else { least[lane] };
            }
        }
        least.into_iter().fold(f64::MAX, f64::min)
    }
}
