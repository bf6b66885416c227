//! The technique: prefix-filtered rows on the slice driver.

use epipolar::driver::SliceDriver;
use scatter_core::{
    Capabilities, Frame, RenderError, RenderStats, ScatterImage, StageClock, VolumetricShadow,
};

use crate::filtered_map::FilteredMap;
use crate::integrator::PrefixIntegrator;
use crate::options::{Fetch, ID, Options, Rectification};
use crate::projective::{Extent, NotRectified};

/// What the technique renders: all that slices can be offered.
pub const CAPABILITIES: Capabilities = epipolar::CAPABILITIES;

/// What one fetch a pixel from a filtered map renders: one row's weights serve all channels, and know no fog.
pub const CAPABILITIES_OF_FETCH: Capabilities =
    Capabilities { textures: &[], height_fog: &[], ..CAPABILITIES };

/// Prefix-filtered single scattering (Klehm et al. 2014; Peters et al. 2016, 2017, and what goes beyond them: the crate's page).
#[derive(Debug)]
pub struct FilteredPrefix {
    options: Options,
    driver: SliceDriver<PrefixIntegrator>,
    filtered: FilteredMap,
}

impl FilteredPrefix {
    /// For the CPU that it runs on.
    pub fn new(options: Options) -> Self {
        let driver = SliceDriver::new(PrefixIntegrator::new(options));
        Self { options, driver, filtered: FilteredMap::default() }
    }
}

impl VolumetricShadow for FilteredPrefix {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        if self.options.fetch == Fetch::Exact { CAPABILITIES } else { CAPABILITIES_OF_FETCH }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut maps = RenderStats::default();
        let mut clock = StageClock::start();
        let rows = self.choose_rows(frame)?;
        clock.lap(&mut maps, "map");
        let own_map = self.driver.integrator.own_map();
        let mut stats = if self.options.fetch != Fetch::Exact && own_map.is_filled() {
            self.filtered.render((frame, own_map), &self.options, out)
        } else {
            self.driver.render(frame, &self.options.slices(), out)
        };
        if let Some(rows) = rows {
            maps.stages.iter().for_each(|(stage, time)| stats.stages.push(stage, time));
            stats.modelled.push(rows, ());
        }
        Ok(stats)
    }
}

impl FilteredPrefix {
    /// Makes a projective map where one is asked for; returns which rows it will be, where that was the question.
    fn choose_rows(&mut self, frame: &Frame<'_>) -> Result<Option<&'static str>, RenderError> {
        let Options { rectification, own_map: settings, fetch, .. } = self.options;
        let own_map = self.driver.integrator.own_map();
        own_map.clear();
        // A fetched mean is one of the whole view ray.
        let extent = if fetch == Fetch::Exact { Extent::Maps } else { Extent::ViewRays };
        let source = frame.map_source().filter(|_| rectification != Some(Rectification::Resampled));
        Ok(match rectification {
            Some(Rectification::Resampled) if fetch == Fetch::Exact => None,
            _ if !frame.shadow().casts_shadow() => Some("rows-of-no-shadow"),
            None if source.is_none() && fetch == Fetch::Exact => {
                Some("rows-of-the-given-map: there is no source of maps")
            }
            _ => Some(match own_map.fill((frame, source), settings, rectification.is_none(), extent)? {
                Ok(()) if source.is_some() => "rows-of-a-projective-map",
                Ok(()) if rectification == Some(Rectification::Resampled) => {
                    "rows-of-a-projective-map: resampled from the given one"
                }
                Ok(()) => {
                    "rows-of-a-projective-map: resampled from the given one, there is no source of maps"
                }
                Err(NotRectified::Epipole) => "rows-of-the-given-map: the epipole is in or near the image",
                Err(NotRectified::Endless) => "rows-of-the-given-map: view rays have no ends",
            }),
        })
    }
}
