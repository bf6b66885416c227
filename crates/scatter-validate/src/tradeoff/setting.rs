//! The settings of a technique that a sweep tries, found through its trait alone.

use std::fmt;

use scatter_core::{Quality, Target, Technique};

/// What a technique is configured with.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Why it is tried.
    pub source: Source,
    /// What the technique derives its options from.
    pub target: Target,
    /// Options by hand, over its own choice.
    pub overrides: Vec<(String, String)>,
}

/// Where a setting comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// The preset of a quality level.
    Quality,
    /// A promised error, falling.
    Error,
    /// The technique's own ladder, from the cheapest to the finest.
    Ladder,
    /// Found by the search for the cheapest step count that reaches a level.
    Search,
}

/// The coarsest promised error: that of the coarsest level.
const COARSEST_ERROR: f64 = 0.10;
/// The finest promised error is above this: a twentieth of the finest level, where nobody sees a difference.
const FINEST_ERROR: f64 = 0.0005;

/// All settings to try, each source's from the cheapest to the finest: the quality levels, promised errors that fall by
/// halves, and the technique's own ladder. `by_hand` holds options for all of them; rungs that would set the same
/// options are left out.
pub fn ladder(technique: &dyn Technique, by_hand: &[(String, String)]) -> Vec<Setting> {
    let setting = |source, target, overrides: Vec<(String, String)>| Setting { source, target, overrides };
    let levels = Quality::ALL.map(|level| setting(Source::Quality, Target::Quality(level), by_hand.to_vec()));
    let errors = std::iter::successors(Some(COARSEST_ERROR), |error| Some(0.5 * error))
        .take_while(|&error| error >= FINEST_ERROR)
        .map(|error| setting(Source::Error, Target::Error(error), by_hand.to_vec()));
    let is_free = |key: &str| by_hand.iter().all(|(taken, _)| taken != key);
    let own =
        technique.ladder().into_iter().filter(|rung| rung.iter().all(|(key, _)| is_free(key))).map(|rung| {
            let rung = rung.into_iter().map(|(key, value)| (key.to_string(), value));
            let overrides = by_hand.iter().cloned().chain(rung).collect();
            setting(Source::Ladder, Target::Quality(Quality::default()), overrides)
        });
    levels.into_iter().chain(errors).chain(own).collect()
}

/// `game`, `error 2.5 %`, `steps=256`: what a user would ask for to get it.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let target = match (self.source, self.target) {
            (Source::Quality, Target::Quality(level)) => Some(level.to_string()),
            // Percent to the digits that halves have.
            (_, Target::Error(error)) => Some(format!("error {} %", (1e8 * error).round() / 1e6)),
            _ => None,
        };
        let options = self.overrides.iter().map(|(key, value)| format!("{key}={value}"));
        f.write_str(&target.into_iter().chain(options).collect::<Vec<_>>().join(" "))
    }
}

#[cfg(test)]
mod tests {
    use raymarch_ref::TECHNIQUE;

    use super::*;

    fn of(source: Source, settings: &[Setting]) -> Vec<&Setting> {
        settings.iter().filter(|setting| setting.source == source).collect()
    }

    #[test]
    fn every_source_goes_from_the_cheapest_to_the_finest() {
        let settings = ladder(&TECHNIQUE, &[]);
        let levels: Vec<String> = of(Source::Quality, &settings).iter().map(|s| s.to_string()).collect();
        assert_eq!(levels, ["preview", "game", "film"]);
        let errors: Vec<f64> = of(Source::Error, &settings)
            .iter()
            .map(|s| if let Target::Error(error) = s.target { error } else { f64::NAN })
            .collect();
        assert_eq!(errors.len(), 8);
        assert_eq!((errors[0], errors[1], errors[2]), (0.1, 0.05, 0.025));
        let promises = of(Source::Error, &settings);
        assert_eq!(
            (promises[0].to_string().as_str(), promises[3].to_string().as_str()),
            ("error 10 %", "error 1.25 %")
        );
        assert!(errors[7] >= 0.0005 && errors[7] < 0.001, "{errors:?}");
        let own = of(Source::Ladder, &settings);
        assert_eq!(own.len(), TECHNIQUE.ladder().len());
        assert_eq!((own[0].to_string().as_str(), own[1].to_string().as_str()), ("steps=8", "steps=16"));
    }

    #[test]
    fn an_option_by_hand_stands_in_every_setting_and_replaces_the_rungs_that_would_set_it() {
        let hand = |key: &str, value: &str| [(key.to_string(), value.to_string())];
        let jittered = ladder(&TECHNIQUE, &hand("jitter", "on"));
        assert!(jittered.iter().all(|setting| setting.overrides.contains(&("jitter".into(), "on".into()))));
        assert_eq!(of(Source::Ladder, &jittered).len(), TECHNIQUE.ladder().len());
        let fixed = ladder(&TECHNIQUE, &hand("steps", "77"));
        assert!(of(Source::Ladder, &fixed).is_empty());
        assert_eq!(fixed[0].to_string(), "preview steps=77");
    }
}
