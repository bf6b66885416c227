//! Closed forms of the model in f64: the judge of what every technique shares.
//!
//! Nothing here comes from `scatter-core`'s physics: sun interval, airlight, phase functions and spot cone are
//! written a second time, in other forms (a Taylor series and a plain difference for the sun; the complex exponential
//! integral, and adaptive quadrature in the angle at the lamp, for lamps). A fault that all techniques inherit from
//! the core shows as a difference from these (`tests/closed_forms.rs`).
//!
//! One colour channel at a time; positions are relative to the start of the view ray.

mod airlight;
mod cone;
mod exponential_integral;
mod phase;
mod quadrature;
mod sun;

pub(crate) use airlight::PUBLISHED;
pub use airlight::{airlight_isotropic, lamp_radiance};
pub use cone::Cone;
pub use phase::PhaseFunction;
pub use sun::{sun_integral, sun_radiance};

use glam::DVec3;

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
    fn scattering(&self, cos_theta: f64) -> f64 {
        self.components.iter().map(|(sigma_s, phase)| sigma_s * phase.at(cos_theta)).sum()
    }
}
