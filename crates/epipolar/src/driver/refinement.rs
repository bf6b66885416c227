//! When gaps between two slices are halved.

/// Most times that a gap is halved. Every one doubles the slices in the worst case.
pub const MOST_HALVINGS: u32 = 6;

/// When a gap gets a slice of its own. (Baran et al. 2010 have slices a pixel apart everywhere; initial slices that are refined
/// where they differ are in the spirit of Engelhardt and Dachsbacher 2010, along the other axis.)
///
/// What is thinner than the gap between two slices that agree is not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Largest difference of two neighbouring slices' answers that is interpolated over, relative to the pixel's
    /// radiance.
    pub tolerance: f32,
    /// Share of the unoccluded radiance below which differences are measured against it.
    pub floor: f32,
    /// How often a gap may be halved.
    pub halvings: u32,
    /// Whether pixels that are still in doubt then are walked through the map, ray by ray.
    pub walks_rest: bool,
}
