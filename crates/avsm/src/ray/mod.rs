//! One view ray: where it is lit, and how much of the light is left there.

pub mod crossing;
pub mod dimmed_light;
pub mod lit_parts;
pub mod ray_sum;
