//! Where on a map an occluder can be: bounds in texels, and which boxes of a tree a tile can see.

use glam::{DVec3, DVec4};
use scatter_core::MapProjection;

use crate::tree::{Bvh, Node, Pending};

/// A rectangle of a map in texel coordinates, `[left, top, right, bottom]`.
pub(super) type Rectangle = [f64; 4];

/// What a ball of `radius` around `centre` (world space) covers of a map; `None` if it lies behind a lamp. A ball that
/// reaches behind the lamp may cover all.
///
/// Exactly: u = const is a plane through the lamp, or along the sun, and the ball touches it where its distance is the
/// radius: `(U − u·Z)² = r²·|∇U − u·∇Z|²`, a quadratic in u.
pub(super) fn ball_on_map(projection: &MapProjection, centre: DVec3, radius: f64) -> Option<Rectangle> {
    let [u, v, z] = projection.rows();
    let value = |row: DVec4| row.truncate().dot(centre) + row.w;
    if !projection.is_perspective() {
        let range = |row: DVec4| {
            let (middle, reach) = (value(row), radius * row.truncate().length());
            [middle - reach, middle + reach]
        };
        let ([left, right], [top, bottom]) = (range(u), range(v));
        return Some([left, top, right, bottom]);
    }
    let depth = value(z);
    let reach = radius * z.truncate().length();
    if depth + reach <= 0.0 {
        return None;
    }
    // A thousandth more: beside the lamp's plane the quotients lose their digits, and there is little to be saved.
    if depth <= 1.001 * reach {
        return Some([f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY]);
    }
    let square = radius * radius;
    let range = |row: DVec4| {
        let (across, axis) = (row.truncate(), z.truncate());
        let quadratic = depth * depth - square * axis.length_squared();
        let half_linear = value(row) * depth - square * across.dot(axis);
        let constant = value(row) * value(row) - square * across.length_squared();
        let root = (half_linear * half_linear - quadratic * constant).max(0.0).sqrt();
        [(half_linear - root) / quadratic, (half_linear + root) / quadratic]
    };
    let ([left, right], [top, bottom]) = (range(u), range(v));
    Some([left, top, right, bottom])
}

/// The columns (or rows) whose centres lie between two texel coordinates, and one more at each end for the rounding, within
/// `[first, end)`.
#[inline]
pub(super) fn texels_between(low: f64, high: f64, first: u32, end: u32) -> std::ops::Range<u32> {
    // Casts saturate, also those of infinities.
    let from = (low - 0.5).floor().max(0.0) as u32;
    let to = ((high + 0.5).ceil().max(0.0) as u32).saturating_add(1);
    from.clamp(first, end)..to.clamp(first, end)
}

/// Calls `leaf(first, count)` for the leaves of the tree that a tile `[x0, y0, x1, y1]` of a map can see, and maybe for
/// others.
pub(super) fn leaves_in_tile(
    bvh: &Bvh,
    projection: &MapProjection,
    [x0, y0, x1, y1]: [u32; 4],
    mut leaf: impl FnMut(u32, u32),
) {
    if bvh.nodes.is_empty() {
        return;
    }
    let [u, v, z] = projection.rows();
    // A texel's border around the tile: no rounding reaches that far.
    let (left, right) = (f64::from(x0) - 1.0, f64::from(x1) + 1.0);
    let (top, bottom) = (f64::from(y0) - 1.0, f64::from(y1) + 1.0);
    // Inside is where all are ≥ 0.
    let planes: [DVec4; 5] = if projection.is_perspective() {
        [u - z * left, z * right - u, v - z * top, z * bottom - v, z]
    } else {
        [u - DVec4::W * left, DVec4::W * right - u, v - DVec4::W * top, DVec4::W * bottom - v, DVec4::W]
    };
    let sees = |node: &Node| {
        let (centre, half) = (bvh.centre + node.centre().as_dvec3(), node.half().as_dvec3());
        planes.iter().all(|plane| {
            let normal = plane.truncate();
            normal.dot(centre) + plane.w + normal.abs().dot(half) >= 0.0
        })
    };
    let mut pending = Pending::new();
    pending.push(0u32);
    while let Some(index) = pending.pop() {
        let node = &bvh.nodes[index as usize];
        if !sees(node) {
            continue;
        }
        if node.count > 0 {
            leaf(node.first, node.count);
        } else {
            pending.push(node.first + 1);
            pending.push(node.first);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_testing::Random;

    #[test]
    fn a_balls_bounds_touch_its_outline() {
        let mut random = Random(3);
        let forward = [0.3, -0.8, 0.1];
        let up = [0.0, 0.0, 1.0];
        let maps = [
            MapProjection::orthographic([1.0, 2.0, 3.0], forward, up, [3.0, 2.0], [33, 17]).unwrap(),
            MapProjection::perspective([1.0, 2.0, 3.0], forward, up, 0.7, 33).unwrap(),
        ];
        let mut touched = 0;
        for _ in 0..300 {
            for map in &maps {
                let centre = DVec3::new(1.0, 0.0, 3.0) + random.in_cube(2.0);
                let radius = random.range(0.01, 0.8);
                let Some(bounds) = ball_on_map(map, centre, radius) else { continue };
                let mut seen = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
                for _ in 0..2000 {
                    let p = map.texel_from_world(centre + random.in_cube(1.0).normalize() * radius);
                    if p.z <= 0.0 && map.is_perspective() {
                        continue;
                    }
                    for (at, value) in [(0, p.x), (1, p.y)] {
                        assert!(
                            value >= bounds[at] - 1e-9 && value <= bounds[at + 2] + 1e-9,
                            "{value} {bounds:?}"
                        );
                    }
                    seen = [seen[0].min(p.x), seen[1].min(p.y), seen[2].max(p.x), seen[3].max(p.y)];
                }
                if bounds[0].is_finite() {
                    // 2000 points on a sphere miss its edge by about 1/2000 of it, drawn out near the lamp's plane.
                    assert!((bounds[2] - bounds[0]) * 0.9 < seen[2] - seen[0], "{bounds:?} {seen:?}");
                    touched += 1;
                }
            }
        }
        assert!(touched > 400, "{touched}");
    }
}
