//! The brute-force marcher that every technique races, and the exact walk through a shadow map that judges them.
//!
//! [`ShadowMapWalk`] is shadow-map truth: f64, no step size, no options. [`HeightFieldWalk`] is the same for the surface that
//! interpolates the map, which techniques that do so are judged by. [`RayMarch`] is the honest opponent: f32,
//! SIMD, a number of steps. They share how a view ray is cut by the maps of a light, and nothing else.

mod height_field;
mod map_segments;
mod march;
mod walk;

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, LightKind, Limits, MAX_CASCADES, MapKind, PhaseKind,
};

pub use height_field::{HEIGHT_FIELD_ID, HeightFieldWalk};
pub use march::{Distribution, MARCH_ID, MOST_STEPS, Options, RayMarch, RayMarchTechnique, TECHNIQUE};
pub use walk::{ShadowMapWalk, WALK_ID};

/// All that the model has, by name: a feature that is added to it is refused until it is named here.
pub(crate) const EVERYTHING: Capabilities = Capabilities {
    lights: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    textures: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    maps: &[
        MapKind::Unshadowed,
        MapKind::Orthographic,
        MapKind::Perspective,
        MapKind::Cube,
        MapKind::Faces,
        MapKind::Cascades,
    ],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre, CameraKind::Orthographic],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    height_fog: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    translucent: &[],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
};
