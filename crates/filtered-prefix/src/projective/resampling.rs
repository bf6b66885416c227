//! A projective map from the frame's own one: each light ray's texel of the first layer that holds it.
//!
//! Along a row of the map everything is linear in one number a column: of a sun in 1/κ, of a lamp in κ. So texels are found and turned
//! into depths sixteen side by side, one division or two each, in f64.

use glam::DVec3;
use scatter_core::{Level, ShadowLayer, ShadowMap, at_level, parallel};

use super::rectification::Rectification;

/// Texels side by side.
const LANES: usize = 16;

/// Fills texels of a split, rows on all threads. O(texels·layers).
pub fn resample(
    simd: Level,
    (rectification, [near, far]): (&Rectification, [f64; 2]),
    shadow: &ShadowMap<'_>,
    width: usize,
    texels: &mut [f32],
) {
    let rows = texels.len() / width;
    let [low, high] = rectification.rows;
    let step = (far - near) / width as f64;
    parallel::for_each_row(texels, width, |row, texels| {
        let y = high - (high - low) * (row as f64 + 0.5) / rows as f64;
        at_level!(simd, fill_row(rectification, y, [near, step], shadow, texels));
    });
}

/// A texel whose light ray no layer has held yet: less than all depths.
const MISSING: f32 = -1.0;

/// Fills one row, layer by layer.
#[inline(always)]
fn fill_row(
    rectification: &Rectification,
    y: f64,
    [near, step]: [f64; 2],
    shadow: &ShadowMap<'_>,
    texels: &mut [f32],
) {
    texels.fill(MISSING);
    for layer in shadow.layers() {
        let row = RowOfLayer::new(rectification, y, &layer);
        let mut is_whole = true;
        for (block, texels) in texels.chunks_mut(LANES).enumerate() {
            let mut depths = [0.0f32; LANES];
            depths[..texels.len()].copy_from_slice(texels);
            if depths.iter().all(|&depth| depth >= 0.0) {
                continue;
            }
            let mut columns = [0.0f64; LANES];
            for (lane, column) in columns.iter_mut().enumerate() {
                *column = near + step * ((block * LANES + lane) as f64 + 0.5);
            }
            row.find(rectification, &layer, &columns, &mut depths);
            is_whole &= depths.iter().all(|&depth| depth >= 0.0);
            texels.copy_from_slice(&depths[..texels.len()]);
        }
        if is_whole {
            return;
        }
    }
    // What no layer holds is lit.
    for texel in texels {
        *texel = if *texel < 0.0 { f32::INFINITY } else { *texel };
    }
}

/// Where the light rays of a row lie in a layer: `start + slope·q` each, q = 1/κ of a sun and κ of a lamp.
struct RowOfLayer {
    is_sun: bool,
    is_perspective: bool,
    /// Map coordinates of the rays' texels; of a perspective map times the third.
    texel: [DVec3; 2],
    /// Depths at the light rays' starts and a unit along them.
    depth: [[f64; 2]; 2],
}

impl RowOfLayer {
    #[inline(always)]
    fn new(rectification: &Rectification, y: f64, layer: &ShadowLayer<'_>) -> Self {
        let projection = layer.projection();
        let towards = rectification.along + rectification.across * y;
        let to_light = rectification.to_light;
        // Light rays begin at `start` and go along `way`, both linear in q.
        let (start, way) = match rectification.lamp {
            None => ([DVec3::ZERO, towards], [-to_light, DVec3::ZERO]),
            Some(distance) => ([to_light * distance, DVec3::ZERO], [towards, -to_light]),
        };
        let ray = projection.ray(rectification.eye, start[0], way[0]);
        let slopes = [start[1], way[1]].map(|v| projection.ray(DVec3::ZERO, DVec3::ZERO, v).step);
        let is_perspective = projection.is_perspective();
        Self {
            is_sun: rectification.lamp.is_none(),
            is_perspective,
            // From a lamp on all coordinates grow alike; of a sun the texel does not change.
            texel: if is_perspective { [ray.step, slopes[1]] } else { [ray.start, slopes[0]] },
            depth: [[ray.start.z, slopes[0].z], [ray.step.z, slopes[1].z]],
        }
    }

    /// Depths of the surfaces of those light rays that are missing yet and that the layer holds; ∞ behind the range.
    #[inline(always)]
    fn find(
        &self,
        rectification: &Rectification,
        layer: &ShadowLayer<'_>,
        columns: &[f64; LANES],
        out: &mut [f32; LANES],
    ) {
        let [width, height] = layer.projection().size();
        let (last, texels) = ([f64::from(width), f64::from(height)], layer.texels());
        let [start, slope] = self.texel;
        let mut places = [0u32; LANES];
        let mut found = [0u32; LANES];
        let mut depths = [[0.0f64; LANES]; 2];
        for lane in 0..LANES {
            let q = if self.is_sun { 1.0 / columns[lane] } else { columns[lane] };
            let [mut u, mut v] = [start.x + slope.x * q, start.y + slope.y * q];
            let scale = if self.is_perspective { start.z + slope.z * q } else { 1.0 };
            if self.is_perspective {
                let inverse = 1.0 / scale;
                (u, v) = (u * inverse, v * inverse);
            }
            let holds = (scale > 0.0) & (u >= 0.0) & (v >= 0.0) & (u < last[0]) & (v < last[1]);
            found[lane] = u32::from(holds);
            let (u, v) = (if holds { u } else { 0.0 }, if holds { v } else { 0.0 });
            places[lane] = whole(v) * width + whole(u);
            for (depths, [start, slope]) in depths.iter_mut().zip(self.depth) {
                depths[lane] = start + slope * q;
            }
        }
        let mut stored = [0.0f32; LANES];
        for (stored, &place) in stored.iter_mut().zip(&places) {
            *stored = texels[place as usize];
        }
        let [first, end] = rectification.depths;
        let per_depth = 1.0 / (end - first);
        for lane in 0..LANES {
            let way = (f64::from(stored[lane]) - depths[0][lane]) / depths[1][lane];
            let z = (rectification.depth_at(columns[lane], way) - first) * per_depth;
            let z = if z > 1.0 { f32::INFINITY } else { z.max(0.0) as f32 };
            out[lane] = if (found[lane] != 0) & (out[lane] < 0.0) { z } else { out[lane] };
        }
    }
}

/// The whole part of a number from 0 to 2³¹, by sums that CPUs do side by side.
#[inline(always)]
fn whole(value: f64) -> u32 {
    /// 2⁵²: what is added to it is rounded to whole numbers, which its lowest bits are.
    const ROUND: f64 = 4_503_599_627_370_496.0;
    let near = (value + ROUND) - ROUND;
    let floor = if near > value { near - 1.0 } else { near };
    (floor + ROUND).to_bits() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_are_those_of_a_cast() {
        let mut random = scatter_testing::Random(11);
        let near = |value: f64| [value.next_down().max(0.0), value, value.next_up()];
        let edges = [0.0, 0.5, 1.0, 1.5, 2.0, 8191.0, 65_535.0, f64::from(1u32 << 31)];
        let random = (0..1000).map(|_| random.range(0.0, 65_536.0));
        for value in edges.into_iter().chain(random).flat_map(near) {
            assert_eq!(whole(value), value as u32, "{value}");
        }
    }
}
