//! A technique with options by hand: one of its modes, for whatever takes techniques.

use scatter_core::{
    Estimate, LightKind, NoEstimate, OptionError, Outlook, Quality, SceneFacts, Target, Technique,
    TechniqueInfo, VolumetricShadow,
};

/// Options by hand over a technique's own choice and over its ladder.
#[derive(Clone, Copy)]
pub struct WithOptions<'a> {
    technique: &'a dyn Technique,
    by_hand: &'a ByHand,
}

/// Options by hand, each key once, all of them good for their technique.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ByHand {
    options: Vec<(&'static str, String)>,
    off_ladder: Option<&'static str>,
}

impl ByHand {
    /// Those of `options` that the technique has, of each key the last. An error if it does not take a value, or not all of them
    /// together.
    pub fn of(technique: &dyn Technique, options: &[(String, String)]) -> Result<Self, OptionError> {
        let mut own: Vec<(&'static str, String)> = Vec::new();
        for (key, value) in options {
            let Ok(info) = technique.info().option(key) else { continue };
            own.retain(|(earlier, _)| *earlier != info.key);
            own.push((info.key, value.clone()));
        }
        let finest = technique.ladder().pop().unwrap_or_default();
        let differs = |(key, value): &(&str, String)| own.iter().any(|(k, v)| k == key && v != value);
        let off_ladder = finest.iter().find(|option| differs(option)).map(|(key, _)| *key);
        let by_hand = Self { options: own, off_ladder };
        let all = by_hand.over(finest.iter().map(|(key, value)| (*key, value.as_str())));
        technique.resolved(Target::Quality(Quality::Film), &all, &FACTS)?;
        Ok(by_hand)
    }

    /// Keys and values.
    pub fn options(&self) -> &[(&'static str, String)] {
        &self.options
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.options.is_empty()
    }

    /// The first key of the technique's ladder for which another value than the finest rung's is set by hand.
    pub fn off_ladder(&self) -> Option<&'static str> {
        self.off_ladder
    }

    /// These options over others, no key twice.
    fn over<'o>(&'o self, others: impl Iterator<Item = (&'o str, &'o str)>) -> Vec<(&'o str, &'o str)> {
        let is_free = |key: &str| self.options.iter().all(|(taken, _)| *taken != key);
        let own = self.options.iter().map(|(key, value)| (*key, value.as_str()));
        others.filter(|(key, _)| is_free(key)).chain(own).collect()
    }
}

/// `fetch=bilinear basis=fourier`: as they are typed.
impl std::fmt::Display for ByHand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let options = self.options.iter().map(|(key, value)| format!("{key}={value}"));
        f.write_str(&options.collect::<Vec<_>>().join(" "))
    }
}

/// What options are tried on before there is a frame: whether a value is taken does not depend on it.
const FACTS: SceneFacts = SceneFacts {
    size: [640, 480],
    shadow_map_side: 1024,
    light: LightKind::Directional,
    grey_extinction: true,
    max_optical_depth: 1.0,
    log_density: None,
    longest_ray: 30.0,
    anisotropic: true,
    largest_g: 0.3,
    component_count: 1,
    textured: false,
    casts_shadow: true,
    translucent: false,
};

impl<'a> WithOptions<'a> {
    /// The technique with these options.
    pub fn new(technique: &'a dyn Technique, by_hand: &'a ByHand) -> Self {
        Self { technique, by_hand }
    }

    /// The options.
    pub fn by_hand(&self) -> &'a ByHand {
        self.by_hand
    }
}

impl Technique for WithOptions<'_> {
    fn info(&self) -> &'static TechniqueInfo {
        self.technique.info()
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        self.technique.configure(target, &self.by_hand.over(overrides.iter().copied()), facts)
    }

    fn resolved(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        self.technique.resolved(target, &self.by_hand.over(overrides.iter().copied()), facts)
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        let mut rungs = self.technique.ladder();
        if rungs.is_empty() {
            rungs.push(Vec::new());
        }
        for rung in &mut rungs {
            rung.retain(|(key, _)| self.by_hand.options.iter().all(|(taken, _)| taken != key));
            rung.extend(self.by_hand.options.iter().cloned());
        }
        rungs
    }

    fn estimate(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        self.technique.estimate(target, &self.by_hand.over(overrides.iter().copied()), outlook)
    }

    fn bytes_of_own_maps(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<u64, OptionError> {
        self.technique.bytes_of_own_maps(target, &self.by_hand.over(overrides.iter().copied()), facts)
    }
}

#[cfg(test)]
mod tests {
    use raymarch_ref::TECHNIQUE;

    use super::*;

    const FILM: Target = Target::Quality(Quality::Film);

    fn by_hand(options: &[(&str, &str)]) -> Result<ByHand, OptionError> {
        let options: Vec<_> =
            options.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        ByHand::of(&TECHNIQUE, &options)
    }

    /// The values of these keys among resolved options.
    fn values(options: &[(&'static str, String)], keys: [&str; 2]) -> [String; 2] {
        keys.map(|key| options.iter().find(|(own, _)| *own == key).expect("an option").1.clone())
    }

    #[test]
    fn an_option_by_hand_replaces_the_rungs_own_and_is_given_once() {
        let options = by_hand(&[("jitter", "7"), ("steps", "70"), ("steps", "77")]).unwrap();
        assert_eq!(options.to_string(), "jitter=7 steps=77");
        let marcher = WithOptions::new(&TECHNIQUE, &options);
        assert_eq!(marcher.ladder().len(), TECHNIQUE.ladder().len());
        for rung in marcher.ladder() {
            assert_eq!(rung, [("jitter", "7".to_string()), ("steps", "77".to_string())]);
        }
        // Whatever a caller gives, in the wrapper's own words or in others.
        for overrides in [&[][..], &[("steps", "16")], &[("jitter", "off"), ("steps", "77")]] {
            let resolved = marcher.resolved(FILM, overrides, &FACTS).unwrap();
            assert_eq!(values(&resolved, ["jitter", "steps"]), ["7", "77"]);
        }
    }

    #[test]
    fn what_is_not_set_by_hand_stays_the_techniques_choice_and_the_callers() {
        let options = by_hand(&[("jitter", "7")]).unwrap();
        let marcher = WithOptions::new(&TECHNIQUE, &options);
        let plain = TECHNIQUE.resolved(FILM, &[], &FACTS).unwrap();
        let with = marcher.resolved(FILM, &[], &FACTS).unwrap();
        assert_eq!(
            values(&with, ["steps", "jitter"]),
            [values(&plain, ["steps", "jitter"])[0].as_str(), "7"]
        );
        let with = marcher.resolved(FILM, &[("steps", "48")], &FACTS).unwrap();
        assert_eq!(values(&with, ["steps", "jitter"]), ["48", "7"]);
    }

    #[test]
    fn another_techniques_options_are_left_out_and_wrong_values_are_errors() {
        assert!(by_hand(&[("fetch", "bilinear")]).unwrap().is_empty());
        let error = by_hand(&[("steps", "many")]).unwrap_err().to_string();
        assert!(error.starts_with("raymarch: option steps is 'many'; give"), "{error}");
    }

    #[test]
    fn only_another_value_of_a_rungs_key_leaves_the_ladder() {
        assert_eq!(by_hand(&[("jitter", "7")]).unwrap().off_ladder(), None);
        assert_eq!(by_hand(&[("steps", "77")]).unwrap().off_ladder(), Some("steps"));
        let finest = TECHNIQUE.ladder().pop().unwrap()[0].1.clone();
        assert_eq!(by_hand(&[("steps", &finest)]).unwrap().off_ladder(), None);
    }
}
