//! The traits: what a technique does for an engine, and what it tells to tools.

use crate::capabilities::Capabilities;
use crate::estimate::{Estimate, NoEstimate, Outlook};
use crate::frame::Frame;
use crate::option_table::{NO_OPTIONS, OptionError, OptionInfo, OptionList, OptionTable};
use crate::quality::Target;
use crate::render_error::{RenderError, Unsupported};
use crate::render_stats::RenderStats;
use crate::scatter_image::ScatterImage;
use crate::scene_facts::SceneFacts;
use crate::translucent::{Translucent, TranslucentLayer};
use crate::translucent_capture::TranslucentCapture;

/// A technique that computes the shadowed single scattering of a whole frame.
///
/// Frame-level and object-safe, because epipolar techniques and light volumes are not per-ray. All buffers live in
/// the technique and are reused.
pub trait VolumetricShadow: Send {
    /// Kebab-case id: the crate's name, the report's row, the `--method` on the command line.
    fn id(&self) -> &'static str;

    /// What this instance renders, as it is configured.
    fn capabilities(&self) -> Capabilities;

    /// Says before any work what of this frame [`Self::capabilities`] lacks, and what to give instead.
    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.capabilities().check(frame)
    }

    /// Fills `out` with the in-scattered radiance and the transmittance of every pixel, whatever `out` held before.
    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError>;
}

/// A technique as tools see it: described, configured, swept. Whoever has options implements [`Configurable`], from
/// which this follows.
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

    /// The values of all options that [`Self::configure`] gives such an instance, as text that it takes: key, value.
    fn resolved(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError>;

    /// Settings from the cheapest to the finest, each a list of overrides: the rungs of a trade-off.
    fn ladder(&self) -> Vec<Vec<(&'static str, String)>>;

    /// What it predicts of the instance that [`Self::configure`] gives for the same target and overrides, before anything is
    /// rendered: O(1) beside what the outlook holds. A technique, or a setting, for which nobody has a model says so.
    fn estimate(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate>;

    /// Most bytes that such an instance holds beyond [`TechniqueInfo::memory`], in maps of its own whose size is an option; 0 where
    /// no option is such a size.
    fn bytes_of_own_maps(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<u64, OptionError> {
        Ok(0)
    }
}

/// A technique with a table of options: all that it says about them.
pub trait Configurable: Sync {
    /// Its options; `Default` is the preset of the default level.
    type Options: Default + 'static;

    /// What it is; `options` is [`Self::table`].
    fn info(&self) -> &'static TechniqueInfo;

    /// Its options, declared once.
    fn table(&self) -> &'static OptionTable<Self::Options>;

    /// Its choice for a target error on a frame with these facts, before `overrides` are set over it: a choice may rest
    /// on what the caller sets anyway.
    fn choose(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Self::Options, OptionError>;

    /// An instance with these options, all of them in their ranges.
    fn instance(&self, options: Self::Options) -> Box<dyn VolumetricShadow>;

    /// Keys of a trade-off's settings and their values, from the cheapest to the finest.
    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>>;

    /// What these options cost and are off by on a frame, as [`Technique::estimate`].
    fn predict(&self, options: &Self::Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate>;

    /// What these options may hold in maps of its own, as [`Technique::bytes_of_own_maps`].
    fn bytes_of_own_maps(&self, _options: &Self::Options) -> u64 {
        0
    }
}

impl<T: Configurable> Technique for T {
    fn info(&self) -> &'static TechniqueInfo {
        Configurable::info(self)
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        Ok(self.instance(options_of(self, target, overrides, facts)?))
    }

    fn resolved(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        Ok(self.table().values(&options_of(self, target, overrides, facts)?))
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        let text = |(key, value): (&'static str, f64)| (key, value.to_string());
        self.rungs().into_iter().map(|rung| rung.into_iter().map(text).collect()).collect()
    }

    fn estimate(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        let options = options_of(self, target, overrides, &outlook.sample.facts)
            .map_err(|error| NoEstimate::because(error.to_string()))?;
        self.predict(&options, outlook)
    }

    fn bytes_of_own_maps(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<u64, OptionError> {
        Ok(Configurable::bytes_of_own_maps(self, &options_of(self, target, overrides, facts)?))
    }
}

fn options_of<T: Configurable>(
    technique: &T,
    target: Target,
    overrides: &[(&str, &str)],
    facts: &SceneFacts,
) -> Result<T::Options, OptionError> {
    let mut options = technique.choose(target, overrides, facts)?;
    technique.table().set_all(&mut options, overrides)?;
    technique.table().check(&options)?;
    Ok(options)
}

/// What a technique is and takes.
#[derive(Clone, Copy)]
pub struct TechniqueInfo {
    /// Its id, as [`VolumetricShadow::id`].
    pub id: &'static str,
    /// One line: what it does.
    pub summary: &'static str,
    /// Where it comes from.
    pub paper: &'static str,
    /// What the image of a frame that it renders may lack, `""` for nothing.
    pub misses: &'static str,
    /// What an instance with the default options renders.
    pub capabilities: Capabilities,
    /// How far a result moves under changes that mean nothing.
    pub rounding: Rounding,
    /// How much it holds at the most, whatever the frame and its options are; but for maps of its own, whose size is an option
    /// ([`Technique::bytes_of_own_maps`]).
    pub memory: MemoryBound,
    /// Its options.
    pub options: &'static dyn OptionList,
}

/// Most bytes that a technique holds, its output not counted: they follow from the picture, the map and the translucent
/// occluders, and from nothing else that a frame may have in it. For images of up to 16,384 pixels a side.
///
/// What a technique that renders translucent occluders holds of them is the same for all: [`Self::TRANSLUCENT_TEXEL`] and
/// [`Self::TRANSLUCENT_SEGMENT`] of captured ones; of a source, whose segments nobody knows before they are captured, the limit
/// of a capture and curve maps of [`Self::LARGEST_CURVES`] texels a side, a layer each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryBound {
    /// Bytes a thread, however small the frame is.
    pub fixed: u64,
    /// Bytes a pixel and thread.
    pub a_pixel: u64,
    /// Bytes a texel of the shadow map and of the light's texture.
    pub a_texel: u64,
}

impl MemoryBound {
    /// Bytes a texel of translucent layers: a curve of 16 nodes, or of 32 slices and its range, and what finds it.
    pub const TRANSLUCENT_TEXEL: u64 = 160;
    /// Bytes a segment: two nodes in a list that has grown to twice its size, and a sorted copy of one band of rows.
    pub const TRANSLUCENT_SEGMENT: u64 = 64;
    /// Most texels along a side of a map that a technique lays around a source's occluders.
    pub const LARGEST_CURVES: u64 = 2048;

    /// The bound of a frame on so many threads.
    pub fn most_bytes(&self, frame: &Frame<'_>, threads: usize) -> u64 {
        let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        let maps = frame.shadow().layers().map(|layer| area(layer.projection().size())).sum::<u64>();
        let texture = frame.texture().map_or(0, |texture| area(texture.projection().size()));
        let a_thread = self.fixed + self.a_pixel * area(frame.size());
        let translucent = match frame.translucent() {
            None => 0,
            Some(Translucent::Captured(layers)) => {
                let of = |layer: &TranslucentLayer<'_>| {
                    Self::TRANSLUCENT_TEXEL * area(layer.projection().size())
                        + Self::TRANSLUCENT_SEGMENT * layer.segments().len() as u64
                };
                layers.iter().map(of).sum()
            }
            Some(Translucent::Source(_)) => {
                let a_layer =
                    Self::TRANSLUCENT_TEXEL * Self::LARGEST_CURVES.pow(2) + TranslucentCapture::DEFAULT_LIMIT;
                // Around a lamp without a map there are six faces.
                a_layer * (frame.shadow().layer_count() as u64).max(6)
            }
        };
        a_thread * threads.max(1) as u64 + self.a_texel * (maps + texture) + translucent
    }
}

/// How far a technique's result may move where mathematics says that it does not: what property tests hold it to.
///
/// Shares are of the pixel's unoccluded value (a spot's: without its cone).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Settings without choices that rounding could tip over: no measured spacing, no refinement by a threshold.
    pub overrides: &'static [(&'static str, &'static str)],
    /// Largest change where the strength, the scattering at fixed extinction, or the unit of length is scaled.
    pub scaled: f64,
    /// Largest change where scene, camera and light are moved together or mirrored.
    pub moved: f64,
    /// Largest difference between the image of two lights in one place and the sum of their images, at any options.
    pub added: f64,
    /// Largest excess over the closed form where nothing shadows.
    pub lit: f64,
    /// Why the numbers are what they are.
    pub derivation: &'static str,
}

impl Rounding {
    /// Of an exact technique in f64 that writes f32 pixels.
    pub const F64: Self = Self {
        overrides: &[],
        scaled: 2e-6,
        moved: 2e-6,
        added: 2e-6,
        lit: 2e-6,
        derivation: "f64 throughout; pixels are written and depths are read in f32: 2⁻²³ of a pixel, and 2⁻²⁴ of \
                     a ray's length, which at most doubles that. Ten times as much is allowed",
    };
}

impl TechniqueInfo {
    /// Of a renderer without options, exact to f64's rounding: references and tests.
    pub const fn of_reference(id: &'static str, summary: &'static str, capabilities: Capabilities) -> Self {
        Self {
            id,
            summary,
            paper: "",
            misses: "",
            capabilities,
            rounding: Rounding::F64,
            memory: MemoryBound { fixed: 1 << 20, a_pixel: 32, a_texel: 16 },
            options: &NO_OPTIONS,
        }
    }

    /// The option with that key, or the error that lists all keys.
    pub fn option(&self, key: &str) -> Result<OptionInfo, OptionError> {
        self.options.find(key)
    }

    /// All options in order.
    pub fn options(&self) -> Vec<OptionInfo> {
        self.options.list()
    }
}
