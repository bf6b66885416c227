pub use scatter_core::*;
/// Every technique.
pub static TECHNIQUES: &[&dyn Technique] = &[];
