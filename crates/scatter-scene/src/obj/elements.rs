//! Point and line elements as particles and strands, with the values that a shot gives them.
//!
//! `p a b c` are points, `l a b c` is a polyline; a line that begins at the vertex where the one before ended goes on with
//! it, as exporters write a hair edge by edge.

use glam::DVec3;

use crate::error::{Checked, Fault};
use crate::limits::checked_occluders;
use crate::translucent::{OccluderValues, Particle, StrandVertex, Strands};

/// Points and lines by their vertices, which may come later in the file.
#[derive(Default)]
pub(super) struct Elements {
    points: Vec<u32>,
    line_vertices: Vec<u32>,
    /// Where each line begins.
    line_starts: Vec<u32>,
}

impl Elements {
    pub(super) fn add_point(&mut self, vertex: u32, line: usize) -> Checked<()> {
        self.points.push(vertex);
        checked_occluders(|| format!("line {line}"), self.points.len() as u64)
    }

    /// Adds a polyline.
    pub(super) fn add_line(&mut self, vertices: &[u32], line: usize) -> Checked<()> {
        let [first, second, ..] = vertices else {
            let problem = "a line with less than two vertices";
            return Err(Fault::invalid(format!("line {line}"), problem, "write it as `l a b`"));
        };
        let goes_on =
            !self.line_starts.is_empty() && self.line_vertices.last() == Some(first) && first != second;
        if !goes_on {
            self.line_starts.push(self.line_vertices.len() as u32);
        }
        self.line_vertices.extend_from_slice(if goes_on { &vertices[1..] } else { vertices });
        checked_occluders(|| format!("line {line}"), self.line_vertices.len() as u64)
    }

    /// All vertices that are used.
    pub(super) fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.points.iter().chain(&self.line_vertices).copied()
    }

    /// The occluders, when all vertices are known.
    pub(super) fn occluders(&self, positions: &[DVec3], values: &OccluderValues) -> (Vec<Particle>, Strands) {
        let (mut particles, mut strands) = (Vec::new(), Strands::default());
        if let Some((radius, density)) = particle_values(values) {
            let at = |&vertex: &u32| Particle { centre: positions[vertex as usize], radius, density };
            particles.extend(self.points.iter().map(at));
        }
        if let Some((radius, opacity)) = strand_values(values) {
            let ends =
                self.line_starts.iter().skip(1).map(|&end| end as usize).chain([self.line_vertices.len()]);
            for (&start, end) in self.line_starts.iter().zip(ends) {
                let at =
                    |&vertex: &u32| StrandVertex { position: positions[vertex as usize], radius, opacity };
                strands.push(self.line_vertices[start as usize..end].iter().map(at));
            }
        }
        (particles, strands)
    }
}

/// Radius and density of a point; `None`: points are left out.
pub(super) fn particle_values(values: &OccluderValues) -> Option<(f64, f64)> {
    values.particles.and_then(|values| values.radius.zip(values.density))
}

/// Radius and opacity of a line; `None`: lines are left out.
pub(super) fn strand_values(values: &OccluderValues) -> Option<(f64, f64)> {
    values.strands.and_then(|values| values.radius.zip(values.opacity))
}
