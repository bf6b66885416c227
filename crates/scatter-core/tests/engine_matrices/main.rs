//! Matrices as engines have them: made, inverted and multiplied in f32 by `glam`, in every convention that it knows.
//!
//! The reference is never a matrix: eye and axes come from the quaternion in f64, windows and planes from their numbers.
//! What f32 rounds is bounded from its operations, and the largest error of all cases is printed beside the bound.

mod conventions;
mod f32_cameras;
mod f32_maps;
mod refusals;
mod shadow_depths;
mod whole_matrices;
