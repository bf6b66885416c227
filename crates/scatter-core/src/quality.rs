//! Quality levels: the errors at which techniques are compared (MODEL.md, Error figures).

use std::fmt;
use std::str::FromStr;

/// An image reaches a level when p99 and relative RMSE against shadow-map truth are both within it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Quality {
    /// 10 %: a shaft is where it belongs.
    Preview,
    /// 3 %: banding and missing shafts are hard to see.
    #[default]
    Game,
    /// 1 %, the contrast that the eye sees (Weber).
    Film,
}

impl Quality {
    /// All levels, from the coarsest to the finest.
    pub const ALL: [Self; 3] = [Self::Preview, Self::Game, Self::Film];

    /// The largest p99 and relative RMSE of the level, as a fraction.
    pub fn error(self) -> f64 {
        match self {
            Self::Preview => 0.10,
            Self::Game => 0.03,
            Self::Film => 0.01,
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Preview => "preview",
            Self::Game => "game",
            Self::Film => "film",
        })
    }
}

impl FromStr for Quality {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|level| level.to_string() == text)
            .ok_or_else(|| format!("no quality level '{text}'; give preview, game or film"))
    }
}

/// What a technique is to be configured for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// A level: a preset that `validate` checks.
    Quality(Quality),
    /// A promise: `|T − R| ≤ ε` times the pixel's unoccluded value, derived. ε in (0, 1).
    Error(f64),
}
