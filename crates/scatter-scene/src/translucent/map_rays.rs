//! The light rays through the texels of any map.

use glam::DVec3;
use scatter_core::{MapProjection, ModelError};

/// The light rays of a map, relative to a point near the scene: one linear function of the texel.
#[derive(Debug, Clone, Copy)]
pub(super) struct MapRays {
    /// Where they start, at the map's corner, and how that changes by a texel to the right and downwards.
    origin: [DVec3; 3],
    /// The way for a unit of depth, likewise.
    step: [DVec3; 3],
    /// Whether they start at a lamp.
    starts: bool,
}

/// One light ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct LightRay {
    /// Where its depth is 0, relative to the reference.
    pub origin: DVec3,
    /// The way of the light, unit.
    pub direction: DVec3,
    /// World units of its length for a unit of depth.
    pub stretch: f64,
    /// Whether light begins at the origin (a lamp), or comes from before it (a sun).
    pub starts: bool,
}

impl MapRays {
    /// Of a map, relative to `reference` (world space). An error if the projection has no inverse.
    pub fn new(projection: &MapProjection, reference: DVec3) -> Result<Self, ModelError> {
        let at = |u: f64, v: f64| {
            projection.light_ray(u, v).ok_or(ModelError::Degenerate {
                what: "the map of translucent occluders",
                problem: "its projection has no inverse",
                cure: "give an invertible projection",
            })
        };
        let (corner, right, below) = (at(0.0, 0.0)?, at(1.0, 0.0)?, at(0.0, 1.0)?);
        Ok(Self {
            origin: [corner.0 - reference, right.0 - corner.0, below.0 - corner.0],
            step: [corner.1, right.1 - corner.1, below.1 - corner.1],
            starts: projection.is_perspective(),
        })
    }

    /// Through the centre of the texel at `column`, `row`.
    #[inline]
    pub fn through(&self, column: u32, row: u32) -> LightRay {
        let (u, v) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
        let linear = |[corner, right, below]: [DVec3; 3]| corner + right * u + below * v;
        let (origin, step) = (linear(self.origin), linear(self.step));
        let stretch = step.length();
        LightRay { origin, direction: step / stretch, stretch, starts: self.starts }
    }
}
