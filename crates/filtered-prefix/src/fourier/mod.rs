//! The paper's basis: the shadow test as a Fourier series (Klehm et al. 2014, Section 3.1, Eqs. 8 to 10; Annen et al. 2007).
//!
//! ```text
//! V(z_ray, z_surface) ≈ ½ + Σ_{k=1}^{M/2} 2/c_k·[cos(c_k·z_ray)·sin(c_k·z_surface) − sin(c_k·z_ray)·cos(c_k·z_surface)],  c_k = (2k−1)·π
//! ```
//!
//! Errata of the paper that are put right here: the sum before Section 3.2 lacks `+ ½·s`, and Listing 4 has `1 − exp(+dist·σ)`.

mod answers;
mod filtered_row;
mod harmonics;

pub use answers::{FourierAnswers, Terms};
pub use filtered_row::FourierRow;
pub use harmonics::{FOURIER_COUNTS, harmonics};
