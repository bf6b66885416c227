//! The f32 tree that proposes candidates: obvhs builds it, this file keeps what a conservative walk needs.
//!
//! The tree never decides anything. Its boxes hold the f32 triangles, centred on the scene, and are grown so that
//! they hold the f64 triangles too; a walk grows them once more by the rounding of its own arithmetic. So a box that
//! a walk leaves out holds no triangle that the f64 arithmetic would have found.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;

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
#[derive(Debug)]
pub(crate) struct Bvh {
    /// Node 0 is the root; empty for a scene without triangles.
    pub nodes: Vec<Node>,
    /// The point of the world at the origin of all f32 coordinates.
    pub centre: DVec3,
    /// Largest coordinate, relative to the centre.
    pub largest: f32,
    /// Radius of a sphere around the centre that holds everything.
    pub radius: f64,
}

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

    /// Half of the box's extent.
    #[inline]
    pub fn half(&self) -> Vec3A {
        Vec3A::from_array(self.half)
    }
}

impl Bvh {
    /// The tree over `triangles` (three indices each into `positions`, f64 world space), and the order of its leaves.
    pub fn build(positions: &[DVec3], triangles: &[[u32; 3]], bounds: (DVec3, DVec3)) -> (Self, Vec<u32>) {
        let centre = 0.5 * (bounds.0 + bounds.1);
        let half_diagonal = 0.5 * (bounds.1 - bounds.0);
        let largest = half_diagonal.max_element() as f32;
        let local = |index: u32| (positions[index as usize] - centre).as_vec3a();
        let tris: Vec<Triangle> = triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: local(a), v1: local(b), v2: local(c) })
            .collect();
        let radius = half_diagonal.length();
        if tris.is_empty() {
            return (Self { nodes: Vec::new(), centre, largest, radius }, Vec::new());
        }
        let built = build_bvh2_from_tris(&tris, BvhBuildParams::medium_build(), &mut Duration::default());
        drop(tris);
        // Rounding a vertex to f32, taking the box's centre and its half extent: three roundings of at most the
        // largest coordinate. Twice that.
        let margin = 6.0 * F32_ROUNDING * largest;
        let nodes = built
            .nodes
            .iter()
            .map(|node| {
                let aabb = node.aabb();
                let half = 0.5 * (aabb.max - aabb.min) + Vec3A::splat(margin);
                Node {
                    centre: (0.5 * (aabb.min + aabb.max)).to_array(),
                    first: node.first_index,
                    half: half.to_array(),
                    count: node.prim_count,
                }
            })
            .collect();
        (Self { nodes, centre, largest, radius }, built.primitive_indices)
    }

    /// Bytes of the tree.
    pub fn memory_bytes(&self) -> u64 {
        (self.nodes.capacity() * size_of::<Node>()) as u64
    }
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
