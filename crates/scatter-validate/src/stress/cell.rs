//! A cell of the stress matrix: what a technique did with an extreme.

use std::fmt;

/// The outcome.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Within its tolerance.
    Ok {
        /// The figure that was judged.
        error: f64,
    },
    /// Off by so much in a mode that promises no error, and nothing else is wrong with it.
    Unpromised {
        /// The figure that is judged elsewhere.
        error: f64,
        /// What it is held against where there is a promise.
        level: f64,
        /// Why there is none.
        why: String,
    },
    /// The technique said beforehand that it cannot.
    Unsupported(String),
    /// Bad input was refused with a message that says what is wrong.
    Refused(String),
    /// A rule that could not be tried here.
    NotRun(String),
    /// A wrong number, or a rule that was broken.
    Fail(Miss),
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Miss {
    /// Which figure is out of its limit.
    pub figure: &'static str,
    /// Its value.
    pub error: f64,
    /// What is allowed.
    pub limit: f64,
    /// The worst pixel, `[x, y]`.
    pub pixel: Option<[u32; 2]>,
    /// What there is to say besides.
    pub what: String,
}

impl Cell {
    /// A failure that has no figure.
    pub fn fault(what: impl Into<String>) -> Self {
        Self::Fail(Miss { figure: "", error: f64::NAN, limit: f64::NAN, pixel: None, what: what.into() })
    }

    /// Whether this is a wrong number or a broken rule.
    pub fn has_failed(&self) -> bool {
        matches!(self, Self::Fail(_))
    }

    /// A word or a number for a narrow column.
    pub fn short(&self) -> String {
        match self {
            Self::Ok { error } if *error == 0.0 => "ok".into(),
            Self::Ok { error } => format!("ok {error:.1e}"),
            Self::Unpromised { error, .. } => format!("~ {error:.1e}"),
            Self::Unsupported(_) => "unsupported".into(),
            Self::Refused(_) => "refused".into(),
            Self::NotRun(_) => "not run".into(),
            Self::Fail(Miss { error, .. }) if error.is_nan() => "FAIL".into(),
            Self::Fail(Miss { error, .. }) => format!("FAIL {error:.1e}"),
        }
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ok { error } => write!(f, "ok {error:.2e}"),
            Self::Unpromised { error, why, .. } => {
                write!(f, "off by {error:.2e}, no error is promised: {why}")
            }
            Self::Unsupported(reason) => write!(f, "unsupported: {reason}"),
            Self::Refused(message) => write!(f, "refused: {message}"),
            Self::NotRun(reason) => write!(f, "not run: {reason}"),
            Self::Fail(miss) => write!(f, "FAIL: {miss}"),
        }
    }
}

impl fmt::Display for Miss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { figure, error, limit, pixel, what } = self;
        let mut gap = "";
        if !figure.is_empty() {
            write!(f, "{figure} {error:.2e}, at most {limit:.1e}")?;
            gap = "; ";
        }
        if let Some([x, y]) = pixel {
            write!(f, "{gap}worst pixel ({x}, {y})")?;
            gap = ", ";
        }
        if what.is_empty() { Ok(()) } else { write!(f, "{gap}{what}") }
    }
}
