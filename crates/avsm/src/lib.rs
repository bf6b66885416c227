//! Transmittance curves: how much of a light smoke and hair leave at each depth, and fog lit through them (Salvi et al. 2010).
//!
//! A shadow map says where light ends. Light that is dimmed rather than cut off has a curve instead: its transmittance over
//! depth, one a texel. An **adaptive** curve has a fixed number of nodes, and is compressed while segments of smoke and hair
//! stream in, so that its memory does not depend on how many there are.
//!
//! ```text
//! curves   segments ──▶ insert ──▶ compress ──▶ TransmittanceCurve: adaptive, and those it is measured against
//! map      captured layers, a source, opaque surfaces ──▶ CurveMaps: a curve a texel, a layer a map of the light
//! ray      view ray ──▶ lit parts of the shadow map ──▶ texels of the curve map ──▶ pieces between knots ──▶ radiance
//! ```
//!
//! [`Avsm`] is the technique behind [`VolumetricShadow`](scatter_core::VolumetricShadow). [`CurveMaps`] answers what surfaces
//! ask: how much light reaches this point.

mod curve;
mod curves;
mod estimate;
mod map;
mod nodes;
mod options;
mod ray;
mod technique;
mod tool;

pub use curve::{DARK, DepthRange, OPAQUE, TransmittanceCurve};
pub use curves::avsm::{AvsmCurve, LinearAvsm};
pub use curves::deep::{DeepCurve, DeepNodes};
pub use curves::fourier::FourierCurve;
pub use curves::moments::MomentCurve;
pub use curves::opacity::OpacityCurve;
pub use curves::uncompressed::{ExactNodes, UncompressedCurve};
pub use map::curve_maps::CurveMaps;
pub use map::layer::CurveLayer;
pub use nodes::{Node, optical_depth_of, visit_nodes};
pub use options::{Between, Curve, ID, MOST_CURVES, Moments, Nodes, Opaque, Options, Removal, Texels};
pub use ray::dimmed_light::{DimmedLight, DimmedPart};
pub use scatter_core::TranslucentSegment;
pub use technique::{Avsm, CAPABILITIES};
pub use tool::{AvsmTechnique, TECHNIQUE};
