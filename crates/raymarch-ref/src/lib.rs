//! The brute-force marcher that every technique races, and the exact walk through a shadow map that judges them.
//!
//! [`ShadowMapWalk`] is shadow-map truth: f64, no step size, no options. [`RayMarch`] is the honest opponent: f32,
//! SIMD, a number of steps. They share how a view ray is cut by the maps of a light, and nothing else.

mod map_segments;
mod march;
mod parallel;
mod walk;

use scatter_core::{RenderStats, SceneFacts};

pub use march::{Distribution, MARCH_ID, MOST_STEPS, Options, RayMarch, RayMarchTechnique, TECHNIQUE};
pub use walk::{ShadowMapWalk, WALK_ID};

/// Writes down what a frame required of a reference.
fn push_modelled(stats: &mut RenderStats, facts: &SceneFacts) {
    let entries = [
        ("transmittance", facts.max_optical_depth > 0.0),
        ("rgb-extinction", !facts.grey_extinction),
        ("phase", facts.anisotropic),
        ("light-texture", facts.textured),
        ("shadow-map", facts.casts_shadow),
    ];
    for (name, modelled) in entries {
        if modelled {
            stats.modelled.push(name, ());
        }
    }
}
