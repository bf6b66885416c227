//! An interpolated surface as triangles, closed around the shadow: for export, and for proofs.
//!
//! The triangles of the quads, walls along the light where depths jump and around the map's border, and behind all a lid at a far
//! depth, which is the surface's own triangles turned round. A cell beside one with a hole gets the middle of that side as a vertex,
//! which is a corner of two quarters there: so no vertex lies within an edge, but on walls' edges along the light, where the walls
//! of more than two cells may meet.

use glam::DVec3;
use scatter_core::{MapProjection, ShadowLayer};

use super::facet::PackedFacet;
use super::height_field::HeightField;
use super::stitching::{PLACES, STITCHINGS};

/// Column, row, depth.
pub type Vertex = [f64; 3];

/// A triangle: seen from outside of the shadow its corners go counter-clockwise in a right-handed space of column, row and depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Its corners.
    pub corners: [Vertex; 3],
}

impl Triangle {
    /// Its corners in the world; `None` if the projection has no inverse.
    pub fn in_world(&self, projection: &MapProjection) -> Option<[DVec3; 3]> {
        let mut world = [DVec3::ZERO; 3];
        for (corner, [u, v, depth]) in world.iter_mut().zip(self.corners) {
            let (origin, step) = projection.light_ray(u, v)?;
            *corner = origin + step * depth;
        }
        Some(world)
    }
}

/// The mesh of a layer around its shadow, closed by a lid at the depth `far`, which lies behind all surfaces. O(facets).
pub fn triangles(field: &HeightField, layer: &ShadowLayer<'_>, far: f64) -> Vec<Triangle> {
    let mut mesh = Mesh { layer, far, triangles: Vec::new() };
    field.for_each_facet(|facet, patch| match facet.quarter_index() {
        None => mesh.add_quad(facet, patch),
        Some(quarter) => mesh.add_quarter(facet.cell(patch), quarter),
    });
    mesh.triangles
}

struct Mesh<'a> {
    layer: &'a ShadowLayer<'a>,
    far: f64,
    triangles: Vec<Triangle>,
}

impl Mesh<'_> {
    /// The depth of a texel; outside of the map that of the border's, behind all where there is no surface.
    fn depth(&self, i: i64, j: i64) -> f64 {
        let [width, height] = self.layer.projection().size().map(i64::from);
        f64::from(self.layer.at(i.clamp(0, width - 1) as u32, j.clamp(0, height - 1) as u32)).min(self.far)
    }

    /// Half way between two vertices of the surface: codes are what is linear there.
    fn half_way(&self, a: f64, b: f64) -> f64 {
        if self.layer.projection().is_perspective() { 2.0 / (1.0 / a + 1.0 / b) } else { 0.5 * (a + b) }
    }

    /// A part of the surface and of the lid behind it; corners clockwise on a screen.
    fn add_surface(&mut self, corners: [Vertex; 3]) {
        let [a, b, c] = corners;
        if a[..2] == b[..2] || b[..2] == c[..2] || c[..2] == a[..2] {
            return;
        }
        self.triangles.push(Triangle { corners: [c, b, a] });
        self.triangles.push(Triangle { corners: corners.map(|[u, v, _]| [u, v, self.far]) });
    }

    /// A wall under the edge from `p` to `q` of a facet (clockwise), down to other depths there.
    fn add_wall(&mut self, [p, q]: [Vertex; 2], [p_depth, q_depth]: [f64; 2]) {
        let (p_other, q_other) = ([p[0], p[1], p_depth], [q[0], q[1], q_depth]);
        if p[..2] == q[..2] {
            return;
        }
        for corners in [[p, q, q_other], [p, q_other, p_other]] {
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                self.triangles.push(Triangle { corners });
            }
        }
    }

    fn add_quad(&mut self, packed: PackedFacet, patch: [u32; 2]) {
        let facet = packed.unpacked(self.layer, patch);
        let [i, j] = packed.cell(patch).map(i64::from);
        let cells = 1i64 << packed.level();
        let [width, height] = self.layer.projection().size().map(i64::from);
        let [[left, right], [top, bottom]] = facet.walls;
        // Beside a cell with a hole; a half cell at the map's border is no longer than a quarter.
        let ([is_wide, is_high], inner) = (
            [(facet.columns, i), (facet.rows, j)].map(|([a, b], n)| a < n as f32 && (n as f32) < b),
            [top && j > 0, right && i < width, bottom && j < height, left && i > 0],
        );
        let halved = |side: usize| inner[side] && [is_wide, is_high][side % 2];
        let sides = (0..4).map(|side| u8::from(halved(side)) << side).sum::<u8>() | facet.finer;
        let corner_depth = |place: usize| {
            let [x, y] = PLACES[place].map(|n| i64::from(n) * cells / 2);
            self.depth(i - 1 + x, j - 1 + y)
        };
        let mut vertices = [[0.0; 3]; 8];
        for (place, vertex) in vertices.iter_mut().enumerate() {
            let [x, y] = PLACES[place].map(f32::from).map(|n| n * 0.5 * facet.side);
            let depth = if place % 2 == 1 && packed.level() == 0 {
                self.half_way(corner_depth(place - 1), corner_depth((place + 1) % 8))
            } else {
                corner_depth(place)
            };
            let column = (facet.corner[0] + x).clamp(facet.columns[0], facet.columns[1]);
            let row = (facet.corner[1] + y).clamp(facet.rows[0], facet.rows[1]);
            *vertex = [column.into(), row.into(), depth];
        }
        for triangle in STITCHINGS[usize::from(sides)].triangles() {
            self.add_surface(triangle.map(|place| vertices[place as usize]));
        }
        for (side, wall) in [top, right, bottom, left].into_iter().enumerate() {
            let [p, middle, q] = [2 * side, 2 * side + 1, (2 * side + 2) % 8].map(|place| vertices[place]);
            match (wall, inner[side]) {
                (false, _) => {}
                (true, false) => self.add_wall([p, q], [self.far; 2]),
                // Quarters have their own texel's depth, that of the vertex.
                (true, true) if halved(side) => {
                    self.add_wall([p, middle], [p[2]; 2]);
                    self.add_wall([middle, q], [q[2]; 2]);
                }
                // Along a half cell the depth is one.
                (true, true) => self.add_wall([p, q], [p[2], q[2]]),
            }
        }
    }

    /// A flat quarter of a cell with a hole.
    fn add_quarter(&mut self, [i, j]: [u32; 2], quarter: usize) {
        let [width, height] = self.layer.projection().size();
        let ([right, below], [i, j]) = ([quarter % 2 == 1, quarter / 2 == 1], [i64::from(i), i64::from(j)]);
        let span = |n: i64, size: u32, far: bool| {
            if far {
                [n as f64, (n as f64 + 0.5).min(f64::from(size))]
            } else {
                [(n as f64 - 0.5).max(0.0), n as f64]
            }
        };
        let ([u0, u1], [v0, v1]) = (span(i, width, right), span(j, height, below));
        let texel = |right: bool, below: bool| (i - 1 + i64::from(right), j - 1 + i64::from(below));
        let own = texel(right, below);
        let depth = self.depth(own.0, own.1);
        let corners = [[u0, v0, depth], [u1, v0, depth], [u1, v1, depth], [u0, v1, depth]];
        let [a, b, c, d] = corners;
        self.add_surface([a, b, c]);
        self.add_surface([a, c, d]);
        // Clockwise from the top: what lies beyond each side, and whether that is the other half of the cell.
        let beyond = [
            (texel(right, !below), below),
            (texel(!right, below), !right),
            (texel(right, !below), !below),
            (texel(!right, below), right),
        ];
        for (side, ((x, y), is_inner)) in beyond.into_iter().enumerate() {
            let edge = [corners[side], corners[(side + 1) % 4]];
            let (at, size) = if side % 2 == 0 { (edge[0][1], height) } else { (edge[0][0], width) };
            if at == 0.0 || at == f64::from(size) {
                self.add_wall(edge, [self.far; 2]);
            } else if is_inner {
                let other = self.depth(x, y);
                // The first of two quarters has their wall; a hole has none.
                if other == self.far || side == 1 || side == 2 {
                    self.add_wall(edge, [other; 2]);
                }
            }
        }
    }
}

/// On how many edges the signed incidence of a mesh is not 0. Edges along the light are summed piece by piece, all others are those
/// of two vertices.
pub fn open_edge_count(triangles: &[Triangle]) -> usize {
    let mut changes = std::collections::HashMap::new();
    for_each_edge(triangles, |from, to| {
        if from[..2] == to[..2] {
            *changes.entry((from, from)).or_insert(0i64) += 1;
            *changes.entry((to, to)).or_insert(0) -= 1;
        } else if from < to {
            *changes.entry((from, to)).or_insert(0) += 1;
        } else {
            *changes.entry((to, from)).or_insert(0) -= 1;
        }
    });
    changes.values().filter(|&&change| change != 0).count()
}

/// How many edges do not have exactly two triangles, of opposite sense.
pub fn unpaired_edge_count(triangles: &[Triangle]) -> usize {
    let mut uses = std::collections::HashMap::new();
    for_each_edge(triangles, |from, to| {
        let (edge, way) = if from < to { ((from, to), 0) } else { ((to, from), 1) };
        uses.entry(edge).or_insert([0u32; 2])[way] += 1;
    });
    uses.values().filter(|&&uses| uses != [1, 1]).count()
}

/// Bits of vertices: −0 and 0 are one place.
fn for_each_edge(triangles: &[Triangle], mut each: impl FnMut([u64; 3], [u64; 3])) {
    for triangle in triangles {
        for n in 0..3 {
            let [from, to] =
                [n, (n + 1) % 3].map(|n| triangle.corners[n].map(|value| (value + 0.0).to_bits()));
            each(from, to);
        }
    }
}
