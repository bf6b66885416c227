//! Hair and other thin things: polylines with a radius and an opacity, one flat list.

use glam::DVec3;

/// A vertex of a strand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandVertex {
    /// World space.
    pub position: DVec3,
    /// Radius \[world units\], ≥ 0, finite. A segment has the mean of its ends'.
    pub radius: f64,
    /// Share of the light that a pass takes, 0 to 1. A segment has the mean of its ends'.
    pub opacity: f64,
}

/// Polylines of two vertices or more.
///
/// A light ray that passes nearer to a strand than its radius keeps `1 − opacity`, once a strand and pass
/// (MODEL.md, "Translucent occluders").
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Strands {
    vertices: Vec<StrandVertex>,
    /// Where each strand begins; ascending, the first is 0.
    starts: Vec<u32>,
}

impl Strands {
    /// Adds a strand; of fewer than two vertices there is nothing to add.
    pub fn push(&mut self, vertices: impl IntoIterator<Item = StrandVertex>) {
        let start = self.vertices.len();
        self.vertices.extend(vertices);
        if self.vertices.len() >= start + 2 {
            // The limit on vertices fits a u32.
            self.starts.push(start as u32);
        } else {
            self.vertices.truncate(start);
        }
    }

    /// How many strands there are.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// The vertices of all strands, one strand behind the other.
    pub fn vertices(&self) -> &[StrandVertex] {
        &self.vertices
    }

    /// The vertices of each strand, in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &[StrandVertex]> {
        let ends = self.starts.iter().skip(1).map(|&end| end as usize).chain([self.vertices.len()]);
        self.starts.iter().zip(ends).map(|(&start, end)| &self.vertices[start as usize..end])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strands_keep_their_order_and_single_vertices_are_none() {
        let vertex = |x: f64| StrandVertex { position: DVec3::splat(x), radius: 0.1, opacity: 0.5 };
        let mut strands = Strands::default();
        assert_eq!((strands.len(), strands.iter().count()), (0, 0));
        strands.push([vertex(1.0), vertex(2.0)]);
        strands.push([vertex(9.0)]);
        strands.push([vertex(3.0), vertex(4.0), vertex(5.0)]);
        let lengths: Vec<usize> = strands.iter().map(<[_]>::len).collect();
        assert_eq!(lengths, [2, 3]);
        assert_eq!(strands.iter().nth(1).unwrap()[0], vertex(3.0));
    }
}
