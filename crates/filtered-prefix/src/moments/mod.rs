//! Power moments of rows (Peters and Klein 2015; Peters et al. 2016, 2017): prefix sums, and what they say of a view ray with a
//! bound of the error.

mod answers;
mod bounds;
mod filtered_row;
mod lanes;
mod roots;

pub use answers::{Answer, MomentAnswers};
#[cfg(test)]
pub use bounds::mass_bounds;
pub use bounds::{COUNTS, MOST_POWERS, MassBounds, bias_of, mass_below};
pub use filtered_row::MomentRow;
pub use lanes::{Lanes, Two};
