//! The line of a slice under a sun through a parallel map: light rays are as far from each other everywhere.

use glam::{DVec2, DVec3};
use scatter_core::MapProjection;

use super::map_line::{DepthAlong, Gamma, MapLine};
use crate::geometry::{ColumnOrder, SlicePlane};

impl MapLine {
    /// The line of a slice under a sun through a parallel map, between two light rays at `span` \[distances from the eye\],
    /// 0 ≤ from ≤ to; `None` if it does not meet the map there.
    pub fn sun(
        projection: &MapProjection,
        eye: DVec3,
        plane: &SlicePlane,
        order: ColumnOrder,
        span: [f64; 2],
    ) -> Option<Self> {
        let ray = projection.ray(eye, DVec3::ZERO, plane.across);
        let along_light = projection.ray(eye, DVec3::ZERO, -plane.to_light).step.z;
        let [from, to] = Self::sun_span(projection, eye, plane, span)?;
        let major = usize::from(ray.step.y.abs() > ray.step.x.abs());
        let speed = ray.step[major].abs();
        // A light ray a texel apart; in a map without extent along the slice the line stays in one texel.
        let per_texel = if speed > 0.0 { 1.0 / speed } else { 0.0 };
        let [numerator, depth] = order.lit_rows(plane.column_from_plane());
        let depth_base = ray.start.z as f32;
        let start_depth = ray.start.z - f64::from(depth_base);
        let factors = |row: DVec2| {
            // q = γ and p = (z₀ + z₁·γ − z) / (depth per unit of light).
            let light = row.y / along_light;
            let per_gamma = row.x + light * ray.step.z;
            [per_gamma * from + light * start_depth, per_gamma * per_texel, -light, 0.0]
        };
        Self::walk_from(
            projection.size(),
            major,
            [ray.start.x, ray.start.y].map_with([ray.step.x, ray.step.y], |start, step| start + step * from),
            [ray.step.x, ray.step.y].map(|step| step * per_texel),
            speed * (to - from),
        )
        .map(|line| Self {
            gamma: Gamma::Distance([from as f32, per_texel as f32]),
            depth_along: DepthAlong::Parallel {
                start: ray.start.z,
                across: ray.step.z,
                to_light: -along_light,
                light_ray: [from, per_texel],
            },
            depth_base,
            lit_columns: [factors(numerator), factors(depth)].map(|row| row.map(|f| f as f32)),
            ..line
        })
    }

    /// The light rays of a slice, between two of them, that a parallel map holds; `None` if there are none. A parallel map
    /// holds the same part of the slice at every depth.
    pub fn sun_span(
        projection: &MapProjection,
        eye: DVec3,
        plane: &SlicePlane,
        [mut from, mut to]: [f64; 2],
    ) -> Option<[f64; 2]> {
        let ray = projection.ray(eye, DVec3::ZERO, plane.across);
        let size = projection.size().map(f64::from);
        for (axis, &count) in size.iter().enumerate() {
            let (start, step) = (ray.start[axis], ray.step[axis]);
            if step == 0.0 {
                if !(start >= 0.0 && start < count) {
                    return None;
                }
                continue;
            }
            let (a, b) = (-start / step, (count - start) / step);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        (from < to).then_some([from, to])
    }
}

/// Two arrays of two, element by element.
trait MapWith {
    fn map_with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;
}

impl MapWith for [f64; 2] {
    fn map_with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        [f(self[0], other[0]), f(self[1], other[1])]
    }
}
