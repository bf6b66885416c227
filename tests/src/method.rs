//! What renders a world: both references, and every technique that this build lists.

use raymarch_ref::ShadowMapWalk;
use scatter::{
    OptionError, Quality, Rounding, ScatterImage, SceneFacts, TECHNIQUES, Target, Technique, VolumetricShadow,
};
use scatter_scene::RaycastTruth;

use crate::tally::Tally;
use crate::world::World;

/// What renders a world.
#[derive(Clone, Copy)]
pub enum Method {
    /// Exact visibility by the triangles.
    RaycastTruth,
    /// The exact walk through the map.
    ShadowMapWalk,
    /// A technique.
    Technique(&'static dyn Technique),
}

impl Method {
    /// The references, and every technique of [`TECHNIQUES`]: what is added there is held to the invariants.
    pub fn all() -> Vec<Self> {
        [Self::RaycastTruth, Self::ShadowMapWalk].into_iter().chain(Self::techniques()).collect()
    }

    /// Every technique of [`TECHNIQUES`].
    pub fn techniques() -> impl Iterator<Item = Self> {
        TECHNIQUES.iter().map(|&technique| Self::Technique(technique))
    }

    /// All that read the light's maps.
    pub fn all_by_maps() -> Vec<Self> {
        std::iter::once(Self::ShadowMapWalk).chain(Self::techniques()).collect()
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        match self {
            Self::RaycastTruth => "truth-raycast",
            Self::ShadowMapWalk => "truth-shadow-map",
            Self::Technique(technique) => technique.info().id,
        }
    }

    /// How far its result moves where mathematics says that it does not.
    pub fn rounding(&self) -> Rounding {
        match self {
            Self::RaycastTruth | Self::ShadowMapWalk => Rounding::F64,
            Self::Technique(technique) => technique.info().rounding,
        }
    }

    /// How many values of an image of 9 × 7 pixels may be others after a motion. Where triangles decide visibility, its
    /// rounding may carry a pixel's ray over a triangle's edge, and its first hit is then another surface: two rays of
    /// three channels.
    pub fn flips(&self) -> usize {
        if matches!(self, Self::RaycastTruth) { 6 } else { 0 }
    }

    /// The world's image at the finest level, by the settings without choices that rounding could tip over; `None` if
    /// the technique refuses the frame, which is counted.
    pub fn render(&self, world: &World, tally: &Tally) -> Option<ScatterImage> {
        let rounding = self.rounding();
        let film = Target::Quality(Quality::Film);
        self.render_for(world, film, rounding.overrides, tally)
    }

    /// The world's image by a promise or a preset. A technique that cannot give a promise refuses the frame; a preset is
    /// there for every frame. References need neither.
    pub fn render_for(
        &self,
        world: &World,
        target: Target,
        overrides: &[(&str, &str)],
        tally: &Tally,
    ) -> Option<ScatterImage> {
        let image = match self {
            Self::RaycastTruth => rendered(world, &mut RaycastTruth::new(&world.caster())),
            Self::ShadowMapWalk => rendered(world, &mut ShadowMapWalk::new()),
            Self::Technique(technique) => {
                match world.frame().with(|f| technique.configure(target, overrides, &SceneFacts::of(f))) {
                    Ok(mut instance) => rendered(world, instance.as_mut()),
                    Err(error) => Err(no_promise(target, error)),
                }
            }
        };
        tally.count(self.id(), image)
    }
}

/// The image, or why the frame is refused.
fn rendered(world: &World, technique: &mut dyn VolumetricShadow) -> Result<ScatterImage, String> {
    world.frame().with(|frame| {
        technique.supports(frame).map_err(|unsupported| unsupported.to_string())?;
        let mut image = ScatterImage::new();
        technique.render(frame, &mut image).expect("a frame that is supported is rendered");
        Ok(image)
    })
}

#[track_caller]
fn no_promise(target: Target, error: OptionError) -> String {
    assert!(matches!(target, Target::Error(_)), "a preset is no promise: {error}");
    error.to_string()
}
