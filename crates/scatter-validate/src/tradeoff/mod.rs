//! The trade of speed for accuracy, measured for every technique through its trait alone.
//!
//! [`Sweep`] climbs each technique's settings on a shot: time against error, the front that nothing beats
//! ([`on_front`]), and the cheapest setting that reaches each quality level. [`Scaling`] finds how the time grows with
//! resolution, [`Motion`] how much the error flickers while camera and light move, [`winners()`] which technique is the
//! fastest to each level on each shot. What comes out is printed by
//! [`tables`] and drawn by [`charts`].

pub mod charts;
pub mod tables;

mod flicker;
mod levels;
mod motion;
mod pareto;
mod scaling;
mod setting;
mod slope;
mod sweep;
mod trade;
mod winners;

pub use flicker::SecondDifference;
pub use levels::{LevelRow, Reached, level_rows};
pub use motion::{MOTION_FRAMES, Motion, MotionRow, pan, turned};
pub use pareto::on_front;
pub use scaling::{SCALING_FACTORS, Scaling, ScalingRow, Slope, slopes};
pub use setting::{Setting, Source, ladder};
pub use slope::Fit;
pub use sweep::{Limits, Sweep};
pub use trade::{Rung, ShotTrade};
pub use winners::{Winner, Wins, winners, wins};

#[cfg(test)]
pub(crate) use trade::tests::trade as example_trade;
