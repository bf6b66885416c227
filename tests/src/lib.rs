//! What only several crates together can show: random worlds, rendered by every technique through the trait.

mod method;
mod tally;
mod world;

pub use method::Method;
pub use tally::{Tally, for_all};
pub use world::{GLASS_SIDE, Mirror, World, WorldLight};

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
