//! The f32 tree that proposes candidates: obvhs builds it, this file keeps what a conservative walk needs.
//!
//! The tree never decides anything. Its boxes hold the f32 triangles, centred on the scene, and are grown by the
//! rounding of their own coordinates ([`Node::around`]), so that they hold the f64 triangles too, and what a walk's
//! arithmetic makes of them; a walk adds the rounding of its own numbers. So a box that a walk leaves out holds no
//! triangle that the f64 arithmetic would have found.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::{build_bvh2, build_bvh2_from_tris};
use obvhs::triangle::Triangle;

use super::core_box::CoreBox;

/// Half of the distance between 1 and the next f32: the relative error of one rounding.
pub(crate) const F32_ROUNDING: f32 = f32::EPSILON * 0.5;

/// A box around triangles, as centre and half extent, with what it holds. 32 bytes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct Node {
    centre: [f32; 3],
    /// First child (the second one follows), or first triangle.
    pub first: u32,
    half: [f32; 3],
    /// Triangles of a leaf; 0 for an inner node.
    pub count: u32,
}

/// The tree. Triangles are in the order of its leaves.
#[derive(Debug, Default)]
pub(crate) struct Bvh {
    /// Node 0 is the root; empty for a scene without triangles.
    pub nodes: Vec<Node>,
    /// The point of the world at the origin of all f32 coordinates: the middle of the scene, or of what is left of it
    /// without its strays.
    pub centre: DVec3,
    /// Radius of a sphere around the centre that holds everything.
    pub radius: f64,
    /// Largest coordinate, relative to the centre, of what is no stray; ∞ for a scene without strays.
    pub rest: f64,
}

/// A vertex so many times as far out as the rest of the scene is wide is a stray: the tree is centred on the rest. Below
/// that f32 has more than 2¹⁴ places along the rest.
const STRAY: f64 = 1024.0;
/// Unit roundoffs of a box's largest coordinate by which it grows: of the vertices (1), its centre (2) and half extent
/// (1); of a walk's sums over it, where rows, products and sums round against the centre (6) and the half extent (6);
/// of the walk of a ray, against the half extent (4). A fifth more.
const BOX_ROUNDINGS: f32 = 24.0;

/// Node indices still to be visited: on the stack of the thread, and on the heap only for a tree deeper than that.
pub(crate) struct Pending<T> {
    near: [T; PENDING_ON_STACK],
    count: usize,
    spilled: Vec<T>,
}

/// obvhs' trees are about 2·log₂(n) deep: 40 for a million triangles.
const PENDING_ON_STACK: usize = 64;

impl Node {
    /// Centre of the box, relative to the tree's centre.
    #[inline]
    pub fn centre(&self) -> Vec3A {
        Vec3A::from_array(self.centre)
    }

    /// The box between two corners, grown by the rounding of its coordinates, axis by axis.
    fn around([low, high]: [Vec3A; 2], first: u32, count: u32) -> Self {
        let margin = (BOX_ROUNDINGS * F32_ROUNDING) * low.abs().max(high.abs());
        let half = 0.5 * (high - low) + margin;
        Self { centre: (0.5 * (low + high)).to_array(), first, half: half.to_array(), count }
    }

    /// Half of the box's extent.
    #[inline]
    pub fn half(&self) -> Vec3A {
        Vec3A::from_array(self.half)
    }
}

impl Bvh {
    /// The tree over `triangles` (three indices each into `positions`, f64 world space), and the order of its leaves.
    pub fn build(positions: &[DVec3], triangles: &[[u32; 3]], bounds: (DVec3, DVec3)) -> (Self, Vec<u32>) {
        let core = CoreBox::of(positions, STRAY);
        let centre = core.map_or(0.5 * (bounds.0 + bounds.1), |core| core.centre);
        let radius = (bounds.1 - centre).abs().max((bounds.0 - centre).abs()).length();
        let rest = core.map_or(f64::INFINITY, |core| STRAY * core.reach);
        let mut tree = Self { nodes: Vec::new(), centre, radius, rest };
        if triangles.is_empty() {
            return (tree, Vec::new());
        }
        // A builder sorts triangles by where they are in the whole: strays would leave it no digits for the rest.
        let (low, high) = (DVec3::splat(-rest), DVec3::splat(rest));
        let local = |index: u32| (positions[index as usize] - centre).clamp(low, high).as_vec3a();
        let tris: Vec<Triangle> = triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: local(a), v1: local(b), v2: local(c) })
            .collect();
        let built = build_bvh2_from_tris(&tris, BvhBuildParams::medium_build(), &mut Duration::default());
        drop(tris);
        let corners: Vec<[Vec3A; 2]> = if core.is_some() {
            true_corners(&built, |primitive| {
                let vertices =
                    triangles[primitive as usize].map(|i| (positions[i as usize] - centre).as_vec3a());
                let [a, b, c] = vertices;
                [a.min(b).min(c), a.max(b).max(c)]
            })
        } else {
            built.nodes.iter().map(|node| [node.aabb().min, node.aabb().max]).collect()
        };
        let nodes = built.nodes.iter().zip(corners);
        tree.nodes = nodes.map(|(node, at)| Node::around(at, node.first_index, node.prim_count)).collect();
        (tree, built.primitive_indices)
    }

    /// The tree over boxes `[low, high]` (world space), and the order of its leaves. Without strays: boxes that are far out
    /// cost time, no box.
    pub fn of_boxes(boxes: &[[DVec3; 2]]) -> (Self, Vec<u32>) {
        let join = |[a, b]: [DVec3; 2], &[c, d]: &[DVec3; 2]| [a.min(c), b.max(d)];
        let Some([low, high]) = boxes.iter().copied().reduce(|a, b| join(a, &b)) else {
            return (Self { rest: f64::INFINITY, ..Self::default() }, Vec::new());
        };
        let centre = 0.5 * (low + high);
        let local: Vec<Aabb> =
            boxes.iter().map(|[a, b]| Aabb::new((a - centre).as_vec3a(), (b - centre).as_vec3a())).collect();
        let built = build_bvh2(&local, BvhBuildParams::medium_build(), &mut Duration::default());
        let nodes = built
            .nodes
            .iter()
            .map(|node| Node::around([node.aabb().min, node.aabb().max], node.first_index, node.prim_count));
        let tree = Self {
            nodes: nodes.collect(),
            centre,
            radius: (0.5 * (high - low)).length(),
            rest: f64::INFINITY,
        };
        (tree, built.primitive_indices)
    }

    /// Bytes of the tree.
    pub fn memory_bytes(&self) -> u64 {
        (self.nodes.capacity() * size_of::<Node>()) as u64
    }
}

/// The corners of all nodes' boxes, from the leaves up, by those of the triangles.
fn true_corners(built: &Bvh2, triangle: impl Fn(u32) -> [Vec3A; 2]) -> Vec<[Vec3A; 2]> {
    let join = |[a, b]: [Vec3A; 2], [c, d]: [Vec3A; 2]| [a.min(c), b.max(d)];
    let empty = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];
    let mut corners = vec![empty; built.nodes.len()];
    // Parents before their children, then backwards.
    let (mut order, mut pending) = (Vec::with_capacity(built.nodes.len()), vec![0u32]);
    while let Some(index) = pending.pop() {
        order.push(index);
        let node = &built.nodes[index as usize];
        if node.prim_count == 0 {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    for index in order.into_iter().rev() {
        let node = &built.nodes[index as usize];
        let first = node.first_index as usize;
        corners[index as usize] = if node.prim_count == 0 {
            join(corners[first], corners[first + 1])
        } else {
            let primitives = &built.primitive_indices[first..][..node.prim_count as usize];
            primitives.iter().map(|&primitive| triangle(primitive)).fold(empty, join)
        };
    }
    corners
}

impl<T: Copy + Default> Pending<T> {
    pub fn new() -> Self {
        Self { near: [T::default(); PENDING_ON_STACK], count: 0, spilled: Vec::new() }
    }

    #[inline]
    pub fn push(&mut self, item: T) {
        if self.count < PENDING_ON_STACK {
            self.near[self.count] = item;
            self.count += 1;
        } else {
            self.spilled.push(item);
        }
    }

    #[inline]
    pub fn pop(&mut self) -> Option<T> {
        // What was pushed last lies on the heap, if anything does.
        if let Some(item) = self.spilled.pop() {
            return Some(item);
        }
        self.count = self.count.checked_sub(1)?;
        Some(self.near[self.count])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pending_nodes_come_back_last_first_beyond_the_fixed_part() {
        let mut pending = Pending::new();
        for item in 0..200u32 {
            pending.push(item);
        }
        for item in (0..200).rev() {
            assert_eq!(pending.pop(), Some(item));
        }
        assert_eq!(pending.pop(), None);
    }
}
