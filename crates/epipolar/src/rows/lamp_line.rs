//! The line of a slice under a lamp through a perspective map: light rays meet in the lamp, which is the map's centre.

use glam::{DVec2, DVec3};
use scatter_core::MapProjection;

use super::map_line::{DepthAlong, Gamma, MapLine};
use crate::geometry::{ColumnOrder, SlicePlane, direction_of_diamond_angle};

impl MapLine {
    /// The line of a slice under a lamp through a perspective map, one face of a cube or a spot's, between two light
    /// rays at `span` \[diamond angles, 0 to 2\]; `None` if it does not meet the map there. `distance` is that of the lamp from
    /// the eye.
    pub fn lamp(
        projection: &MapProjection,
        plane: &SlicePlane,
        order: ColumnOrder,
        distance: f64,
        [begin, reach]: [f64; 2],
    ) -> Option<Self> {
        // Homogeneous texels of the directions towards the eye and across: a light ray `p·towards + q·across` is seen
        // at `p·a + q·e`.
        let image = |direction: DVec3| projection.ray(DVec3::ZERO, DVec3::ZERO, direction).step;
        let (a, e) = (image(-plane.to_light), image(plane.across));
        let line = a.cross(e);
        // The way that the texel goes as γ grows.
        let heading = DVec2::new(line.y, -line.x);
        let major = usize::from(heading.y.abs() > heading.x.abs());
        let speed = heading[major].abs();
        if !(speed > 0.0) {
            return None;
        }
        // A slice may run along the edge between two faces of a cube: rounding must not leave it to neither. [texels]
        const EDGE: f64 = 1e-9;
        let size = DVec2::from(projection.size().map(f64::from));
        let normal = line.truncate();
        let middle = 0.5 * size;
        let base = middle - normal * ((normal.dot(middle) + line.z) / normal.length_squared());
        let step = heading / speed;
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (axis, &count) in size.as_ref().iter().enumerate() {
            if step[axis] == 0.0 {
                if !(base[axis] >= -EDGE && base[axis] <= count + EDGE) {
                    return None;
                }
                continue;
            }
            let (one, other) = ((-EDGE - base[axis]) / step[axis], (count + EDGE - base[axis]) / step[axis]);
            from = from.max(one.min(other));
            to = to.min(one.max(other));
        }
        // The light ray through a texel, at depth 1: both parts are linear along the line.
        let determinant = a.z * e[major] - e.z * a[major];
        let towards = |at: f64| (e[major] - e.z * at) / determinant;
        let across = |at: f64| (a.z * at - a[major]) / determinant;
        let along = |part: &dyn Fn(f64) -> f64| {
            let start = part(base[major]);
            [start, part(base[major] + step[major]) - start]
        };
        let (mut p, mut q) = (along(&towards), along(&across));
        // Light rays of this half-plane: across ≥ 0.
        let zero = -q[0] / q[1];
        if q[1] > 0.0 {
            from = from.max(zero);
        } else if q[1] < 0.0 {
            to = to.min(zero);
        } else if q[0] < 0.0 {
            return None;
        }
        if begin > 0.0 {
            let first = direction_of_diamond_angle(begin);
            let seen = a * first.x + e * first.y;
            if seen.z > 0.0 {
                from = from.max((seen[major] / seen.z - base[major]) / step[major]);
            } else if a.z > 0.0 {
                return None; // The map sees earlier light rays alone.
            }
        }
        let last = direction_of_diamond_angle(reach);
        let seen = a * last.x + e * last.y;
        if seen.z > 0.0 {
            to = to.min((seen[major] / seen.z - base[major]) / step[major]);
        } else if a.z < 0.0 {
            return None; // The map sees later light rays alone.
        }
        if !(from < to) {
            return None;
        }
        for part in [&mut p, &mut q] {
            part[0] += part[1] * from;
        }
        let [numerator, depth] = order.lit_rows(plane.column_from_plane());
        // A point at depth z of the map: across q·z, to the light L − p·z.
        let factors =
            |row: DVec2| [row.y * distance, 0.0, row.x * q[0] - row.y * p[0], row.x * q[1] - row.y * p[1]];
        let start = base + step * from;
        Self::walk_from(projection.size(), major, start.to_array(), step.to_array(), to - from).map(|line| {
            Self {
                depth_along: DepthAlong::Perspective { distance, towards: p, across: q },
                gamma: Gamma::Diamond([p, q].map(|part| part.map(|f| f as f32))),
                lit_columns: [factors(numerator), factors(depth)].map(|row| row.map(|f| f as f32)),
                ..line
            }
        })
    }
}
