//! Volumetric shadows by polygonal light volumes, after Billeter, Sintorn and Assarsson 2010.
//!
//! A shadow map describes the volume that a light reaches, and so a closed surface around it. Where a view ray crosses that
//! surface it gets out of the light or into it; between two crossings the light that the medium scatters into the ray has a
//! closed form. So the image is found by rasterising a mesh, without a step along the ray, and is exact with respect to the
//! map.
//!
//! ```text
//! shadow map ──volume──▶ caps and walls in a tree of patches ──raster──▶ crossings ──▶ lit intervals ──▶ image
//! ```

pub mod airlight;
mod estimate;
pub mod options;
pub mod raster;
pub mod surface_light;
mod technique;
mod tool;
pub mod volume;

pub use options::{Accumulate, ID, Options, Surface, Tessellation};
pub use surface_light::{SurfaceLight, surface_light};
pub use technique::{CAPABILITIES, LightVolume};
pub use tool::{LightVolumeTechnique, TECHNIQUE};
