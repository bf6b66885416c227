//! Where the rays of pixels end in a filtered map, sixteen side by side: column, row, depth among the row's view rays, and the two
//! references between which the pixel is.
//!
//! With a view ray `d` of any length, `b = along·d`, `n = across·d`, `a = to_light·d` in an orthonormal frame, so that `|d|² = b² + n² +
//! a²`: two square roots and four divisions are all that a pixel needs.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16, u32x16};
use scatter_core::Frame;

use super::references::References;
use super::row_depths::RowDepths;
use crate::projective::{MOST_SPLITS, OwnMap, Rectification};

/// In which row of a map pixels lie: a quotient of two numbers that are linear in a pixel's column and row.
#[derive(Debug, Clone, Copy)]
pub struct RowPlaces {
    /// `(y₁·b − n)·rows/(y₁ − y₀)` and `b`, of the first pixel, and of a step of columns and rows.
    pub above: [f64; 3],
    pub below: [f64; 3],
}

impl RowPlaces {
    /// For a frame and its map.
    pub fn new((frame, map, rectification): (&Frame<'_>, &OwnMap, &Rectification)) -> Self {
        let Rectification { along, across, rows: [low, high], .. } = *rectification;
        let directions = Rectification::view_rays(frame.camera());
        let scale = map.row_count() as f64 / (high - low);
        let below = directions.map(|v| along.dot(v));
        Self { above: directions.map(|v| (along * high - across).dot(v) * scale), below }
    }

    /// The line on and behind which pixels lie at the row's place or below it: `g₀ + g₁·x + g₂·y ≤ 0`.
    pub fn behind(&self, row: f64) -> [f64; 3] {
        std::array::from_fn(|part| row * self.below[part] - self.above[part])
    }
}

/// Where the rays of some pixels end in the map.
pub struct Places<S: Simd> {
    /// In texels, from the map's borders on.
    pub columns: f32x16<S>,
    /// First of the two rows, and the part of the other.
    pub rows: u32x16<S>,
    pub downs: f32x16<S>,
    /// 0 to 1, among the row's view rays.
    pub depths: f32x16<S>,
    /// Which of two neighbouring references are the pixel's, the first and second or the second and third, and the part of the latter.
    pub is_far: mask32x16<S>,
    pub parts: f32x16<S>,
}

/// What finds the ends of a frame's view rays.
pub struct RayEnds<'a> {
    row_depths: &'a RowDepths,
    references: References,
    /// `b`, `n`, `a` and the numerator of a row's place, of the first pixel, and of a step of columns and rows.
    parts: [[f32; 3]; 4],
    lamp: Option<f32>,
    /// Where a row begins: at its middle, or at its border where rows are not blended.
    shift: f32,
    /// κ at which each split begins, and columns a unit of κ that it has.
    splits: [[f32; 2]; MOST_SPLITS],
    split_count: usize,
    a_split: f32,
}

impl<'a> RayEnds<'a> {
    /// For a frame and its map.
    pub fn new(
        (frame, map, rectification): (&Frame<'_>, &OwnMap, &Rectification),
        row_depths: &'a RowDepths,
        references: References,
        blends_rows: bool,
    ) -> Self {
        let Rectification { along, across, to_light, lamp, .. } = *rectification;
        let directions = Rectification::view_rays(frame.camera());
        let a_split = map.columns_of_split() as f32;
        let mut splits = [[0.0f32; 2]; MOST_SPLITS];
        for (index, split) in splits.iter_mut().enumerate().take(map.split_count() as usize) {
            let [near, far] = map.split_borders(index as u32);
            *split = [near as f32, (f64::from(a_split) / (near - far)) as f32];
        }
        let along_axis = |axis: glam::DVec3| directions.map(|v| axis.dot(v) as f32);
        let rows = RowPlaces::new((frame, map, rectification)).above.map(|part| part as f32);
        Self {
            row_depths,
            references,
            parts: [along_axis(along), along_axis(across), along_axis(to_light), rows],
            lamp: lamp.map(|distance| distance as f32),
            shift: if blends_rows { 0.5 } else { 0.0 },
            splits,
            split_count: map.split_count() as usize,
            a_split,
        }
    }

    /// The ends of sixteen pixels' rays, whose columns and rows in the image and lengths are given; their rows in the map lie between
    /// `rows`, the first and the last.
    #[inline(always)]
    pub fn find<S: Simd>(
        &self,
        simd: S,
        [x, y]: [f32x16<S>; 2],
        ends: f32x16<S>,
        rows: [u32; 2],
    ) -> Places<S> {
        let of = |value: f32| f32x16::splat(simd, value);
        // (One by one: a function that `map` calls is not compiled for the CPU's vectors.)
        let linear = |part: usize| {
            let [first, column, row] = self.parts[part];
            x.mul_add(of(column), y.mul_add(of(row), of(first)))
        };
        let (b, n, a, row) = (linear(0), linear(1), linear(2), linear(3));
        // Of the ray's part in the plane of all light's normals, and of the ray.
        let flat = n.mul_add(n, b * b);
        let length = a.mul_add(a, flat).sqrt();
        let per_b = of(1.0) / b;
        // The measure of the slope −a/√(b² + n²) (`row_depths::measure`).
        let slopes = -a / (flat.sqrt() + a.abs());
        let ways = length * per_b;
        // An endless ray under a lamp ends at a limit of κ; a ray without length is nearer than all columns.
        let kappa = match self.lamp {
            None => ways / ends,
            Some(distance) => (of(distance) * length / ends - a) * per_b,
        };
        let place = (row * per_b - of(self.shift)).max(of(0.0));
        let (first, last) = (u32x16::splat(simd, rows[0]), u32x16::splat(simd, rows[1]));
        let rows = place.to_int::<u32x16<S>>().max(first).min(last);
        let downs = (place - rows.to_float::<f32x16<S>>()).max(of(0.0)).min(of(1.0));
        let [firsts, scales] = self.row_depths.at(simd, rows, downs);
        let depths = ((slopes - firsts) * scales).max(of(0.0)).min(of(1.0));
        let at = if self.lamp.is_some() { slopes } else { ways };
        let (is_far, parts) = self.references.blend(simd, at, ends);
        let (mut columns, a_split) = (of(0.0), of(self.a_split));
        for &[near, scale] in &self.splits[..self.split_count] {
            columns += ((of(near) - kappa) * of(scale)).max(of(0.0)).min(a_split);
        }
        Places { columns, rows, downs, depths, is_far, parts }
    }
}
