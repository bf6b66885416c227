//! One file a command: each reads its flags, calls the libraries, prints.

pub mod compare;
mod foreign;
pub mod methods;
pub mod render;
pub mod shots;
pub mod test;
pub mod validate;
