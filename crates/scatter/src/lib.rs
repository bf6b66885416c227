//! The door to Scatter: the model, and every technique behind a feature.
//!
//! An engine hands over what it has anyway (camera, depth buffer, light with its shadow map, medium) as a [`Frame`];
//! a technique behind [`VolumetricShadow`] returns what the medium scatters into each pixel's ray, and how much of the
//! surface behind it still comes through.
//!
//! ```
//! use scatter::{
//!     Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, Quality, ScatterImage, SceneFacts, ShadowLayer,
//!     ShadowMap, Target, technique,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // What an engine has: a camera two metres above the ground, and the distance along each pixel's ray. Its own depth
//! // buffer is converted by `DepthEncoding`, its matrices and shadow maps by `Camera::from_matrices_in` and
//! // `ShadowDepthEncoding`.
//! let size = [64, 48];
//! let camera = Camera::perspective([0.0, 2.0, 8.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;
//! let distances = vec![20.0_f32; 64 * 48];
//! let depth = DepthMap::new(&distances, size)?;
//!
//! // A sun from above, and its shadow map of 16 × 16 texels over 20 × 20 metres, seen from 10 metres above: a roof 4
//! // metres below that plane covers the left half.
//! let light = Light::directional([0.0, -1.0, 0.0], [10.0, 9.0, 7.5])?;
//! let projection =
//!     MapProjection::orthographic([0.0, 10.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [10.0; 2], [16; 2])?;
//! let texels: Vec<f32> = (0..16 * 16).map(|i| if i % 16 < 8 { 4.0 } else { f32::INFINITY }).collect();
//! let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);
//!
//! // Thin haze. Rays that hit nothing end after 100 metres.
//! let medium = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::henyey_greenstein(0.4)?)?;
//! let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 100.0)?;
//!
//! // A technique, configured for an error that the eye accepts. Keep it: its buffers serve the next frame.
//! let technique = technique("raymarch").ok_or("built without the feature raymarch-ref")?;
//! let target = Target::Quality(Quality::Game);
//! let mut renderer = technique.configure(target, &[], &SceneFacts::of(&frame))?;
//! renderer.supports(&frame)?;
//! let mut scattered = ScatterImage::new();
//! let stats = renderer.render(&frame, &mut scattered)?;
//! println!("{:?}", stats.total_time());
//!
//! // Compose: in-scattered light + transmittance · surface.
//! let surface = [0.5_f32; 3];
//! let composed: Vec<[f32; 3]> = scattered
//!     .inscattered()
//!     .iter()
//!     .zip(scattered.transmittance())
//!     .map(|(light, through)| std::array::from_fn(|c| light[c] + through[c] * surface[c]))
//!     .collect();
//! assert_eq!(composed.len(), 64 * 48);
//!
//! // Under the roof it is darker than beside it.
//! let (under, beside) = (scattered.at(8, 24)[0], scattered.at(55, 24)[0]);
//! assert!(under < 0.8 * beside, "{under} {beside}");
//! # Ok(())
//! # }
//! ```
//!
//! An engine that wants one technique alone can depend on that technique's crate instead.

mod plan;

pub use plan::{Budget, MapAdvice, MapKindAdvice, Plan, PlanError, Rejected, plan, plan_among};
pub use scatter_core::*;

#[cfg(feature = "avsm")]
pub use avsm;
#[cfg(feature = "epipolar")]
pub use epipolar;
#[cfg(feature = "filtered-prefix")]
pub use filtered_prefix;
#[cfg(feature = "froxel")]
pub use froxel;
#[cfg(feature = "light-volume")]
pub use light_volume;
#[cfg(feature = "minmax-mipmap")]
pub use minmax_mipmap;
#[cfg(feature = "raymarch-ref")]
pub use raymarch_ref;
#[cfg(feature = "gpu")]
pub use scatter_gpu as gpu;

/// Every technique that this build has, the marcher first. The one place that names them all.
pub static TECHNIQUES: &[&dyn Technique] = &[
    #[cfg(feature = "raymarch-ref")]
    &raymarch_ref::TECHNIQUE,
    #[cfg(feature = "epipolar")]
    &epipolar::TECHNIQUE,
    #[cfg(feature = "filtered-prefix")]
    &filtered_prefix::TECHNIQUE,
    #[cfg(feature = "minmax-mipmap")]
    &minmax_mipmap::TECHNIQUE,
    #[cfg(feature = "avsm")]
    &avsm::TECHNIQUE,
    #[cfg(feature = "light-volume")]
    &light_volume::TECHNIQUE,
    #[cfg(feature = "froxel")]
    &froxel::TECHNIQUE,
];

/// The technique with that id.
pub fn technique(id: &str) -> Option<&'static dyn Technique> {
    TECHNIQUES.iter().copied().find(|technique| technique.info().id == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_is_found_by_its_id_and_no_id_is_taken_twice() {
        for (index, technique_of_list) in TECHNIQUES.iter().enumerate() {
            let id = technique_of_list.info().id;
            assert!(technique(id).is_some());
            assert!(TECHNIQUES[..index].iter().all(|earlier| earlier.info().id != id), "{id}");
        }
        assert!(technique("no-such-technique").is_none());
    }
}
