//! The traits: what a technique does for an engine, and what it tells to tools.

use crate::frame::Frame;
use crate::quality::Target;
use crate::render_error::{RenderError, Unsupported};
use crate::render_stats::RenderStats;
use crate::scatter_image::ScatterImage;
use crate::scene_facts::SceneFacts;

/// A technique that computes the shadowed single scattering of a whole frame.
///
/// Frame-level and object-safe, because epipolar techniques and light volumes are not per-ray. All buffers live in
/// the technique and are reused.
pub trait VolumetricShadow: Send {
    /// Kebab-case id: the crate's name, the report's row, the `--method` on the command line.
    fn id(&self) -> &'static str;

    /// Says before any work which assumption this frame breaks.
    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported>;

    /// Fills `out` with the in-scattered radiance and the transmittance of every pixel, whatever `out` held before.
    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError>;
}

/// A technique as tools see it: described, configured, swept.
pub trait Technique: Sync {
    /// What it is.
    fn info(&self) -> &'static TechniqueInfo;

    /// An instance for a target error on a frame with these facts, with `overrides` (`key`, `value`) over its own
    /// choice of options.
    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError>;

    /// Settings from the cheapest to the finest, each a list of overrides: the rungs of a trade-off.
    fn ladder(&self) -> Vec<Vec<(&'static str, String)>>;
}

/// What a technique is and takes.
#[derive(Debug, Clone)]
pub struct TechniqueInfo {
    /// Its id, as [`VolumetricShadow::id`].
    pub id: &'static str,
    /// One line: what it does.
    pub summary: &'static str,
    /// Where it comes from.
    pub paper: &'static str,
    /// Lights that it renders.
    pub lights: &'static [&'static str],
    /// Media that it renders.
    pub media: &'static [&'static str],
    /// Cameras that it renders.
    pub cameras: &'static [&'static str],
    /// What it cannot do, a sentence each.
    pub cannot: &'static [&'static str],
    /// Its options.
    pub options: &'static [OptionInfo],
}

/// One option of a technique.
#[derive(Debug, Clone, Copy)]
pub struct OptionInfo {
    /// Its key for `--set key=value`.
    pub key: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// Unit of its value, `""` for none.
    pub unit: &'static str,
    /// Accepted values, in words.
    pub range: &'static str,
    /// The value of `Default`, printed from it.
    pub default: fn() -> String,
}

/// An option that a technique does not take.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// No such key.
    #[error("{technique} has no option '{key}'; it has: {known}")]
    UnknownKey {
        /// The technique.
        technique: &'static str,
        /// What was asked for.
        key: String,
        /// All keys.
        known: String,
    },
    /// A value that does not parse or lies outside of the range.
    #[error("{technique}: option {key} is '{value}'; give {range}")]
    BadValue {
        /// The technique.
        technique: &'static str,
        /// The option.
        key: &'static str,
        /// What was given.
        value: String,
        /// What is accepted.
        range: &'static str,
    },
}

impl TechniqueInfo {
    /// The option with that key, or the error that lists all keys.
    pub fn option(&self, key: &str) -> Result<&'static OptionInfo, OptionError> {
        self.options.iter().find(|option| option.key == key).ok_or_else(|| OptionError::UnknownKey {
            technique: self.id,
            key: key.to_string(),
            known: self.options.iter().map(|option| option.key).collect::<Vec<_>>().join(", "),
        })
    }

    /// A value of that option, parsed and accepted, or the error that names key, value and range.
    pub fn parse<T: std::str::FromStr>(
        &self,
        key: &str,
        value: &str,
        accept: impl Fn(&T) -> bool,
    ) -> Result<T, OptionError> {
        let option = self.option(key)?;
        value.trim().parse().ok().filter(|parsed| accept(parsed)).ok_or_else(|| OptionError::BadValue {
            technique: self.id,
            key: option.key,
            value: value.to_string(),
            range: option.range,
        })
    }
}
