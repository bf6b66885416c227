//! What the closed forms are formulas of: one colour channel of a medium and of a lamp.

use glam::DVec3;

use super::cone::Cone;
use super::phase::PhaseFunction;

/// One colour channel of a medium.
#[derive(Debug, Clone, Copy)]
pub struct Channel<'a> {
    /// Scattering coefficient \[1/length\], ≥ 0, and phase function of each kind of particle.
    pub components: &'a [(f64, PhaseFunction)],
    /// Extinction \[1/length\], at least the sum of the scattering coefficients.
    pub sigma_t: f64,
}

/// One colour channel of a lamp.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    /// Position relative to the start of the view ray.
    pub position: DVec3,
    /// Intensity \[W/sr\].
    pub intensity: f64,
    /// The cone of a spot.
    pub cone: Option<Cone>,
}

impl Channel<'_> {
    /// `Σ σs·p(cosθ)` \[1/(length·sr)\].
    pub(super) fn scattering(&self, cos_theta: f64) -> f64 {
        self.components.iter().map(|(sigma_s, phase)| sigma_s * phase.at(cos_theta)).sum()
    }
}
