//! Polygons into triangles: a fan where that is right, ears by the crate `earcut` where the polygon is concave.
//!
//! Departures: a bent polygon is cut as its projection along the largest axis of its area vector is, and keeps its
//! corners; one that crosses itself (also by being twisted) is a fan, as everywhere, and told.

use glam::{DVec2, DVec3};

/// Twice a fan's triangle may be turned the wrong way by this much of the polygon's area: rounding of a vertex on a
/// straight edge, which a fan draws as well as ears do.
const TURNED_SHARE: f64 = 1e-9;

/// By how much of the polygon's area the triangles may miss it before that is told: rounding is 1e-12 of it.
const MISSED_SHARE: f64 = 1e-6;

/// Cuts polygons; keeps its memory.
#[derive(Default)]
pub(super) struct Triangulator {
    ears: Option<earcut::Earcut<f64>>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

/// How a polygon was cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// From its first corner.
    Fan,
    /// In [`Triangulator::cut`].
    Ears,
    /// From its first corner; the polygon crosses itself, so its inside is no clear thing.
    Crossed,
}

impl Triangulator {
    /// Decides how to cut a polygon of at least four corners.
    pub(super) fn cut(&mut self, corners: &[DVec3]) -> Cut {
        let first = corners[0];
        let edges = || corners[1..].windows(2).map(|pair| (pair[0] - first, pair[1] - first));
        let crosses = || edges().map(|(a, b)| a.cross(b));
        // Twice the area vector of the polygon (Newell).
        let area: DVec3 = crosses().sum();
        let square = area.length_squared();
        // Also for what has no area or is no number: nobody sees it.
        if !(square > 0.0 && square.is_finite()) || crosses().all(|c| c.dot(area) >= -TURNED_SHARE * square) {
            return Cut::Fan;
        }
        // Dropping the largest axis keeps the coordinates exact.
        let axis = area.abs().max_position();
        let [u, v] = [[1, 2], [2, 0], [0, 1]][axis];
        self.flat.clear();
        self.flat.extend(corners.iter().map(|p| [(p - first)[u], (p - first)[v]]));
        let ears = self.ears.get_or_insert_with(earcut::Earcut::new);
        ears.earcut(self.flat.iter().copied(), &[] as &[u32], &mut self.cut);
        let corner = |i: u32| DVec2::from_array(self.flat[i as usize]);
        let covered: f64 = self
            .cut
            .as_chunks::<3>()
            .0
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(corner);
                (b - a).perp_dot(c - a).abs()
            })
            .sum();
        let wanted = area[axis].abs();
        if (covered - wanted).abs() <= MISSED_SHARE * wanted { Cut::Ears } else { Cut::Crossed }
    }

    /// The triangles of the last polygon that was cut into ears, by the numbers of its corners.
    pub(super) fn ears(&self) -> &[[u32; 3]] {
        self.cut.as_chunks::<3>().0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether some triangle covers the point (x, y), seen along z; on no edge of any.
    fn covers(corners: &[DVec3], triangles: &[[u32; 3]], p: DVec2) -> usize {
        let flat = |i: u32| corners[i as usize].truncate();
        let is_inside = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(flat);
            let turn = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a);
            let turns = [turn(a, b), turn(b, c), turn(c, a)];
            turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0)
        };
        triangles.iter().filter(is_inside).count()
    }

    fn cut(corners: &[DVec3]) -> (Cut, Vec<[u32; 3]>) {
        let mut triangulator = Triangulator::default();
        let cut = triangulator.cut(corners);
        let fan = (1..corners.len() as u32 - 1).map(|i| [0, i, i + 1]).collect();
        (cut, if cut == Cut::Fan { fan } else { triangulator.ears().to_vec() })
    }

    fn polygon(points: &[[f64; 2]], z: impl Fn(f64, f64) -> f64) -> Vec<DVec3> {
        points.iter().map(|&[x, y]| DVec3::new(x, y, z(x, y))).collect()
    }

    #[test]
    fn convex_polygons_stay_fans_and_concave_ones_are_covered_once() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]];
        assert_eq!(cut(&polygon(&square, |_, _| 0.0)).0, Cut::Fan);
        let ell = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        // From every first corner, flat, tilted and slightly bent.
        for turn in 0..6 {
            let mut points = ell;
            points.rotate_left(turn);
            let shapes: [fn(f64, f64) -> f64; 3] =
                [|_, _| 0.0, |x, y| 0.5 * x - y, |x, y| 1e-3 * (x * x - y)];
            for z in shapes {
                let corners = polygon(&points, z);
                let (cut, triangles) = cut(&corners);
                assert_ne!(cut, Cut::Crossed);
                for (x, y, count) in
                    [(0.51, 0.37, 1), (2.3, 0.41, 1), (0.43, 2.71, 1), (2.1, 2.2, 0), (1.3, 1.4, 0)]
                {
                    assert_eq!(covers(&corners, &triangles, DVec2::new(x, y)), count, "{turn}: {x} {y}");
                }
            }
        }
    }

    #[test]
    fn a_keyhole_leaves_its_hole_open() {
        // A square with a square hole, joined by an edge that is walked both ways.
        let points = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ];
        for turn in 0..points.len() {
            let mut points = points;
            points.rotate_left(turn);
            let corners = polygon(&points, |_, _| 0.0);
            let (cut, triangles) = cut(&corners);
            assert_eq!(cut, Cut::Ears);
            for (x, y, count) in
                [(2.1, 1.9, 0), (1.2, 2.8, 0), (0.53, 2.2, 1), (3.4, 1.7, 1), (2.2, 0.31, 1), (1.7, 3.6, 1)]
            {
                assert_eq!(covers(&corners, &triangles, DVec2::new(x, y)), count, "{turn}: {x} {y}");
            }
        }
    }

    #[test]
    fn a_polygon_that_crosses_itself_is_told_and_one_without_area_is_a_fan() {
        let bow = [[0.0, 0.0], [3.0, 2.0], [3.0, 0.0], [0.0, 1.0]];
        assert_eq!(cut(&polygon(&bow, |_, _| 0.0)).0, Cut::Crossed);
        assert_eq!(cut(&[DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, DVec3::X]).0, Cut::Fan);
        assert_eq!(cut(&[DVec3::ZERO, DVec3::NAN, DVec3::X, DVec3::Y]).0, Cut::Fan);
    }
}
