//! Baran's integrator: factors of the integrand, and their sums over the lit light rays before each pixel.
//!
//! [`Bands`] of 1/sin β → [`Factors`] (sun) or [`LampBands`] (lamp) as tables → [`Baran`], which rectifies a slice's light
//! rays and asks one of the [`sums`] for what each pixel sees of them. Height fog has no factors: `fog` sums closed forms
//! between the edges of what is lit.

mod bands;
mod direct;
mod factor;
mod fog;
mod integrand;
mod integrator;
mod settings;
pub mod sums;
mod tables;

pub use bands::Bands;
pub use direct::{DirectIntegrator, sum_directly};
pub use factor::{Factorisation, Factors, LampBands, LampFactors, LampMedium, MAX_RANK};
pub use integrand::{BandTables, Integrand, Precision};
pub use integrator::Baran;
pub use settings::{BaranSettings, Cells, MOST_LAMP_G};
pub use tables::Table;

#[cfg(feature = "svd")]
pub(crate) use factor::{WEIGHT_INTERVALS, reading_error};
