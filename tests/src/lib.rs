//! What only several crates together can show: random worlds, rendered by every technique through the trait.

mod world;

pub use world::{Method, Mirror, World, WorldLight};

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
