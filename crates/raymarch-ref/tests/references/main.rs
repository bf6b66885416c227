//! Both references against mathematics, against dense sampling, and against each other.

mod analytic;
mod as_a_technique;
mod cascades;
mod core_walk;
mod determinism;
mod extremes;
mod height_fog;
mod march_against_walk;
mod walk_against_sampling;
