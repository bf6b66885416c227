//! The technique: Baran's integrator on the slice driver.

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, LightKind, Limits, MAX_CASCADES, MapKind, PhaseKind,
    RenderError, RenderStats, ScatterImage, VolumetricShadow,
};

use crate::baran::{Baran, MOST_LAMP_G};
use crate::driver::SliceDriver;
use crate::options::{ID, Options};

/// What any technique on this crate's slices can be offered: view rays that meet in an eye, so no orthographic camera; texel
/// indices are u32. [`Epipolar`] renders all of it.
pub const CAPABILITIES: Capabilities = Capabilities {
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
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    height_fog: &[LightKind::Directional],
    translucent: &[],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: MOST_LAMP_G, cascades: MAX_CASCADES, layer_texels: u32::MAX as u64 },
};

/// Epipolar integration of volumetric shadows (Baran et al. 2010, and what goes beyond it: the crate's page).
///
/// Time grows with the number of slices and what they have in them, not with pixels × samples: about `s·(d + 2·w)` for s
/// slices of d texel columns and w pixel columns. Errors: exact along a slice to the rounding of f32; between slices
/// as [`Options`] say; unoccluded pixels are exact.
#[derive(Debug)]
pub struct Epipolar {
    options: Options,
    driver: SliceDriver<Baran>,
}

impl Epipolar {
    /// An integrator for the CPU that it runs on.
    pub fn new(options: Options) -> Self {
        Self { options, driver: SliceDriver::new(Baran::new(options.sums())) }
    }
}

impl VolumetricShadow for Epipolar {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        Ok(self.driver.render(frame, &self.options.slices(), out))
    }
}
