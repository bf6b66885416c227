//! The curves: the adaptive one, the truth, and the techniques that it is measured against.

pub mod avsm;
pub mod deep;
pub mod fourier;
pub mod moments;
pub mod opacity;
mod sampled;
pub mod uncompressed;
