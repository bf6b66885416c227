//! What is put to the test: a technique at its finest setting, or the reference that judges the others.

use raymarch_ref::ShadowMapWalk;
use scatter_core::{OptionError, Quality, SceneFacts, Target, Technique, VolumetricShadow};

use crate::matrix::SHADOW_MAP_TRUTH;

/// A column of the stress matrix.
#[derive(Clone, Copy)]
pub enum Contender<'a> {
    /// Shadow-map truth: judged to rounding.
    Reference,
    /// A technique, at the finest rung of its ladder and at the finest level.
    Technique(&'a dyn Technique),
}

impl<'a> Contender<'a> {
    /// The reference and all techniques.
    pub fn all(techniques: &[&'a dyn Technique]) -> Vec<Self> {
        let techniques = techniques.iter().map(|&technique| Self::Technique(technique));
        std::iter::once(Self::Reference).chain(techniques).collect()
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        match self {
            Self::Reference => SHADOW_MAP_TRUTH,
            Self::Technique(technique) => technique.info().id,
        }
    }

    /// Whether it is held to rounding.
    pub fn is_reference(&self) -> bool {
        matches!(self, Self::Reference)
    }

    /// The options of the finest rung.
    pub fn finest(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Reference => Vec::new(),
            Self::Technique(technique) => technique.ladder().pop().unwrap_or_default(),
        }
    }

    /// A new instance for a frame with these facts.
    pub fn instance(&self, facts: &SceneFacts) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        match self {
            Self::Reference => Ok(Box::new(ShadowMapWalk::new())),
            Self::Technique(technique) => {
                let finest = self.finest();
                let finest: Vec<_> = finest.iter().map(|(key, value)| (*key, value.as_str())).collect();
                technique.configure(Target::Quality(Quality::Film), &finest, facts)
            }
        }
    }
}
