//! What the loaders promise, seen from outside: files on disk in, scenes or one-line errors out.

mod common;
mod gltf;
mod mutants;
mod obj;
mod shots;
