//! What is put to the test: a technique at its finest setting, one with options by hand, or the reference that judges the others.

use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Estimate, Frame, NoEstimate, OptionError, Outlook, Quality, SceneFacts, Target, Technique, TechniqueInfo,
    VolumetricShadow,
};

use crate::truths::SHADOW_MAP_TRUTH;
use crate::with_options::{ByHand, WithOptions};

/// How far p99 and RMS of a technique may be off elsewhere, as a share of the unoccluded values: the film level. A
/// technique promises that level against R ≤ the unoccluded value, and its finest rung must reach it.
pub const FILM: f64 = 0.01;

/// A column of the stress matrix.
#[derive(Clone, Copy)]
pub enum Contender<'a> {
    /// Shadow-map truth: judged to rounding.
    Reference,
    /// Something that is held to rounding as well: a mutant of the reference.
    Exact(&'a dyn Technique),
    /// A technique, at the finest rung of its ladder and at the finest level.
    Technique(&'a dyn Technique),
    /// The same with options by hand over that rung's ([`WithOptions`], or a mutant of one): held to what it promises with them.
    Mode(&'a dyn Technique, &'a ByHand),
}

impl<'a> Contender<'a> {
    /// The reference and all techniques.
    pub fn all(techniques: &[&'a dyn Technique]) -> Vec<Self> {
        let techniques = techniques.iter().map(|&technique| Self::Technique(technique));
        std::iter::once(Self::Reference).chain(techniques).collect()
    }

    /// The reference and all techniques with their options by hand.
    pub fn of_modes(modes: &'a [WithOptions<'a>]) -> Vec<Self> {
        let modes = modes.iter().map(|mode| match mode.by_hand() {
            by_hand if by_hand.is_empty() => Self::Technique(mode),
            by_hand => Self::Mode(mode, by_hand),
        });
        std::iter::once(Self::Reference).chain(modes).collect()
    }

    /// Something else that is judged as this is: a mutant of it.
    pub fn judged_alike(&self, technique: &'a dyn Technique) -> Self {
        match *self {
            Self::Reference | Self::Exact(_) => Self::Exact(technique),
            Self::Technique(_) => Self::Technique(technique),
            Self::Mode(_, by_hand) => Self::Mode(technique, by_hand),
        }
    }

    /// What tools see of it.
    pub fn technique(&self) -> &'a dyn Technique {
        match self {
            Self::Reference => &ReferenceTechnique,
            Self::Exact(technique) | Self::Technique(technique) | Self::Mode(technique, _) => *technique,
        }
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        self.technique().info().id
    }

    /// Whether it is held to rounding.
    pub fn is_reference(&self) -> bool {
        matches!(self, Self::Reference | Self::Exact(_))
    }

    /// Options by hand, keys and values; none but of a mode.
    pub fn by_hand(&self) -> &'a [(&'static str, String)] {
        match self {
            Self::Mode(_, by_hand) => by_hand.options(),
            _ => &[],
        }
    }

    /// Its id, and the options by hand: `filtered-prefix with fetch=bilinear`.
    pub fn label(&self) -> String {
        match self {
            Self::Mode(technique, by_hand) => format!("{} with {by_hand}", technique.info().id),
            _ => self.id().into(),
        }
    }

    /// Why nothing holds a mode to an error on a frame with these facts; `None` where the film level holds.
    ///
    /// A technique promises that level for its finest rung. With options by hand it stands on that rung no more where one of them
    /// is the rung's own, at another value; and others may be of modes that bound no error: a technique refuses to be configured
    /// for one with such options.
    pub fn no_promise(&self, facts: &SceneFacts) -> Option<String> {
        let Self::Mode(technique, by_hand) = self else { return None };
        if let Some(key) = by_hand.off_ladder() {
            return Some(format!("{key} is not that of its finest setting"));
        }
        // All options as they are: with the by-hand ones alone it would choose others that keep the promise.
        let film = Target::Quality(Quality::Film);
        let all = self.at_finest(|finest| technique.resolved(film, finest, facts));
        let refused = all.and_then(|all| {
            let all: Vec<_> = all.iter().map(|(key, value)| (*key, value.as_str())).collect();
            technique.configure(Target::Error(FILM), &all, facts)
        });
        refused.err().map(|error| error.to_string())
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
        let film = Target::Quality(Quality::Film);
        self.at_finest(|finest| self.technique().configure(film, finest, facts))
    }

    /// Most bytes that such an instance holds on so many threads.
    pub fn most_bytes(
        &self,
        frame: &Frame<'_>,
        facts: &SceneFacts,
        threads: usize,
    ) -> Result<u64, OptionError> {
        let film = Target::Quality(Quality::Film);
        let maps = self.at_finest(|finest| self.technique().bytes_of_own_maps(film, finest, facts))?;
        Ok(self.technique().info().memory.most_bytes(frame, threads) + maps)
    }

    /// Hands over the options of the finest rung.
    fn at_finest<R>(&self, visit: impl FnOnce(&[(&str, &str)]) -> R) -> R {
        let finest = self.finest();
        let finest: Vec<_> = finest.iter().map(|(key, value)| (*key, value.as_str())).collect();
        visit(&finest)
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

#[cfg(test)]
mod tests {
    use raymarch_ref::TECHNIQUE;

    use super::*;
    use crate::stress::scenes;

    #[test]
    fn who_sets_a_rungs_own_option_promises_nothing_and_who_sets_another_one_what_the_technique_does() {
        let why = |key: &str, value: &str| {
            let by_hand = ByHand::of(&TECHNIQUE, &[(key.into(), value.into())]).unwrap();
            let modes = [WithOptions::new(&TECHNIQUE, &by_hand)];
            let contenders = Contender::of_modes(&modes);
            assert_eq!(contenders[1].label(), format!("raymarch with {key}={value}"));
            let scene = scenes::sun().unwrap();
            scene.with_frame(|frame| contenders[1].no_promise(&SceneFacts::of(frame))).unwrap()
        };
        assert_eq!(why("steps", "77").as_deref(), Some("steps is not that of its finest setting"));
        assert_eq!(why("jitter", "7"), None);
    }

    #[test]
    fn without_options_by_hand_a_mode_is_the_technique() {
        let nothing = ByHand::default();
        let modes = [WithOptions::new(&TECHNIQUE, &nothing)];
        let contenders = Contender::of_modes(&modes);
        assert!(matches!(contenders[0], Contender::Reference));
        assert!(matches!(contenders[1], Contender::Technique(_)));
        assert_eq!((contenders[1].label().as_str(), contenders[1].by_hand()), ("raymarch", &[][..]));
        assert_eq!(contenders[1].finest(), TECHNIQUE.ladder().pop().unwrap());
    }
}
