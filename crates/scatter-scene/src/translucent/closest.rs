//! Where a light ray comes nearest to a straight piece of a strand.

use glam::DVec3;

/// The nearest approach of a light ray to a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closest {
    /// Square of the distance.
    pub distance_sq: f64,
    /// Where it is on the light ray, from its origin along its direction \[world units\].
    pub along: f64,
    /// Where it is on the segment, 0 to 1.
    pub share: f64,
}

/// The nearest approach of the line through `origin` in the unit direction `direction` to the segment from `a` to `b`;
/// of the half line from `origin` on if it `starts` there (a lamp's light ray). Where segment and light ray are parallel,
/// the end that the light meets first.
///
/// All positions are relative to one point near them, so that differences keep their digits.
#[inline]
pub(crate) fn closest_on_segment(
    origin: DVec3,
    direction: DVec3,
    starts: bool,
    [a, b]: [DVec3; 2],
) -> Closest {
    /// Square of the sine of the angle below which segment and ray are parallel: the share is rounding noise there, and
    /// both ends are equally near to 1e-12 of the segment's length.
    const PARALLEL: f64 = 1e-24;
    let (from_origin, step) = (a - origin, b - a);
    let along_step = direction.dot(step);
    let across_step = step - direction * along_step;
    let across = from_origin - direction * direction.dot(from_origin);
    let square = across_step.length_squared();
    let share = if square > PARALLEL * step.length_squared() {
        (-across.dot(across_step) / square).clamp(0.0, 1.0)
    } else if along_step < 0.0 {
        1.0
    } else {
        0.0
    };
    let nearest = from_origin + step * share;
    let along = direction.dot(nearest);
    if !starts || along >= 0.0 {
        return Closest { distance_sq: (across + across_step * share).length_squared(), along, share };
    }
    // Behind the lamp: the half line's own end, unless another part of the segment lies before it. Distances to a convex
    // half line are convex along the segment, so the nearest of its ends' and the origin's candidates is the nearest.
    let length_sq = step.length_squared();
    let to_origin = if length_sq > 0.0 { (-from_origin.dot(step) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    // Where the segment passes the plane through the lamp, square to the ray.
    let at_plane = if along_step == 0.0 {
        to_origin
    } else {
        (-direction.dot(from_origin) / along_step).clamp(0.0, 1.0)
    };
    [to_origin, at_plane]
        .map(|share| {
            let p = from_origin + step * share;
            let along = direction.dot(p).max(0.0);
            Closest { distance_sq: (p - direction * along).length_squared(), along, share }
        })
        .into_iter()
        .min_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq))
        .unwrap_or(Closest { distance_sq: f64::INFINITY, along: 0.0, share: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_testing::Random;

    #[test]
    fn no_place_on_the_segment_is_nearer() {
        let mut random = Random(7);
        for round in 0..4000 {
            let (origin, direction) = (random.in_cube(2.0), random.in_cube(1.0).normalize());
            let a = random.in_cube(3.0);
            // Short, long, and nearly parallel segments.
            let b = match round % 3 {
                0 => random.in_cube(3.0),
                1 => a + random.in_cube(1e-3),
                _ => a + direction * random.range(-2.0, 2.0) + random.in_cube(1e-7),
            };
            let starts = round % 2 == 0;
            let found = closest_on_segment(origin, direction, starts, [a, b]);
            let at = |share: f64| {
                let p = a + (b - a) * share - origin;
                let along = if starts { direction.dot(p).max(0.0) } else { direction.dot(p) };
                (p - direction * along).length_squared()
            };
            let least = (0..=1000).map(|i| at(f64::from(i) / 1000.0)).fold(f64::INFINITY, f64::min);
            assert!(found.distance_sq <= least + 1e-12, "{round}: {} {least}", found.distance_sq);
            assert!((found.distance_sq - at(found.share)).abs() < 1e-12, "{round}");
            assert!(!starts || found.along >= 0.0);
        }
    }
}
