//! The walk through the tree that collects the shadows on one view ray.
//!
//! A box is entered if it meets the half-strip from the ray towards the sun (the triangle between the ray and the
//! lamp) where the ray is not known to be shadowed yet. That changes no bit of the union ([`ShadowSpans`]), so the
//! walk may begin with the triangles that shadowed the neighbouring ray and go on with what shadows most.

use glam::DVec2;

use crate::caster::{SceneCaster, Segment};
use crate::cutout::AlphaMask;
use crate::tree::Pending;

use super::mask_line;
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
    /// Of one cut-out, ascending.
    texel_shadows: Vec<(f64, f64)>,
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

    /// Adds the shadow of a triangle.
    #[inline]
    pub fn add(&mut self, caster: &SceneCaster, shadow: &ShadowPlane, triangle: u32) {
        self.counts.candidates += 1;
        let corners = caster.corners(triangle);
        let Some(segment) = shadow.plane.cut(corners) else { return };
        let grew = match caster.cards().get(triangle) {
            None => shadow.shadow(&segment).is_some_and(|(low, high)| self.spans.add(low, high)),
            Some(card) => {
                let texels = shadow.plane.carried(corners, card.texels);
                self.add_card(shadow, &segment, texels, caster.cards().mask(card))
            }
        };
        if grew {
            self.counts.intervals += 1;
            self.seeds.push(triangle);
        }
    }

    /// Adds the shadows of a cut-out's texels. Whether the union grew.
    ///
    /// Texture coordinates are linear over the triangle, so along its segment too: the texels there lie on a straight
    /// line, whose borders are shares of the segment, and those have closed-form shadows.
    fn add_card(
        &mut self,
        shadow: &ShadowPlane,
        segment: &Segment,
        [a, b]: [DVec2; 2],
        mask: &AlphaMask,
    ) -> bool {
        let Some(part) = shadow.lit_part(segment) else { return false };
        let (low, high) = (part.shadow[0].min(part.shadow[1]), part.shadow[0].max(part.shadow[1]));
        let Some((low, high)) = self.spans.uncovered(low, high) else { return false };
        let range = shadow.shares_within(segment, &part, low, high);
        self.texel_shadows.clear();
        mask_line::runs(mask, a, b, range, |first, last| {
            // An end of the whole part has its own number, as that of an opaque triangle.
            let end = |share: f64| {
                if share == part.shares[0] {
                    part.shadow[0]
                } else if share == part.shares[1] {
                    part.shadow[1]
                } else {
                    shadow.shadow_of(segment, &part, share)
                }
            };
            let (p, q) = (end(first), end(last));
            self.texel_shadows.push((p.min(q), p.max(q)));
        });
        if part.shadow[0] > part.shadow[1] {
            self.texel_shadows.reverse();
        }
        self.spans.add_all(&self.texel_shadows)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let seeds = self.seeds.capacity() + self.previous_seeds.capacity();
        let texels = self.texel_shadows.capacity() * size_of::<(f64, f64)>();
        (seeds * size_of::<u32>() + texels) as u64 + self.spans.memory_bytes()
    }
}
