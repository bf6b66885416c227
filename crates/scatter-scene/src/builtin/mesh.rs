//! An indexed triangle mesh whose equal positions are one vertex, and the simple solids put into it.
//!
//! Positions are rounded to a grid of 2⁻¹² units: f32 holds them exactly up to 4096 units, parts that are
//! computed in different ways meet in exactly equal vertices, and a last-bit difference between two ways of
//! computing a point vanishes.

use super::random::sin_cos_turns;
use glam::DVec3;
use std::collections::HashMap;

/// Grid lines per unit that positions are rounded to. Finer: f32 no longer holds large scenes exactly.
/// Coarser: leaves and bars (centimetres) lose their shape.
const GRID: f64 = 4096.0;

/// Triangles over shared vertices.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    /// Vertex positions, no two equal unless added by [`Mesh::push_apart`].
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices, three a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the vertices, v down; none for a mesh without a texture.
    pub uv: Vec<[f32; 2]>,
    known: HashMap<[u32; 3], u32>,
}

impl Mesh {
    /// The vertex at `p`, rounded to the grid; an equal one is reused.
    pub(crate) fn vertex(&mut self, p: DVec3) -> u32 {
        let position = snap(p);
        let next = self.positions.len() as u32;
        let index = *self.known.entry(position.map(f32::to_bits)).or_insert(next);
        if index == next {
            self.positions.push(position);
        }
        index
    }

    /// A vertex of its own at `p`, for parts that share none with others (leaves, terrain): no look-up.
    pub(crate) fn push_apart(&mut self, p: DVec3) -> u32 {
        self.positions.push(snap(p));
        self.positions.len() as u32 - 1
    }

    /// Adds a rectangle of its own that shows a whole texture: its upper left corner, and the sides along u and v.
    pub(crate) fn card(&mut self, corner: DVec3, along_u: DVec3, along_v: DVec3) {
        let corners = [corner, corner + along_v, corner + along_u + along_v, corner + along_u];
        let indices = corners.map(|p| self.push_apart(p));
        self.uv.extend([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
        self.quad(indices);
    }

    /// Adds a triangle, unless two of its corners are one vertex.
    pub(crate) fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners;
        if a != b && b != c && c != a {
            self.triangles.push(corners);
        }
    }

    /// Adds the quad a, b, c, d, cut along a–c.
    pub(crate) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Adds a closed surface of revolution about the y axis through `foot`: `profile` lists (radius, height)
    /// from the lower end to the upper, `sides` flat faces around.
    pub(crate) fn add_lathe(&mut self, foot: DVec3, profile: &[(f64, f64)], sides: usize) {
        let ring = |mesh: &mut Self, &(radius, height): &(f64, f64)| -> Vec<u32> {
            let at = |side: usize| {
                let (sine, cosine) = sin_cos_turns(side as f64 / sides as f64);
                foot + DVec3::new(radius * sine, height, radius * cosine)
            };
            (0..sides).map(|side| mesh.vertex(at(side))).collect()
        };
        let rings: Vec<Vec<u32>> = profile.iter().map(|point| ring(self, point)).collect();
        self.close_rings(&rings);
    }

    /// Adds a closed tube along `path`, with a radius for each of its points.
    pub(crate) fn add_tube(&mut self, path: &[(DVec3, f64)], sides: usize) {
        let Some((first, rest)) = path.split_first() else { return };
        let Some(last) = rest.last() else { return };
        let along = (last.0 - first.0).normalize_or(DVec3::Y);
        let (sideways, across) = perpendiculars(along);
        let rings: Vec<Vec<u32>> = path
            .iter()
            .map(|&(centre, radius)| {
                let at = |side: usize| {
                    let (sine, cosine) = sin_cos_turns(side as f64 / sides as f64);
                    centre + radius * (cosine * sideways + sine * across)
                };
                (0..sides).map(|side| self.vertex(at(side))).collect()
            })
            .collect();
        self.close_rings(&rings);
    }

    /// Adds the closed surface through rings of equally many points, counter-clockwise seen from the last.
    pub(crate) fn add_rings(&mut self, rings: &[Vec<DVec3>]) {
        let rings: Vec<Vec<u32>> =
            rings.iter().map(|ring| ring.iter().map(|&p| self.vertex(p)).collect()).collect();
        self.close_rings(&rings);
    }

    /// Joins rings of equally many vertices, and caps both ends.
    fn close_rings(&mut self, rings: &[Vec<u32>]) {
        let (Some(bottom), Some(top)) = (rings.first(), rings.last()) else { return };
        let sides = bottom.len();
        for pair in rings.windows(2) {
            for side in 0..sides {
                let next = (side + 1) % sides;
                self.quad([pair[0][side], pair[0][next], pair[1][next], pair[1][side]]);
            }
        }
        for side in 1..sides - 1 {
            self.triangle([bottom[0], bottom[side + 1], bottom[side]]);
            self.triangle([top[0], top[side], top[side + 1]]);
        }
    }

    /// The bounding box's corners; zeros for an empty mesh.
    pub(crate) fn bounds(&self) -> [[f32; 3]; 2] {
        let Some(&first) = self.positions.first() else { return [[0.0; 3]; 2] };
        self.positions.iter().fold([first, first], |[low, high], p| {
            [[0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i]))]
        })
    }
}

/// Two unit vectors that make a right-handed frame (first, second, `along`) with the unit vector `along`.
pub(crate) fn perpendiculars(along: DVec3) -> (DVec3, DVec3) {
    let helper = if along.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
    let sideways = helper.cross(along).normalize();
    (sideways, along.cross(sideways))
}

/// `p` on the grid; −0 becomes +0, so that equal positions have equal bits.
fn snap(p: DVec3) -> [f32; 3] {
    p.to_array().map(|x| ((x * GRID).round() / GRID + 0.0) as f32)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Panics unless each edge of the mesh has exactly two triangles, one in each direction.
    #[track_caller]
    pub(crate) fn assert_closed(mesh: &Mesh) {
        let mut edges = BTreeMap::<(u32, u32), (u32, u32)>::new();
        for &[a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let count = edges.entry((from.min(to), from.max(to))).or_default();
                *if from < to { &mut count.0 } else { &mut count.1 } += 1;
            }
        }
        for ((a, b), directions) in edges {
            let at = [mesh.positions[a as usize], mesh.positions[b as usize]];
            assert_eq!(directions, (1, 1), "triangles there and back along the edge {at:?}");
        }
    }

    /// The volume that a closed mesh's triangles enclose; positive when they face outwards.
    pub(crate) fn volume(mesh: &Mesh) -> f64 {
        let corner = |index: u32| DVec3::from(mesh.positions[index as usize].map(f64::from));
        mesh.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0).sum()
    }

    /// Asserts the volume of a mesh whose vertices lie on the grid exactly: only the sum's rounding is left.
    #[track_caller]
    pub(crate) fn assert_volume(mesh: &Mesh, expected: f64) {
        assert!((volume(mesh) - expected).abs() < 1e-12 * expected, "volume {}", volume(mesh));
    }

    #[test]
    fn a_box_is_closed_and_has_its_volume() {
        let mut mesh = Mesh::default();
        mesh.add_box(DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 2.0, 5.0));
        assert_closed(&mesh);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 12));
        assert_volume(&mesh, 2.0 * 1.5 * 3.0);
    }

    #[test]
    fn a_lathe_is_closed_and_has_a_prism_s_volume() {
        let mut mesh = Mesh::default();
        mesh.add_lathe(DVec3::new(3.0, 1.0, -2.0), &[(2.0, 0.0), (2.0, 1.0), (2.0, 4.0)], 4);
        assert_closed(&mesh);
        // A square with circumradius 2 has the area 8, and sits on the grid exactly.
        assert_volume(&mesh, 8.0 * 4.0);
    }

    #[test]
    fn a_tube_is_closed_in_any_direction() {
        for end in [DVec3::X, DVec3::Y, -DVec3::Z, DVec3::new(1.0, -2.0, 0.5)] {
            let mut mesh = Mesh::default();
            mesh.add_tube(&[(DVec3::ZERO, 0.25), (end, 0.25), (2.0 * end, 0.125)], 5);
            assert_closed(&mesh);
            assert!(volume(&mesh) > 0.0, "the tube towards {end} is inside out");
        }
    }

    #[test]
    fn a_missing_triangle_is_noticed() {
        let mut mesh = Mesh::default();
        mesh.add_box(DVec3::ZERO, DVec3::ONE);
        mesh.triangles.pop();
        assert!(std::panic::catch_unwind(|| assert_closed(&mesh)).is_err());
    }
}
