//! A ray inside a plane, and the segment in which a triangle meets that plane: the one f64 geometry of all casts.
//!
//! A triangle that the ray hits meets every plane through the ray, and the ray hits it where the segment of that
//! meeting crosses the ray. So the hit is found in two steps, each watertight between neighbours:
//!
//! 1. Each welded vertex is on the + or the − side of the plane (zero counts as +). A triangle with vertices on both
//!    sides has exactly two cut edges; an edge is cut with its vertices in welded order, so both of its triangles get
//!    the same point, to the bit. A closed mesh is cut in closed polylines, whatever the rounding did.
//! 2. In the plane each cut point lies above the ray (y ≥ 0) or below it. A segment from one to the other crosses
//!    the ray: a closed polyline crosses it an even number of times, and never through a vertex unseen.
//!
//! Ray-cast truth takes the plane that holds the light's rays and reads the shadow off the same segments
//! (`truth::shadow_plane`), so a shadow that begins at a surface begins at the very number at which the ray ends.

use glam::{DVec2, DVec3};

/// A ray and a plane through it, in f64.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayPlane {
    /// Point of reference (the eye), world space.
    pub reference: DVec3,
    /// Where the ray starts, relative to the reference.
    pub start: DVec3,
    /// Unit direction of the ray: x.
    pub along: DVec3,
    /// Unit vector in the plane, perpendicular to the ray: y.
    pub up: DVec3,
    /// Unit normal of the plane.
    pub normal: DVec3,
}

/// A point of the plane: `x` along the ray from its start, `y` along [`RayPlane::up`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlanePoint {
    pub x: f64,
    pub y: f64,
}

/// The segment in which a triangle meets the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment(pub PlanePoint, pub PlanePoint);

impl RayPlane {
    /// The plane through the ray and `normal` (a unit vector, perpendicular to `along` but for rounding).
    pub fn with_normal(reference: DVec3, start: DVec3, along: DVec3, normal: DVec3) -> Self {
        Self { reference, start, along, up: normal.cross(along), normal }
    }

    /// Any plane through the ray.
    pub fn any(reference: DVec3, start: DVec3, along: DVec3) -> Self {
        Self::with_normal(reference, start, along, along.any_orthonormal_vector())
    }

    /// Where a triangle meets the plane; `vertices` in welded order, world space.
    #[inline]
    pub fn cut(&self, vertices: [DVec3; 3]) -> Option<Segment> {
        let q = vertices.map(|p| (p - self.reference) - self.start);
        let d = q.map(|q| self.normal.dot(q));
        let above = d.map(|d| d >= 0.0);
        if above[0] == above[1] && above[1] == above[2] {
            return None;
        }
        let edge = |a: usize, b: usize| {
            let weight = d[a] / (d[a] - d[b]);
            let point = |axis: DVec3| {
                let start = axis.dot(q[a]);
                start + weight * (axis.dot(q[b]) - start)
            };
            PlanePoint { x: point(self.along), y: point(self.up) }
        };
        // The edges whose ends lie on two sides, each from its lower to its higher index.
        Some(if above[0] != above[1] {
            let other = if above[0] != above[2] { edge(0, 2) } else { edge(1, 2) };
            Segment(edge(0, 1), other)
        } else {
            Segment(edge(0, 2), edge(1, 2))
        })
    }

    /// What a triangle carries at the two ends of its [`Self::cut`], where `carried` is linear over it; for triangles
    /// that have one. By the weights of the cut itself.
    pub fn carried(&self, vertices: [DVec3; 3], carried: [DVec2; 3]) -> [DVec2; 2] {
        let d = vertices.map(|p| self.normal.dot((p - self.reference) - self.start));
        let above = d.map(|d| d >= 0.0);
        let edge = |a: usize, b: usize| carried[a] + (carried[b] - carried[a]) * (d[a] / (d[a] - d[b]));
        if above[0] != above[1] {
            [edge(0, 1), if above[0] != above[2] { edge(0, 2) } else { edge(1, 2) }]
        } else {
            [edge(0, 2), edge(1, 2)]
        }
    }
}

impl Segment {
    /// Where the segment crosses the ray, as a distance from the ray's start (negative: behind it).
    #[inline]
    pub fn crossing(&self) -> Option<f64> {
        self.crossing_share().map(|share| self.0.x + (self.1.x - self.0.x) * share)
    }

    /// The share of the segment before its [`Self::crossing`], from its first end.
    #[inline]
    pub fn crossing_share(&self) -> Option<f64> {
        let Self(a, b) = self;
        ((a.y >= 0.0) != (b.y >= 0.0)).then(|| a.y / (a.y - b.y))
    }

    /// The point behind a share of it.
    #[inline]
    pub fn at(&self, share: f64) -> PlanePoint {
        let Self(a, b) = self;
        PlanePoint { x: a.x + (b.x - a.x) * share, y: a.y + (b.y - a.y) * share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> RayPlane {
        RayPlane::any(DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO, DVec3::NEG_Z)
    }

    fn hit(vertices: [DVec3; 3]) -> Option<f64> {
        plane().cut(vertices).and_then(|segment| segment.crossing())
    }

    #[test]
    fn a_ray_meets_a_triangle_at_its_distance() {
        let z = -4.0;
        let triangle = [DVec3::new(-1.0, -1.0, z), DVec3::new(-1.0, 2.0, z), DVec3::new(2.0, -1.0, z)];
        assert_eq!(hit(triangle), Some(5.0));
        assert_eq!(hit(triangle.map(|p| p + DVec3::new(1.5, 0.0, 0.0))), None);
        // Behind the start the distance is negative.
        assert_eq!(hit(triangle.map(|p| p + DVec3::new(0.0, 0.0, 7.0))), Some(-2.0));
    }

    #[test]
    fn a_ray_through_a_shared_vertex_meets_a_fan_an_odd_number_of_times() {
        // Eight triangles around the point that the ray passes through, to the bit.
        let rim = |k: u32| {
            let angle = f64::from(k % 8) * std::f64::consts::FRAC_PI_4;
            DVec3::new(angle.cos(), angle.sin(), -4.0)
        };
        let hits = (0..8)
            .filter(|&k| {
                // Welded order: the centre first, then the rim by its number.
                let (a, b) = (k.min((k + 1) % 8), k.max((k + 1) % 8));
                hit([DVec3::new(0.0, 0.0, -4.0), rim(a), rim(b)]).is_some()
            })
            .count();
        assert_eq!(hits % 2, 1, "{hits}");
    }
}
