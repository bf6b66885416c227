//! Whether six faces of a lamp's map see in every direction.
//!
//! Each face is a convex cone of four border planes through the lamp. If the union of the faces is not the whole sphere,
//! what is left is bounded by stretches of the faces' edges, so it is enough to look just beside every edge. There another
//! face covers one stretch, since it is convex: the stretches of the five others must follow each other from corner to
//! corner. Points are not normalised: borders are linear, and so is the chord of an edge's arc. f64, 24 × 5 × 4 products.

use glam::DVec3;

use crate::map_projection::MapProjection;

/// How far beside an edge the others are asked \[tangent of the face\]. Faces made of f32 matrices leave gaps of 1e-7;
/// a gap of less than this lets through 1e-5 of a lamp's light at most, far less than a texel's width (5e-4 at 4096²).
const BESIDE: f64 = 1e-5;

/// How far outside of its borders a face still counts \[tangent\]: rounding of f32 matrices, and less than [`BESIDE`],
/// so that a face does not cover what lies beside its own edge.
const SLACK: f64 = 2e-6;

/// Whether every direction lies on a face, but for slits of less than 1e-5 of a right angle.
pub(crate) fn covers_the_sphere(faces: &[MapProjection]) -> bool {
    faces.iter().enumerate().all(|(index, face)| {
        let [right, down, forward] = axes(face);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let Some(from_face) = inverse(right, down, forward) else { return false };
        let at = |[x, y]: [f64; 2]| from_face * DVec3::new(x, y, 1.0);
        (0..4).all(|edge| {
            let (a, b) = (corners[edge], corners[(edge + 1) % 4]);
            // Outwards of an edge is where its middle lies.
            let beside =
                |p: [f64; 2]| at([p[0] + BESIDE * 0.5 * (a[0] + b[0]), p[1] + BESIDE * 0.5 * (a[1] + b[1])]);
            let others =
                faces.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| other);
            is_covered(beside(a), beside(b), others)
        })
    })
}

/// Whether the faces cover the chord from `a` to `b`.
fn is_covered<'a>(a: DVec3, b: DVec3, faces: impl Iterator<Item = &'a MapProjection>) -> bool {
    // Beyond the end is no stretch.
    let mut stretches = [(2.0, 2.0); 6];
    for (slot, stretch) in stretches.iter_mut().zip(faces.filter_map(|face| stretch_on(face, a, b))) {
        *slot = stretch;
    }
    stretches.sort_unstable_by(|a, b| f64::total_cmp(&a.0, &b.0));
    let mut reached = 0.0;
    for (from, to) in stretches.into_iter().filter(|(from, _)| *from <= 1.0) {
        if from > reached + SLACK {
            return false;
        }
        reached = f64::max(reached, to);
    }
    reached >= 1.0 - SLACK
}

/// The part of the chord from `a` (0) to `b` (1) that lies on a face.
fn stretch_on(face: &MapProjection, a: DVec3, b: DVec3) -> Option<(f64, f64)> {
    let [right, down, forward] = axes(face);
    let slack = forward * (1.0 + SLACK);
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for border in [slack - right, slack + right, slack - down, slack + down, forward] {
        let (start, end) = (border.dot(a), border.dot(b));
        if start < 0.0 && end < 0.0 {
            return None;
        }
        let crossing = start / (start - end);
        if start < 0.0 {
            from = from.max(crossing);
        } else if end < 0.0 {
            to = to.min(crossing);
        }
    }
    (from <= to).then_some((from, to))
}

/// Directions whose products with a way from the lamp are x, y in −w to w on the face, and the depth w.
fn axes(face: &MapProjection) -> [DVec3; 3] {
    let [u, v, depth] = face.rows().map(|row| row.truncate());
    let [half_u, half_v] = face.size().map(|n| 0.5 * f64::from(n));
    [u / half_u - depth, v / half_v - depth, depth]
}

fn inverse(right: DVec3, down: DVec3, forward: DVec3) -> Option<glam::DMat3> {
    let inverse = glam::DMat3::from_cols(right, down, forward).transpose().inverse();
    inverse.is_finite().then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forward and up of six faces.
    const LOOKS: [([f64; 3], [f64; 3]); 6] = [
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
        ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
        ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
        ([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
    ];

    fn faces(tan_half: f64, turn: glam::DQuat) -> Vec<MapProjection> {
        let turned = |v: [f64; 3]| (turn * DVec3::from(v)).to_array();
        LOOKS
            .iter()
            .map(|&(forward, up)| {
                MapProjection::perspective([1.0, -2.0, 0.5], turned(forward), turned(up), tan_half, 7)
                    .unwrap()
            })
            .collect()
    }

    #[test]
    fn right_angles_cover_whichever_way_they_are_turned_and_less_do_not() {
        for step in 0..200 {
            let angle = f64::from(step);
            let axis = DVec3::new(angle.sin(), (1.7 * angle).cos(), 0.3).normalize();
            let turn = glam::DQuat::from_axis_angle(axis, angle);
            assert!(covers_the_sphere(&faces(1.0, turn)), "{step}");
            assert!(covers_the_sphere(&faces(1.05, turn)), "with borders, {step}");
            assert!(!covers_the_sphere(&faces(0.9999, turn)), "{step}");
        }
    }

    #[test]
    fn matrices_of_f32_cover() {
        for face in 0..6 {
            let mut all = faces(1.0, glam::DQuat::from_rotation_x(0.3));
            // An ulp of f32 narrower, and turned by as much.
            let (forward, up) = LOOKS[face];
            let turn = glam::DQuat::from_rotation_x(0.3 + 1e-7);
            let turned = |v: [f64; 3]| (turn * DVec3::from(v)).to_array();
            let (forward, up) = (turned(forward), turned(up));
            all[face] = MapProjection::perspective([1.0, -2.0, 0.5], forward, up, 1.0 - 1e-7, 7).unwrap();
            assert!(covers_the_sphere(&all), "{face}");
        }
    }

    #[test]
    fn a_face_that_is_missing_or_turned_away_leaves_a_gap() {
        for face in 0..6 {
            let mut all = faces(1.0, glam::DQuat::IDENTITY);
            all[face] = all[(face + 1) % 6];
            assert!(!covers_the_sphere(&all), "twice the same, {face}");
            let mut all = faces(1.0, glam::DQuat::IDENTITY);
            let (forward, up) = LOOKS[face];
            let turn = glam::DQuat::from_axis_angle(DVec3::from(forward), 0.01);
            let up = (turn * DVec3::from(up)).to_array();
            all[face] = MapProjection::perspective([1.0, -2.0, 0.5], forward, up, 1.0, 7).unwrap();
            assert!(!covers_the_sphere(&all), "turned about its axis, {face}");
        }
    }

    #[test]
    fn the_faces_of_a_cube_map_cover() {
        let all: Vec<_> =
            (0..6).map(|face| MapProjection::cube_face([3.0, 1e4, -7.0], face, 512).unwrap()).collect();
        assert!(covers_the_sphere(&all));
    }
}
