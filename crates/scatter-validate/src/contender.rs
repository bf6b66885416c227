//! What is put to the test: a technique at its finest setting, or the reference that judges the others.

use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Estimate, NoEstimate, OptionError, Outlook, Quality, SceneFacts, Target, Technique, TechniqueInfo,
    VolumetricShadow,
};

use crate::truths::SHADOW_MAP_TRUTH;

/// A column of the stress matrix.
#[derive(Clone, Copy)]
pub enum Contender<'a> {
    /// Shadow-map truth: judged to rounding.
    Reference,
    /// Something that is held to rounding as well: a mutant of the reference.
    Exact(&'a dyn Technique),
    /// A technique, at the finest rung of its ladder and at the finest level.
    Technique(&'a dyn Technique),
}

impl<'a> Contender<'a> {
    /// The reference and all techniques.
    pub fn all(techniques: &[&'a dyn Technique]) -> Vec<Self> {
        let techniques = techniques.iter().map(|&technique| Self::Technique(technique));
        std::iter::once(Self::Reference).chain(techniques).collect()
    }

    /// What tools see of it.
    pub fn technique(&self) -> &'a dyn Technique {
        match self {
            Self::Reference => &ReferenceTechnique,
            Self::Exact(technique) | Self::Technique(technique) => *technique,
        }
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        self.technique().info().id
    }

    /// Whether it is held to rounding.
    pub fn is_reference(&self) -> bool {
        !matches!(self, Self::Technique(_))
    }

    /// Whether it runs on other hardware through a driver: such ids say where after an `@`.
    pub fn is_on_device(&self) -> bool {
        self.id().contains('@')
    }

    /// The options of the finest rung.
    pub fn finest(&self) -> Vec<(&'static str, String)> {
        self.technique().ladder().pop().unwrap_or_default()
    }

    /// A new instance for a frame with these facts.
    pub fn instance(&self, facts: &SceneFacts) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let finest = self.finest();
        let finest: Vec<_> = finest.iter().map(|(key, value)| (*key, value.as_str())).collect();
        self.technique().configure(Target::Quality(Quality::Film), &finest, facts)
    }
}

/// Shadow-map truth as a technique without options, for what takes techniques.
struct ReferenceTechnique;

static REFERENCE_INFO: TechniqueInfo = TechniqueInfo::of_reference(
    SHADOW_MAP_TRUTH,
    "the exact image for the shadow map, texel by texel, f64",
    ShadowMapWalk::CAPABILITIES,
);

impl Technique for ReferenceTechnique {
    fn info(&self) -> &'static TechniqueInfo {
        &REFERENCE_INFO
    }

    fn configure(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        Ok(Box::new(ShadowMapWalk::new()))
    }

    fn resolved(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        Ok(Vec::new())
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        Vec::new()
    }

    fn estimate(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because("it is a reference"))
    }
}
