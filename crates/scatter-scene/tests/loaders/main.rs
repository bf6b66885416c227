//! What the loaders promise, seen from outside: files on disk in, scenes or one-line errors out.

mod common;
mod cutouts;
mod gltf;
mod mutants;
mod nothing_lost;
mod obj;
mod occluders;
mod poses;
mod shots;
mod spellings;
