//! The walk of one ray through the tree, front to back, with boxes grown by the rounding of the walk.

use glam::{DVec3, Vec3A};

use super::bvh::{Bvh, F32_ROUNDING, Node, Pending};

/// A ray as the tree sees it.
pub(crate) struct RayWalk<'a> {
    bvh: &'a Bvh,
    origin: Vec3A,
    inverse: Vec3A,
    /// Grows every box.
    margin: Vec3A,
    /// Distance from the true start of the ray to `origin`, the place of the ray nearest to the tree's centre: f32 has
    /// the most digits there.
    shift: f64,
    /// Where the ray begins, from `origin`: rounded down, ≤ 0.
    from: f32,
}

/// Relative error of the quotient `(centre − origin)/direction`: three roundings, and one of the direction itself;
/// twice that.
const QUOTIENT_ERROR: f32 = 8.0 * F32_ROUNDING;

impl<'a> RayWalk<'a> {
    /// The ray from `start` (world space) in the unit direction `along`, or from `from` ≤ 0 behind that, −∞ for the whole
    /// line; `None` if it misses the whole scene.
    pub fn new(bvh: &'a Bvh, start: DVec3, along: DVec3, from: f64) -> Option<Self> {
        if bvh.nodes.is_empty() {
            return None;
        }
        // A thousandth covers all rounding here and lets a scene of one point have a size.
        let radius = 1.001 * bvh.radius + 1e-30;
        let from_centre = start - bvh.centre;
        let closest = -from_centre.dot(along);
        let offset = from_centre + closest * along;
        // Far from the scene the offset carries the rounding of the distance.
        let slack = 1e-12 * from_centre.length();
        if offset.length() > radius + slack || closest + radius + slack < from {
            return None;
        }
        let shift = closest.max(from);
        let origin = (from_centre + shift * along).as_vec3a();
        // A direction component below 1e-20 moves the ray by less than any margin within f32's range of scenes.
        let safe = |d: f64| if d.abs() < 1e-20 { 1e20f32.copysign(d as f32) } else { (1.0 / d) as f32 };
        let inverse = Vec3A::new(safe(along.x), safe(along.y), safe(along.z));
        // The origin's rounding; boxes are grown by their own.
        let margin = 4.0 * F32_ROUNDING * origin.abs() + Vec3A::splat((slack * 4.0) as f32);
        // As `limit_f32`, downwards.
        let behind = from - shift;
        let from = (behind - 1e-6 * behind.abs() - 1e-12 * shift.abs()) as f32 - f32::MIN_POSITIVE;
        Some(Self { bvh, origin, inverse, margin, shift, from })
    }

    /// Calls `leaf(first, count, limit)` for the leaves in front of the ray's start and before `limit`, about from
    /// front to back. `leaf` returns the new limit: a distance beyond which nothing is of interest (−∞ ends the walk).
    #[inline]
    pub fn visit(&self, limit: f64, mut leaf: impl FnMut(u32, u32, f64) -> f64) -> f64 {
        let mut limit = limit;
        let mut pending = Pending::<(u32, f32)>::new();
        let nodes = &self.bvh.nodes;
        // Rounded up: a limit in f32 that a box at the very limit passes.
        let mut limit_f32 = self.limit_f32(limit);
        if !(self.enter(&nodes[0]) <= limit_f32) {
            return limit;
        }
        let mut current = 0u32;
        loop {
            let node = &nodes[current as usize];
            if node.count > 0 {
                limit = leaf(node.first, node.count, limit);
                if limit == f64::NEG_INFINITY {
                    return limit;
                }
                limit_f32 = self.limit_f32(limit);
            } else {
                let near = self.enter(&nodes[node.first as usize]);
                let other = self.enter(&nodes[node.first as usize + 1]);
                if near <= limit_f32 {
                    current = node.first;
                    if other <= limit_f32 {
                        if other < near {
                            pending.push((node.first, near));
                            current = node.first + 1;
                        } else {
                            pending.push((node.first + 1, other));
                        }
                    }
                    continue;
                } else if other <= limit_f32 {
                    current = node.first + 1;
                    continue;
                }
            }
            loop {
                match pending.pop() {
                    Some((node, near)) if near <= limit_f32 => {
                        current = node;
                        break;
                    }
                    Some(_) => {}
                    None => return limit,
                }
            }
        }
    }

    fn limit_f32(&self, limit: f64) -> f32 {
        let local = limit - self.shift;
        // The shift's own rounding, and that of the conversion.
        let grown = local + 1e-6 * local.abs() + 1e-12 * self.shift.abs();
        grown as f32 + f32::MIN_POSITIVE
    }

    /// The smallest distance at which the ray may be in the box; NaN, which is before no limit, if it
    /// misses it.
    #[inline(always)]
    fn enter(&self, node: &Node) -> f32 {
        let middle = (node.centre() - self.origin) * self.inverse;
        let reach = (node.half() + self.margin) * self.inverse.abs() + middle.abs() * QUOTIENT_ERROR;
        let near = (middle - reach).max_element();
        let far = (middle + reach).min_element();
        // min_element and max_element drop NaN (an overflow) where another axis has a number; if none has, the walk
        // would lose the box, but coordinates within the caster's range do not overflow.
        if near > far || far < self.from { f32::NAN } else { near }
    }
}
