//! What the GPU's techniques render, as data.

use scatter_core::{CameraKind, Capabilities, ExtinctionKind, Kind, LightKind, Limits, MapKind, PhaseKind};

use crate::technique::Technique;

/// Of the marcher: all of the model but lamps in height fog and translucent occluders.
pub const MARCH: Capabilities = Capabilities {
    lights: LightKind::ALL,
    textures: LightKind::ALL,
    maps: MapKind::ALL,
    cameras: CameraKind::ALL,
    extinctions: ExtinctionKind::ALL,
    phases: PhaseKind::ALL,
    phase_sums: true,
    height_fog: &[LightKind::Directional],
    translucent: &[],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: 16, layer_texels: 8192 * 8192 },
};

/// Of exact min/max: the same.
pub const MINMAX: Capabilities = MARCH;

/// Of epipolar slices: suns without glass, perspective cameras.
pub const EPIPOLAR: Capabilities = Capabilities {
    lights: &[LightKind::Directional],
    textures: &[],
    maps: &[MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre],
    ..MARCH
};

/// Of a technique.
pub const fn of(technique: Technique) -> Capabilities {
    match technique {
        Technique::RayMarch { .. } => MARCH,
        Technique::MinmaxMipmap => MINMAX,
        Technique::Epipolar(_) => EPIPOLAR,
    }
}
