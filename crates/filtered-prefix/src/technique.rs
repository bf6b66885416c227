//! The technique: prefix-filtered rows on the slice driver.

use epipolar::driver::SliceDriver;
use scatter_core::{Capabilities, Frame, RenderError, RenderStats, ScatterImage, VolumetricShadow};

use crate::integrator::PrefixIntegrator;
use crate::options::{ID, Options};

/// What the technique renders: all that slices can be offered.
pub const CAPABILITIES: Capabilities = epipolar::CAPABILITIES;

/// Prefix-filtered single scattering (Klehm et al. 2014; Peters et al. 2016, 2017, and what goes beyond them: the crate's page).
#[derive(Debug)]
pub struct FilteredPrefix {
    options: Options,
    driver: SliceDriver<PrefixIntegrator>,
}

impl FilteredPrefix {
    /// For the CPU that it runs on.
    pub fn new(options: Options) -> Self {
        Self { options, driver: SliceDriver::new(PrefixIntegrator::new(options)) }
    }
}

impl VolumetricShadow for FilteredPrefix {
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
