//! Closed solids cut from a warped grid of cells: walls with windows, halls, vaults, perforated shells.
//!
//! A predicate says which cells are solid; each face between a solid and an empty cell becomes a quad. All
//! faces share the grid's vertices, whatever the warp, so walls with holes are watertight and have no
//! T-junctions. Two solid cells that meet only along an edge would put four triangles there: patterns avoid it.

use super::mesh::Mesh;
use glam::DVec3;

/// A grid of cells, `counts[0]·counts[1]·counts[2]` of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blocks {
    counts: [usize; 3],
    /// Axes whose last cell is followed by the first (angles).
    wraps: [bool; 3],
}

impl Blocks {
    /// A grid that ends at its borders: beyond them is emptiness.
    pub(crate) fn new(counts: [usize; 3]) -> Self {
        Self { counts, wraps: [false; 3] }
    }

    /// The same with one axis closed to a ring.
    pub(crate) fn wrapping(mut self, axis: usize) -> Self {
        self.wraps[axis] = true;
        self
    }

    /// Adds the surface of the cells for which `solid` holds. `position` places the grid's vertices; its
    /// three axes must be right-handed for the faces to look outwards.
    pub(crate) fn add_to(
        self,
        mesh: &mut Mesh,
        solid: impl Fn([usize; 3]) -> bool,
        position: impl Fn([usize; 3]) -> DVec3,
    ) {
        for i in 0..self.counts[0] {
            for j in 0..self.counts[1] {
                for k in 0..self.counts[2] {
                    let cell = [i, j, k];
                    if !solid(cell) {
                        continue;
                    }
                    for axis in 0..3 {
                        for upper in [false, true] {
                            if !self.neighbour(cell, axis, upper).is_some_and(&solid) {
                                self.add_face(mesh, cell, axis, upper, &position);
                            }
                        }
                    }
                }
            }
        }
    }

    /// The cell next to `cell`; `None` beyond a border.
    fn neighbour(&self, mut cell: [usize; 3], axis: usize, upper: bool) -> Option<[usize; 3]> {
        let last = self.counts[axis] - 1;
        cell[axis] = match (cell[axis], upper) {
            (index, true) if index < last => index + 1,
            (index, false) if index > 0 => index - 1,
            _ if !self.wraps[axis] => return None,
            (_, true) => 0,
            (_, false) => last,
        };
        Some(cell)
    }

    /// Adds the quad on one side of a cell, counter-clockwise from outside.
    fn add_face(
        &self,
        mesh: &mut Mesh,
        cell: [usize; 3],
        axis: usize,
        upper: bool,
        position: &impl Fn([usize; 3]) -> DVec3,
    ) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
            let mut at = cell;
            at[axis] += usize::from(upper);
            at[u] += du;
            at[v] += dv;
            for (index, (count, wraps)) in at.iter_mut().zip(self.counts.into_iter().zip(self.wraps)) {
                if wraps {
                    *index %= count;
                }
            }
            mesh.vertex(position(at))
        });
        let [a, b, c, d] = corners;
        mesh.quad(if upper { [a, b, c, d] } else { [a, d, c, b] });
    }
}

impl Mesh {
    /// Adds a box with the given corners: closed, 12 triangles.
    pub(crate) fn add_box(&mut self, low: DVec3, high: DVec3) {
        let corner = |[i, j, k]: [usize; 3]| {
            let pick = |index: usize, low: f64, high: f64| if index == 0 { low } else { high };
            DVec3::new(pick(i, low.x, high.x), pick(j, low.y, high.y), pick(k, low.z, high.z))
        };
        Blocks::new([1, 1, 1]).add_to(self, |_| true, corner);
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{assert_closed, assert_volume, volume};
    use super::super::random::sin_cos_turns;
    use super::*;

    fn straight([i, j, k]: [usize; 3]) -> DVec3 {
        DVec3::new(i as f64, j as f64, k as f64)
    }

    #[test]
    fn a_wall_with_a_window_is_closed_and_has_its_volume() {
        let mut mesh = Mesh::default();
        Blocks::new([5, 4, 1]).add_to(&mut mesh, |cell| cell != [2, 1, 0] && cell != [2, 2, 0], straight);
        assert_closed(&mesh);
        assert_volume(&mesh, 5.0 * 4.0 - 2.0);
    }

    #[test]
    fn a_hollow_box_keeps_its_inside() {
        let mut mesh = Mesh::default();
        Blocks::new([3, 3, 3]).add_to(&mut mesh, |cell| cell != [1, 1, 1], straight);
        assert_closed(&mesh);
        assert_volume(&mesh, 26.0);
    }

    #[test]
    fn a_ring_of_cells_has_no_seam() {
        let mut mesh = Mesh::default();
        // Axes: angle, height, radius; clockwise from above so that the three are right-handed.
        Blocks::new([12, 2, 1]).wrapping(0).add_to(
            &mut mesh,
            |cell| cell[0] % 4 != 1 || cell[1] == 0,
            |[i, j, k]| {
                let (sine, cosine) = sin_cos_turns(i as f64 / 12.0);
                let radius = 1.0 + k as f64;
                DVec3::new(radius * cosine, j as f64, -radius * sine)
            },
        );
        assert_closed(&mesh);
        // 12 + 9 cells of (2² − 1²)/2·sin 30° each; the grid moves a corner by 2⁻¹³ at most.
        assert!((volume(&mesh) - 21.0 * 0.75).abs() < 0.01, "volume {}", volume(&mesh));
    }
}
