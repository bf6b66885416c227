//! The technique: meshes of the frame's maps, and the image pass over them.

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Level, LightKind, Limits, MAX_CASCADES, MapKind,
    PhaseKind, RenderError, RenderStats, ScatterImage, VolumetricShadow, simd_level,
};

use crate::options::{ID, Options};
use crate::raster::Raster;

/// What the technique renders: all of the model but textured lights and lamps in height fog.
pub const CAPABILITIES: Capabilities = Capabilities {
    lights: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
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
    height_fog: &[LightKind::Directional],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
    ..Capabilities::NOTHING
};

/// Volumetric shadows by polygonal light volumes (Billeter et al. 2010, and what goes beyond: the crate's page).
///
/// A mesh around the shadow that the light's map describes is built and rasterised; a pixel's crossings with it, in order,
/// are the ends of its lit intervals, each of which is integrated in closed form. With threshold 0 the image is that of
/// the exact walk through the same map, to the errors of f32.
#[derive(Debug)]
pub struct LightVolume {
    options: Options,
    raster: Raster,
}

impl LightVolume {
    /// With the widest registers of the CPU that it runs on, or the portable ones if the environment says
    /// `SCATTER_SIMD=baseline`.
    pub fn new(options: Options) -> Self {
        Self::with_simd(options, simd_level())
    }

    /// With the instructions of a level: `Level::baseline()` uses nothing but what every CPU of the target has.
    pub fn with_simd(options: Options, simd: Level) -> Self {
        Self { options, raster: Raster::new(simd) }
    }
}

impl VolumetricShadow for LightVolume {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        Ok(self.raster.render(frame, &self.options, out))
    }
}
