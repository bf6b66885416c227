//! Closed forms of the model in f64: the judge of what every technique shares.
//!
//! Nothing here comes from `scatter-core`'s physics: sun interval, airlight, phase functions and spot cone are
//! written a second time, in other forms (a Taylor series and a plain difference for the sun; the complex exponential
//! integral, and adaptive quadrature in the angle at the lamp, for lamps; the density in the middle of a stretch, and
//! adaptive quadrature, for height fog). A fault that all techniques inherit from
//! the core shows as a difference from these (`tests/closed_forms.rs`).
//!
//! One colour channel at a time; positions are relative to the start of the view ray.

mod airlight;
mod cone;
mod dimmed;
mod exponential_integral;
mod fog;
mod phase;
mod quadrature;
mod sun;
mod terms;

pub(crate) use airlight::PUBLISHED;
pub use airlight::{airlight_isotropic, lamp_radiance};
pub use cone::Cone;
pub use dimmed::Fading;
pub use fog::{Fog, fog_lamp_radiance, fog_sun_by_quadrature, fog_sun_radiance};
pub use phase::PhaseFunction;
pub use sun::{sun_integral, sun_radiance};
pub use terms::{Channel, Lamp};
