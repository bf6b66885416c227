//! Depths as 16-bit codes that are rounded outwards: a node's bounds in four bytes.
//!
//! What is coded is a number that is linear along every view ray: the depth of a parallel map, and `−1/depth` of a
//! perspective one (both grow with the depth). Codes cover a range of it; whatever lies outside is clamped so that no
//! comparison with a ray's code is ever wrong, whichever range was chosen. A badly chosen range costs time alone.
//!
//! ```text
//!     nearest of a node    0 … 65534, 65535 = no surface         ≤ the true one
//!     farthest of a node   1 … 65534, 65535 = beyond the range   ≥ the true one
//!     a point of a ray     ½ … 65534½
//! ```
//!
//! So a point before the range is never "behind" anything, and one beyond it is "before" nothing but the open sky.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, u32x16};

/// Largest code: no surface, or one beyond the range.
pub(crate) const LAST: f32 = 65535.0;

/// How much bounds are widened \[codes\]: a ray's code is a sum and a product of numbers up to 65535 in f32, three
/// roundings of at most 2⁻⁹ each, and its parameter has one of its own. Twice that, and a ninth more nodes if it were 1.
const MARGIN: f32 = 0.05;

/// Codes a unit where there is no range: every finite depth that a scene has is code 0.
const USELESS: f64 = 1e-30;

/// How depths of one map are coded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthCodes {
    /// The coordinate (depth, or −1/depth) at code 0.
    nearest: f64,
    /// Codes a unit of the coordinate.
    per_unit: f64,
    inverse: bool,
}

impl DepthCodes {
    /// Codes for coordinates from `nearest` to `farthest`; `inverse` for a perspective map, whose coordinate is −1/depth.
    /// A range that is empty or not finite gives codes that know light from shadow nowhere, which is slow and not wrong.
    pub fn new([nearest, farthest]: [f64; 2], inverse: bool) -> Self {
        // −1/depth is rounded relative to itself, so a range of a few hundredths of it would have no 65535 steps.
        let range = if inverse { (farthest - nearest).max(0.25 * nearest.abs()) } else { farthest - nearest };
        // A code of slack at both ends, for the rounding of rays that touch them.
        let per_unit = f64::from(((f64::from(LAST) - 3.0) / range) as f32);
        let nearest = f64::from((nearest - 1.5 / per_unit) as f32);
        if range > 0.0 && per_unit.is_normal() && nearest.is_finite() {
            // Both are numbers of f32: texels are coded in f32, and must not be shifted against rays.
            Self { nearest, per_unit, inverse }
        } else {
            Self { nearest: 0.0, per_unit: USELESS, inverse }
        }
    }

    /// The depth at code 0 of a perspective map, below which codes tell nothing; 0 of a parallel map.
    pub fn nearest_depth(&self) -> f64 {
        // A useless range begins at −1/∞.
        if self.inverse && self.nearest < 0.0 { -1.0 / self.nearest } else { 0.0 }
    }

    /// The coordinate of a depth ≥ 0.
    pub fn coordinate(&self, depth: f64) -> f64 {
        if self.inverse { -1.0 / depth } else { depth }
    }

    /// Start and step of a ray's code, for a coordinate that is linear along it; to be [clamped](Self::clamp).
    pub fn of_ray(&self, [start, step]: [f64; 2]) -> [f64; 2] {
        [(start - self.nearest) * self.per_unit, step * self.per_unit]
    }

    /// The code of a point of a ray at a depth > 0.
    pub fn of_point(&self, depth: f64) -> f32 {
        Self::clamp(((self.coordinate(depth) - self.nearest) * self.per_unit) as f32)
    }

    /// A ray's code as it is compared with a node's. NaN becomes ½.
    pub fn clamp(code: f32) -> f32 {
        if code > 0.5 { code.min(LAST - 0.5) } else { 0.5 }
    }

    /// Nodes of sixteen pairs of depths, nearest and farthest, as [`Node`](crate::Node) holds them.
    #[inline(always)]
    pub(crate) fn encode<S: Simd>(&self, simd: S, nearest: f32x16<S>, farthest: f32x16<S>) -> u32x16<S> {
        // Truncated: down, and up after one has been added.
        let low = self.code(simd, nearest, -MARGIN, [0.0, LAST - 1.0]);
        let high = self.code(simd, farthest, 1.0 + MARGIN, [1.0, LAST]);
        low | (high << 16)
    }

    #[inline(always)]
    fn code<S: Simd>(&self, simd: S, depth: f32x16<S>, slack: f32, [least, most]: [f32; 2]) -> u32x16<S> {
        let coordinate = if self.inverse { f32x16::splat(simd, -1.0) / depth } else { depth };
        let scale = f32x16::splat(simd, self.per_unit as f32);
        let code = (coordinate - self.nearest as f32).mul_add(scale, f32x16::splat(simd, slack));
        let code = code.max(f32x16::splat(simd, least)).min(f32x16::splat(simd, most));
        let sky = depth.simd_eq(f32x16::splat(simd, f32::INFINITY));
        let code = sky.select(f32x16::splat(simd, LAST), code);
        code.to_int::<fearless_simd::i32x16<S>>().bitcast()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Node;
    use fearless_simd::Level;
    use scatter_core::at_level;

    fn encoded(codes: &DepthCodes, depth: f32) -> Node {
        let mut found = [0; 16];
        let simd = Level::new();
        at_level!(simd, v => {
            let lanes = f32x16::splat(v, depth);
            codes.encode(v, lanes, lanes).store_slice(&mut found);
        });
        Node(found[7])
    }

    /// Whatever range is chosen, a code never says of a point that is not deeper than a surface that it is dark, nor of
    /// one that is deeper that it is lit.
    #[test]
    fn no_range_makes_a_code_lie() {
        let depths = [0.0, 1e-6, 0.3, 0.999, 1.0, 1.001, 2.0, 17.0, 1e4, 1e30, f32::INFINITY];
        let ranges =
            [[0.5, 20.0], [0.999, 1.001], [2.0, 1.0], [0.0, f64::INFINITY], [-1e9, 1e9], [0.0, 1e-30]];
        let mut decided = 0;
        for inverse in [false, true] {
            for range in ranges {
                let range = if inverse { range.map(|depth| -1.0 / depth) } else { range };
                let codes = DepthCodes::new(range, inverse);
                for surface in depths {
                    let node = encoded(&codes, surface);
                    for point in depths.into_iter().filter(|point| *point > 0.0 && point.is_finite()) {
                        let code = codes.of_point(point.into());
                        let (lit, dark) = (code <= node.nearest(), code >= node.farthest());
                        assert!(!lit || point <= surface, "{codes:?}: {point} before {surface}, {node:?}");
                        assert!(!dark || point > surface, "{codes:?}: {point} behind {surface}, {node:?}");
                        decided += usize::from(lit || dark);
                    }
                }
            }
        }
        // A coder that never decides would pass: of 2·6·11·9 pairs a good part is told apart.
        assert!(decided > 400, "{decided}");
    }
}
