//! A sphere of smoke.

use glam::DVec3;

/// A sphere of even extinction: light that crosses a chord c of it keeps `exp(−density·c)`. Where spheres overlap their
/// densities add.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Particle {
    /// Its middle, world space.
    pub centre: DVec3,
    /// Radius \[world units\], ≥ 0, finite.
    pub radius: f64,
    /// Extinction inside of it \[1/length\], ≥ 0, finite.
    pub density: f64,
}
