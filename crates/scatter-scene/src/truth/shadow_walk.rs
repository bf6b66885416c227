//! The walk through the tree that collects the shadows on one view ray.
//!
//! A box is entered if it meets the half-strip from the ray towards the sun (the triangle between the ray and the
//! lamp) where the ray is not known to be shadowed yet. That changes no bit of the union ([`ShadowSpans`]), so the
//! walk may begin with the triangles that shadowed the neighbouring ray and go on with what shadows most.

use crate::caster::{Pending, SceneCaster};

use super::shadow_plane::ShadowPlane;
use super::shadow_spans::ShadowSpans;

/// Work of a walk; independent of the machine and of the number of threads.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WalkCounts {
    /// Boxes tested.
    pub boxes: u64,
    /// Triangles that were cut.
    pub candidates: u64,
    /// Triangles whose shadow made the union grow.
    pub intervals: u64,
}

/// Buffers of a walk, reused from ray to ray.
#[derive(Debug, Default)]
pub(crate) struct ShadowWalk {
    /// The union on the ray.
    pub spans: ShadowSpans,
    /// Triangles that made the union grow, in the order in which they did.
    seeds: Vec<u32>,
    previous_seeds: Vec<u32>,
    pub counts: WalkCounts,
}

impl ShadowWalk {
    /// Forgets the neighbouring ray and the counts: what follows depends on nothing before.
    pub fn restart(&mut self) {
        self.seeds.clear();
        self.counts = WalkCounts::default();
    }

    /// Fills [`Self::spans`] with all shadows on `[0, end]`.
    pub fn collect(&mut self, caster: &SceneCaster, shadow: &ShadowPlane, end: f64) {
        self.spans.reset(end);
        if end == 0.0 {
            return;
        }
        std::mem::swap(&mut self.seeds, &mut self.previous_seeds);
        self.seeds.clear();
        for index in 0..self.previous_seeds.len() {
            self.add(caster, shadow, self.previous_seeds[index]);
        }
        let bvh = caster.bvh();
        if bvh.nodes.is_empty() || self.spans.is_full() {
            return;
        }
        let box_shadow = shadow.box_shadow(bvh);
        let mut pending = Pending::<(u32, f64, f64)>::new();
        pending.push((0, f64::NEG_INFINITY, f64::INFINITY));
        while let Some((index, low, high)) = pending.pop() {
            if self.spans.covers(low, high) {
                continue;
            }
            let node = &bvh.nodes[index as usize];
            if node.count > 0 {
                for triangle in node.first..node.first + node.count {
                    self.add(caster, shadow, triangle);
                }
                if self.spans.is_full() {
                    return;
                }
                continue;
            }
            self.counts.boxes += 2;
            let (near, far) = (node.first, node.first + 1);
            let children =
                (box_shadow.of(&bvh.nodes[near as usize]), box_shadow.of(&bvh.nodes[far as usize]));
            match children {
                (Some(a), Some(b)) => {
                    // The longer shadow last, so that it comes off the stack first.
                    let length = |(low, high): (f64, f64)| high.min(end) - low.max(0.0);
                    let [first, last] =
                        if length(a) > length(b) { [(far, b), (near, a)] } else { [(near, a), (far, b)] };
                    pending.push((first.0, first.1.0, first.1.1));
                    pending.push((last.0, last.1.0, last.1.1));
                }
                (Some((low, high)), None) => pending.push((near, low, high)),
                (None, Some((low, high))) => pending.push((far, low, high)),
                (None, None) => {}
            }
        }
    }

    #[inline]
    fn add(&mut self, caster: &SceneCaster, shadow: &ShadowPlane, triangle: u32) {
        self.counts.candidates += 1;
        if let Some(segment) = shadow.plane.cut(caster.corners(triangle))
            && let Some((low, high)) = shadow.shadow(&segment)
            && self.spans.add(low, high)
        {
            self.counts.intervals += 1;
            self.seeds.push(triangle);
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let seeds = self.seeds.capacity() + self.previous_seeds.capacity();
        (seeds * size_of::<u32>()) as u64 + self.spans.memory_bytes()
    }
}
