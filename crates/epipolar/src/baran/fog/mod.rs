//! Height fog under a sun: the lit part of every view ray in closed form, for media whose density falls with height.
//!
//! In a slice the density along a view ray at the angle β to the light is `ρ(eye)·e^{−m·t}`, `m = up·v(β)/scale`, and
//! `v = across·sin β + to_light·cos β`. On the light ray γ, `t = γ/sin β`, so `m·t = s(β)·γ` with
//! `s = (up·across + up·to_light·cot β)/scale`: every view ray has one slope, and up to the light ray γ it has the optical depth
//!
//! ```text
//! τ(γ, β) = σt·ρ(eye)·(1/sin β)·γ·φ(s·γ),    φ(x) = (1 − e^{−x})/x
//! ```
//!
//! No factorisation serves all slices (s differs by the slice's plane; Baran et al. 2010 leave that open), and within a slice its
//! rank is not bounded: where fog is dense at the end of a ray only, the depth at which light is lost moves with β by many
//! times the width over which it is lost. But scattering and absorption have one density, so that a lit stretch is a difference
//! of transmittances: with `A(γ) = 1 − e^{−τ(γ)}`, the light lost up to γ,
//!
//! ```text
//! vis = Σ over lit stretches [γ₁, γ₂] of A(γ₂) − A(γ₁), over A(end)
//! ```
//!
//! and nothing is summed where nothing changes. [`LitEdges`](crate::rows::LitEdges) keeps the edges of what is lit from view ray to view ray, so a
//! query costs as many closed forms as its ray has edges, however many runs the slice has: exact at any optical depth, with no
//! rank, no bands around the epipole and no bound to be kept.

mod absorption;
mod exact_sums;
#[cfg(test)]
mod rank;

pub use absorption::HeightFog;
pub use exact_sums::{ExactScratch, LitRuns};
