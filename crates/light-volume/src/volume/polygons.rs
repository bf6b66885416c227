//! A stepped volume as polygons: oriented quadrilaterals in the space of the map or in the world, for export and for proofs.
//!
//! Closed in one of two ways (Billeter et al. 2010, Section 4 and Figure 4d):
//!
//! - around the **shadow**: walls and caps, and behind all a lid at a far depth. Under a sun this is the volume that the image
//!   pass renders, since our model is lit outside of the map;
//! - around the **light**: caps turned round, the map's border joined to the light by its pyramid's sides (under a sun to a lid at
//!   depth 0), and a lid at the far depth where the map has no surface: the paper's light volume.
//!
//! Edges meet edges of other lengths where faces were merged, so what is closed is the signed sum over every piece of an edge,
//! not a pairing of whole edges: [`open_edge_count`].

use std::collections::HashMap;

use glam::DVec3;
use scatter_core::{MapProjection, ShadowLayer};

use super::face::{Axis, Face};
use super::stepped::SteppedVolume;

/// What a mesh is closed around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// What the light does not reach.
    Shadow,
    /// What it reaches.
    Light,
}

/// An oriented rectangle: seen from outside of what the mesh encloses, its corners go counter-clockwise in a right-handed
/// space of column, row and depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad {
    /// Column border, row border, depth.
    pub corners: [[f64; 3]; 4],
}

impl Quad {
    /// Square to an axis, between two borders of both others (in the order column, row, depth), seen from smaller numbers.
    fn facing_back(axis: Axis, at: f64, [a0, a1]: [f64; 2], [b0, b1]: [f64; 2]) -> Self {
        let corners = match axis {
            // (row, depth)
            Axis::Column => [[at, a0, b0], [at, a0, b1], [at, a1, b1], [at, a1, b0]],
            // (column, depth)
            Axis::Row => [[a0, at, b0], [a1, at, b0], [a1, at, b1], [a0, at, b1]],
            // (column, row)
            Axis::Depth => [[a0, b0, at], [a0, b1, at], [a1, b1, at], [a1, b0, at]],
        };
        Self { corners }
    }

    fn turned_if(mut self, turns: bool) -> Self {
        if turns {
            self.corners.reverse();
        }
        self
    }

    /// Its corners in the world; `None` if the projection has no inverse.
    pub fn in_world(&self, projection: &MapProjection) -> Option<[DVec3; 4]> {
        let mut world = [DVec3::ZERO; 4];
        for (corner, [u, v, depth]) in world.iter_mut().zip(self.corners) {
            let (origin, step) = projection.light_ray(u, v)?;
            *corner = origin + step * depth;
        }
        Some(world)
    }
}

/// The mesh of a layer, closed; `+∞` is drawn at the depth `far`, which lies behind all surfaces. O(faces), and O(texels) around
/// the light.
pub fn quads(volume: &SteppedVolume, layer: &ShadowLayer<'_>, closing: Closing, far: f64) -> Vec<Quad> {
    let mut quads = Vec::new();
    let [width, height] = volume.size();
    let cut = |depth: f32| f64::from(depth).min(far);
    volume.for_each_face(|face| {
        let is_border = |axis: usize, size: u32| face.first[axis] == 0 || face.first[axis] == size;
        let on_border = match face.axis {
            Axis::Column => is_border(0, width),
            Axis::Row => is_border(1, height),
            Axis::Depth => false,
        };
        if closing == Closing::Shadow || !on_border {
            let quad = quad_of(&face, cut);
            quads.push(quad.turned_if(closing == Closing::Light));
        }
        if closing == Closing::Shadow && face.axis == Axis::Depth {
            let lid = Face { depth: [f32::INFINITY; 2], ..face };
            quads.push(quad_of(&lid, cut).turned_if(true));
        }
    });
    if closing == Closing::Light {
        close_around_light(volume, layer, far, &mut quads);
    }
    quads
}

/// A face as the border of the shadow.
fn quad_of(face: &Face, cut: impl Fn(f32) -> f64) -> Quad {
    let borders = |axis: usize| [face.first[axis], face.last[axis]].map(f64::from);
    let [before, behind] = face.depth.map(&cut);
    let depths = [before.min(behind), before.max(behind)];
    match face.axis {
        Axis::Depth => Quad::facing_back(Axis::Depth, before, borders(0), borders(1)),
        Axis::Column => {
            Quad::facing_back(Axis::Column, borders(0)[0], borders(1), depths).turned_if(face.sign() < 0)
        }
        Axis::Row => {
            Quad::facing_back(Axis::Row, borders(1)[0], borders(0), depths).turned_if(face.sign() < 0)
        }
    }
}

fn close_around_light(volume: &SteppedVolume, layer: &ShadowLayer<'_>, far: f64, quads: &mut Vec<Quad>) {
    let [width, height] = volume.size();
    let depth_at = |i: u32, j: u32| f64::from(volume.depth_at(layer, i, j)).min(far);
    let span = |n: u32| [f64::from(n), f64::from(n) + 1.0];
    for j in 0..height {
        for (border, i) in [(0, 0), (width, width - 1)] {
            let side = Quad::facing_back(Axis::Column, border.into(), span(j), [0.0, depth_at(i, j)]);
            quads.push(side.turned_if(border != 0));
        }
        for i in (0..width).filter(|&i| volume.depth_at(layer, i, j) == f32::INFINITY) {
            quads.push(Quad::facing_back(Axis::Depth, far, span(i), span(j)).turned_if(true));
        }
    }
    for i in 0..width {
        for (border, j) in [(0, 0), (height, height - 1)] {
            let side = Quad::facing_back(Axis::Row, border.into(), span(i), [0.0, depth_at(i, j)]);
            quads.push(side.turned_if(border != 0));
        }
    }
    if !layer.projection().is_perspective() {
        let [u, v] = volume.size().map(|n| [0.0, f64::from(n)]);
        quads.push(Quad::facing_back(Axis::Depth, 0.0, u, v));
    }
}

/// On how many points of how many lines the signed incidence of a mesh's edges changes: 0 if the mesh is closed.
///
/// Every edge runs along one axis. As a signed measure on its line it is +1 from where it starts to where it ends; the sum over
/// all edges of a line is 0 everywhere if and only if its changes cancel at every point. Edges at depth 0 of a perspective map
/// are points, the lamp itself (`apex`).
pub fn open_edge_count(quads: &[Quad], apex: bool) -> usize {
    let mut changes: HashMap<(usize, [u64; 3]), i64> = HashMap::new();
    for quad in quads {
        for (n, from) in quad.corners.iter().enumerate() {
            let to = quad.corners[(n + 1) % 4];
            let Some(axis) = (0..3).find(|&axis| from[axis] != to[axis]) else { continue };
            if apex && axis < 2 && from[2] == 0.0 {
                continue;
            }
            // −0 and 0 are one place.
            let key = |corner: &[f64; 3]| (axis, corner.map(|value| (value + 0.0).to_bits()));
            *changes.entry(key(from)).or_default() += 1;
            *changes.entry(key(&to)).or_default() -= 1;
        }
    }
    changes.values().filter(|&&change| change != 0).count()
}
