//! The code of a depth: what is affine along a ray, and what planes of the world are affine in.

/// `depth` under a parallel map, `−1/depth` under a perspective one (`block_rays.rs` says why).
#[inline(always)]
pub fn code_of(depth: f32, perspective: bool) -> f32 {
    // A depth of 0 is the lamp itself; the code stays finite, so that no product is NaN.
    if perspective { (-1.0 / depth).max(-1e30) } else { depth }
}
