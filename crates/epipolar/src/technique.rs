//! The technique: Baran's integrator on the slice driver.

use scatter_core::{
    Frame, Phase, Projection, RenderError, RenderStats, ScatterImage, ShadowMap, Unsupported,
    VolumetricShadow,
};

use crate::baran::{Baran, MOST_LAMP_G};
use crate::driver::SliceDriver;
use crate::options::{ID, Options};

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

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        let unsupported = |reason| Err(Unsupported { reason });
        if frame.camera().projection() == Projection::Orthographic {
            return unsupported("an orthographic camera: its view rays do not meet in an eye");
        }
        if frame.shadow().layers().any(|layer| layer.texels().len() > u32::MAX as usize) {
            return unsupported("a shadow map of more than 4,294,967,295 texels");
        }
        let needle = |phase: &Phase| matches!(phase, Phase::HenyeyGreenstein { g } if g.abs() > MOST_LAMP_G);
        let components = frame.medium().components();
        if frame.light().position().is_some() && components.iter().any(|component| needle(&component.phase)) {
            return unsupported(
                "a lamp in a medium whose |g| is above 0.99: its lobe is thinner than the factors' tables",
            );
        }
        match frame.shadow() {
            ShadowMap::Cascades(_) => unsupported("cascades: give one map"),
            _ => Ok(()),
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = self.driver.render(frame, &self.options.slices(), out);
        let medium = frame.medium();
        let modelled = [
            ("transmittance", medium.sigma_t().iter().any(|&sigma| sigma > 0.0)),
            ("rgb-extinction", !medium.is_grey()),
            ("phase", medium.components().iter().any(|component| !component.phase.is_isotropic())),
            ("light-texture", frame.texture().is_some()),
            ("shadow-map", frame.shadow().casts_shadow()),
        ];
        for (name, _) in modelled.into_iter().filter(|(_, is_modelled)| *is_modelled) {
            stats.modelled.push(name, ());
        }
        Ok(stats)
    }
}
