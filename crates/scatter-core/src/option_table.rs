//! A technique's options, declared once: parsing, errors, defaults, listings and resolved values follow from the table.
//!
//! ```
//! use scatter_core::{Choice, OptionRange, OptionTable, option_row};
//!
//! #[derive(Clone, Copy, PartialEq)]
//! enum Filter {
//!     Box,
//!     Tent,
//! }
//!
//! impl Choice for Filter {
//!     fn names() -> Vec<(&'static str, Self)> {
//!         vec![("box", Self::Box), ("tent", Self::Tent)]
//!     }
//! }
//!
//! struct Options {
//!     samples: u32,
//!     filter: Filter,
//! }
//!
//! static TABLE: OptionTable<Options> = OptionTable {
//!     technique: "example",
//!     rows: &[
//!         option_row!("samples", "samples a ray", "", OptionRange::Whole([1, 64]), samples as u32),
//!         option_row!("filter", "how samples are weighted", Filter, filter),
//!     ],
//! };
//!
//! let mut options = Options { samples: 8, filter: Filter::Box };
//! TABLE.set(&mut options, "filter", "tent").unwrap();
//! assert_eq!(TABLE.values(&options), [("samples", "8".to_string()), ("filter", "tent".to_string())]);
//! let error = TABLE.set(&mut options, "samples", "65").unwrap_err();
//! assert_eq!(error.to_string(), "example: option samples is '65'; give an integer from 1 to 64");
//! ```

use std::fmt;

use crate::kinds::either;

/// The options `O` of one technique, in the order in which they are listed.
pub struct OptionTable<O: 'static> {
    /// The technique's id, which errors name.
    pub technique: &'static str,
    /// A row for each option.
    pub rows: &'static [OptionRow<O>],
}

/// One option of a technique.
pub struct OptionRow<O> {
    /// Its key for `--set key=value`.
    pub key: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// Unit of its value, `""` for none.
    pub unit: &'static str,
    /// Accepted values.
    pub range: OptionRange,
    /// Its value.
    pub get: fn(&O) -> OptionValue,
    /// Sets it; the value is in the range.
    pub set: fn(&mut O, OptionValue),
}

/// An [`OptionRow`], for a number: key, summary, unit, range, field `as` type; for a [`Choice`]: key, summary, type,
/// field; for anything else: key, summary, unit, range, get and set as closures.
#[macro_export]
macro_rules! option_row {
    ($key:literal, $summary:literal, $unit:literal, $range:expr, $($field:ident).+ as $number:ty) => {
        $crate::OptionRow {
            key: $key,
            summary: $summary,
            unit: $unit,
            range: $range,
            get: |options| options.$($field).+.into(),
            set: |options, value| options.$($field).+ = value.number() as $number,
        }
    };
    ($key:literal, $summary:literal, $choice:ty, $($field:ident).+) => {
        $crate::OptionRow {
            key: $key,
            summary: $summary,
            unit: "",
            range: $crate::OptionRange::choice::<$choice>(),
            get: |options| options.$($field).+.into(),
            set: |options, value| options.$($field).+ = value.choice(),
        }
    };
    ($key:literal, $summary:literal, $unit:literal, $range:expr, $get:expr, $set:expr) => {
        $crate::OptionRow { key: $key, summary: $summary, unit: $unit, range: $range, get: $get, set: $set }
    };
}

/// The values that an option takes.
#[derive(Debug, Clone, Copy)]
pub enum OptionRange {
    /// A number from the first to the second, both included.
    Real([f64; 2]),
    /// An integer from the first to the second, both included; at most 2⁵³.
    Whole([u64; 2]),
    /// One of these words, or a number.
    WordOrReal(&'static [&'static str], [f64; 2]),
    /// One of these words, or an integer.
    WordOrWhole(&'static [&'static str], [u64; 2]),
    /// One of the words that the function lists: [`Self::choice`].
    Choice(fn() -> Vec<&'static str>),
    /// Columns, rows and slices of a grid as `WxHxD`.
    Grid {
        /// Most along each axis, at least 1.
        most: u32,
        /// Most cells in all.
        cells: u64,
    },
}

/// The value of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionValue {
    /// A number; integers too, exact to 2⁵³.
    Number(f64),
    /// A word of the option's range.
    Word(&'static str),
    /// Columns, rows and slices of a grid.
    Grid([u32; 3]),
}

/// An enumeration that is an option: each value by its name. An [`Option`] of one has `auto` for `None`.
pub trait Choice: Copy + PartialEq + 'static {
    /// All names with their values; not empty.
    fn names() -> Vec<(&'static str, Self)>;
}

impl<T: Choice> Choice for Option<T> {
    fn names() -> Vec<(&'static str, Self)> {
        let named = T::names().into_iter().map(|(name, value)| (name, Some(value)));
        std::iter::once(("auto", None)).chain(named).collect()
    }
}

/// One option as tools list it.
#[derive(Debug, Clone, Copy)]
pub struct OptionInfo {
    /// Its key for `--set key=value`.
    pub key: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// Unit of its value, `""` for none.
    pub unit: &'static str,
    /// Accepted values.
    pub range: OptionRange,
    /// The value of `Default`.
    pub default: OptionValue,
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
        range: String,
    },
}

impl<O> OptionTable<O> {
    /// Sets one option from text; an error that names key, value and range, or all keys.
    pub fn set(&self, options: &mut O, key: &str, text: &str) -> Result<(), OptionError> {
        let row = self.row(key)?;
        let value = row.range.parse(text).ok_or_else(|| self.bad_value(row, text.into()))?;
        (row.set)(options, value);
        Ok(())
    }

    /// Sets several options, one after the other: the last one wins.
    pub fn set_all(&self, options: &mut O, overrides: &[(&str, &str)]) -> Result<(), OptionError> {
        overrides.iter().try_for_each(|(key, value)| self.set(options, key, value))
    }

    /// An error if the caller sets an option to anything but these values: what a promise needs. `range` says which and why.
    pub fn require(
        &self,
        overrides: &[(&str, &str)],
        key: &'static str,
        allowed: &[&str],
        range: &str,
    ) -> Result<(), OptionError> {
        match overrides.iter().rfind(|(own, _)| *own == key) {
            Some(&(_, value)) if !allowed.contains(&value) => Err(OptionError::BadValue {
                technique: self.technique,
                key,
                value: value.into(),
                range: range.into(),
            }),
            _ => Ok(()),
        }
    }

    /// Keys and values of all options as text that [`Self::set`] takes.
    pub fn values(&self, options: &O) -> Vec<(&'static str, String)> {
        self.rows.iter().map(|row| (row.key, (row.get)(options).to_string())).collect()
    }

    /// Whether every option lies in its range, whoever filled them in; otherwise the error for the first that does not.
    pub fn check(&self, options: &O) -> Result<(), OptionError> {
        let bad = |row: &&OptionRow<O>| !row.range.contains((row.get)(options));
        match self.rows.iter().find(bad) {
            None => Ok(()),
            Some(row) => Err(self.bad_value(row, (row.get)(options).to_string())),
        }
    }

    fn row(&self, key: &str) -> Result<&'static OptionRow<O>, OptionError> {
        self.rows.iter().find(|row| row.key == key).ok_or_else(|| OptionError::UnknownKey {
            technique: self.technique,
            key: key.into(),
            known: self.rows.iter().map(|row| row.key).collect::<Vec<_>>().join(", "),
        })
    }

    fn bad_value(&self, row: &OptionRow<O>, value: String) -> OptionError {
        let unit = if row.unit.is_empty() { String::new() } else { format!(" [{}]", row.unit) };
        let (technique, key, range) = (self.technique, row.key, format!("{}{unit}", row.range));
        OptionError::BadValue { technique, key, value, range }
    }
}

/// A table of options of any type, as tools see it.
pub trait OptionList: Sync {
    /// All options in order, each with the default.
    fn list(&self) -> Vec<OptionInfo>;

    /// The option with that key, or the error that lists all keys.
    fn find(&self, key: &str) -> Result<OptionInfo, OptionError>;
}

impl<O: Default + 'static> OptionList for OptionTable<O> {
    fn list(&self) -> Vec<OptionInfo> {
        let default = O::default();
        self.rows.iter().map(|row| row.info(&default)).collect()
    }

    fn find(&self, key: &str) -> Result<OptionInfo, OptionError> {
        Ok(self.row(key)?.info(&O::default()))
    }
}

/// The options of what has none.
pub static NO_OPTIONS: OptionTable<()> = OptionTable { technique: "it", rows: &[] };

impl<O> OptionRow<O> {
    fn info(&self, default: &O) -> OptionInfo {
        let &Self { key, summary, unit, range, get, set: _ } = self;
        OptionInfo { key, summary, unit, range, default: get(default) }
    }
}

impl OptionRange {
    /// The names of an enumeration.
    pub const fn choice<T: Choice>() -> Self {
        Self::Choice(|| T::names().into_iter().map(|(name, _)| name).collect())
    }

    /// The value that a text means; `None` if it is none of the range.
    pub fn parse(&self, text: &str) -> Option<OptionValue> {
        let text = text.trim();
        let word = self.words().into_iter().find(|word| *word == text).map(OptionValue::Word);
        word.or_else(|| {
            // Integers are parsed as such: "3.0" and "1e3" are none.
            let number = match self {
                Self::Real(_) | Self::WordOrReal(..) => text.parse::<f64>().ok()?,
                Self::Whole(_) | Self::WordOrWhole(..) => text.parse::<u64>().ok()? as f64,
                Self::Choice(_) => return None,
                Self::Grid { .. } => {
                    return parse_grid(text).map(OptionValue::Grid).filter(|value| self.contains(*value));
                }
            };
            Some(OptionValue::Number(number)).filter(|value| self.contains(*value))
        })
    }

    /// Whether a value is one of the range.
    pub fn contains(&self, value: OptionValue) -> bool {
        match (value, self) {
            (OptionValue::Word(word), _) => self.words().contains(&word),
            (OptionValue::Number(number), &(Self::Real([from, to]) | Self::WordOrReal(_, [from, to]))) => {
                number >= from && number <= to
            }
            (OptionValue::Number(number), &(Self::Whole([from, to]) | Self::WordOrWhole(_, [from, to]))) => {
                number >= from as f64 && number <= to as f64 && number.fract() == 0.0
            }
            (OptionValue::Grid(sides), &Self::Grid { most, cells }) => {
                let count: u64 = sides.iter().map(|&side| u64::from(side)).product();
                sides.iter().all(|side| (1..=most).contains(side)) && count <= cells
            }
            (OptionValue::Number(_), Self::Choice(_) | Self::Grid { .. }) | (OptionValue::Grid(_), _) => {
                false
            }
        }
    }

    /// The smallest and the largest number; `None` where words or grids alone are accepted.
    pub fn numbers(&self) -> Option<[f64; 2]> {
        match *self {
            Self::Real(range) | Self::WordOrReal(_, range) => Some(range),
            Self::Whole(range) | Self::WordOrWhole(_, range) => Some(range.map(|end| end as f64)),
            Self::Choice(_) | Self::Grid { .. } => None,
        }
    }

    /// The words that are accepted.
    pub fn words(&self) -> Vec<&'static str> {
        match self {
            Self::Real(_) | Self::Whole(_) | Self::Grid { .. } => Vec::new(),
            Self::WordOrReal(words, _) | Self::WordOrWhole(words, _) => words.to_vec(),
            Self::Choice(words) => words(),
        }
    }
}

/// In words: "a number from 0 to 1", "auto, or an integer from 1 to 8", "box or tent".
impl fmt::Display for OptionRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Self::WordOrReal(words, _) | Self::WordOrWhole(words, _) = self {
            write!(f, "{}, or ", words.join(", "))?;
        }
        match self {
            Self::Real([from, to]) | Self::WordOrReal(_, [from, to]) => {
                write!(f, "a number from {from} to {to}")
            }
            Self::Whole([from, to]) | Self::WordOrWhole(_, [from, to]) => {
                write!(f, "an integer from {from} to {to}")
            }
            Self::Choice(words) => f.write_str(&either(&words())),
            Self::Grid { most, cells } => {
                write!(f, "a grid WxHxD, integers from 1 to {most}, at most {cells} cells")
            }
        }
    }
}

impl OptionValue {
    /// The number; NaN for a word or a grid, which no range of numbers alone has.
    pub fn number(self) -> f64 {
        self.as_number().unwrap_or(f64::NAN)
    }

    /// The number, where it is one.
    pub fn as_number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Word(_) | Self::Grid(_) => None,
        }
    }

    /// Columns, rows and slices, where it is a grid.
    pub fn as_grid(self) -> Option<[u32; 3]> {
        match self {
            Self::Grid(sides) => Some(sides),
            Self::Number(_) | Self::Word(_) => None,
        }
    }

    /// The value of an enumeration; its first one for what is none of its names, which its range refuses.
    pub fn choice<T: Choice>(self) -> T {
        let names = T::names();
        names.iter().find(|(name, _)| self == Self::Word(name)).unwrap_or(&names[0]).1
    }
}

impl fmt::Display for OptionValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Word(word) => f.write_str(word),
            Self::Grid([columns, rows, slices]) => write!(f, "{columns}x{rows}x{slices}"),
        }
    }
}

/// `WxHxD`; `None` for anything else.
fn parse_grid(text: &str) -> Option<[u32; 3]> {
    let mut sides = text.split('x').map(|side| side.parse::<u32>());
    let mut next = || sides.next()?.ok();
    let grid = [next()?, next()?, next()?];
    sides.next().is_none().then_some(grid)
}

impl From<f64> for OptionValue {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<f32> for OptionValue {
    /// The number of its decimals: 0.1f32 is 0.1, not 0.10000000149.
    fn from(number: f32) -> Self {
        Self::Number(number.to_string().parse().unwrap_or(f64::from(number)))
    }
}

impl From<u32> for OptionValue {
    fn from(number: u32) -> Self {
        Self::Number(number.into())
    }
}

impl<T: Choice> From<T> for OptionValue {
    fn from(value: T) -> Self {
        let named = T::names().into_iter().find(|(_, other)| *other == value);
        Self::Word(named.map_or("", |(name, _)| name))
    }
}

#[cfg(test)]
mod tests;
