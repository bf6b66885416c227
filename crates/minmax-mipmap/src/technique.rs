//! The technique: one id, and a mode for each way to answer a pixel.

use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Level, LightKind, Limits, MAX_CASCADES, MapKind,
    PhaseKind, RenderError, RenderStats, ScatterImage, VolumetricShadow, simd_level,
};

use epipolar::driver::{SliceDriver, SliceSettings};

use crate::exact::Exact;
use crate::options::{ID, Mode, Options};
use crate::sampling::{Sampling, spacing_of};
use crate::slices::TreeIntegrator;

/// What exact mode renders: all of the model but lamps in height fog.
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
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre, CameraKind::Orthographic],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    height_fog: &[LightKind::Directional],
    translucent: &[],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
};

/// What the modes on slices render: slices need an eye, and the closed form of lamps is measured to |g| = 0.99.
pub const SLICES_CAPABILITIES: Capabilities =
    Capabilities { height_fog: &[LightKind::Directional], ..epipolar::CAPABILITIES };

/// Volumetric shadows by min/max mipmaps of the shadow map (Chen et al. 2011, Yusov 2012, and what goes beyond them:
/// the crate's page).
///
/// In exact mode a pixel costs about as many nodes as its ray passes edges of shadows: tens, not the thousands of texels
/// that it crosses. Errors are those of f32: ≤ 1e-5 of the mean, against the exact walk through the same map.
#[derive(Debug)]
pub struct MinMaxMipmap {
    options: Options,
    exact: Exact,
    slices: SliceDriver<TreeIntegrator>,
    sampling: Sampling,
}

impl MinMaxMipmap {
    /// With the widest registers of the CPU that it runs on, or the portable ones if the environment says
    /// `SCATTER_SIMD=baseline`.
    pub fn new(options: Options) -> Self {
        Self::with_simd(options, simd_level())
    }

    /// With the instructions of a level: `Level::baseline()` uses nothing but what every CPU of the target has. (Mode `slices`
    /// takes those of the slice driver, [`simd_level`].)
    pub fn with_simd(options: Options, simd: Level) -> Self {
        Self {
            options,
            exact: Exact::new(simd),
            slices: SliceDriver::new(TreeIntegrator::new(options.tree)),
            sampling: Sampling::new(simd),
        }
    }
}

impl VolumetricShadow for MinMaxMipmap {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        match self.options.mode {
            Mode::Exact => CAPABILITIES,
            Mode::Slices | Mode::Sampling => SLICES_CAPABILITIES,
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        match self.options.mode {
            Mode::Exact => Ok(self.exact.render(frame, out)),
            Mode::Slices => {
                let spacing = spacing_of(frame.size(), self.options.slices);
                Ok(self.slices.render(frame, &SliceSettings::even(spacing), out))
            }
            Mode::Sampling => Ok(self.sampling.render(frame, &self.options, out)),
        }
    }
}
