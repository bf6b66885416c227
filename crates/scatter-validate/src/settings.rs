//! How techniques are run on shots: what the matrix, the baseline's search and the sweeps share.

use scatter_core::{Quality, Technique};
use scatter_scene::{MapResolution, RasterDevice};

/// Options by hand or found: keys and values.
pub(crate) type Options = Vec<(String, String)>;

/// How techniques are run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The level that every technique is configured for.
    pub quality: Quality,
    /// Options by hand, over the level's choice; each technique takes those that it knows.
    pub overrides: Vec<(String, String)>,
    /// Texels of each light's shadow maps.
    pub resolution: MapResolution,
    /// Draws the maps; rays make them where there is none.
    pub raster: Option<RasterDevice>,
    /// Timed runs.
    pub repeat: u32,
    /// Threads of the pool that all this runs in (for the rows).
    pub threads: usize,
}

impl Settings {
    /// The options by hand that the technique has.
    pub(crate) fn by_hand(&self, technique: &dyn Technique) -> Options {
        let has = |key: &str| technique.info().option(key).is_ok();
        self.overrides.iter().filter(|(key, _)| has(key)).cloned().collect()
    }
}

/// Options as [`Technique::configure`] takes them.
pub(crate) fn pairs(options: &[(String, String)]) -> Vec<(&str, &str)> {
    options.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}
