//! A lamp's airlight in closed form, two ways: by the exponential integral, and by Sun's table.
//!
//! The paper's Eq. 3 adds `±L(0, x)` a crossing, and leaves open how the airlight integral
//!
//! ```text
//!     ∫ₐᵇ exp(−σ(t + d))/d² dt        d the distance to the lamp
//! ```
//!
//! is evaluated; it cites Sun et al. 2005 and Pegoraro and Parker 2009. The image pass takes core's quadrature over sixteen rays, which
//! knows every phase function and cone; these know isotropic media alone. They are here for engines whose media are isotropic, and
//! to be measured against it: the crate's README has their errors and times.

mod exponential_integral;
mod sun_table;

pub use exponential_integral::{exact_airlight, scaled_e1};
pub use sun_table::SunTable;
