//! How much each light ray of a row weighs in the filter (Klehm et al. 2014, Section 3.2): by the light that reference rays
//! of the slice have of it, and how far that is from a pixel's own.
//!
//! | light | reference rays | blended |
//! | --- | --- | --- |
//! | sun, uniform medium | knots in 1/sin β, as near as the tolerance asks | between two, linear in 1/sin β |
//! | sun, height fog | the slice's middle view ray, by its own transmittances | – |
//! | lamp | the view ray of a band's smallest angle to it, its cone included | – |
//! | any, averages | even weights (a lamp's: even in the angle at the lamp, times its cone) | – |
//!
//! Departure from Section 3.2, which has one reference ray a slice: it is then off by as much as view rays of a slice differ. A blend
//! of two filtered rows costs a second prefix sum and leaves the square of that.

mod absorbed;
mod band;
mod difference;
mod filling;
mod fog_rays;
mod frame_weights;
mod lamp_table;
mod phase_table;

pub use absorbed::absorbed;

pub use band::{BandWeights, QueryRays};
#[cfg(test)]
pub use difference::{from_even, of_blend, of_log_range};
pub use fog_rays::Fog;
pub use frame_weights::Weights;
