//! Both references against mathematics, against dense sampling, and against each other.

mod march_against_walk;
mod random_scene;
mod walk_against_sampling;
