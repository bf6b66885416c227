//! The brute-force marcher that every technique races, and the exact walk through a shadow map that judges them.
//!
//! [`ShadowMapWalk`] is shadow-map truth: f64, no step size, no options.

mod map_segments;
mod parallel;
mod walk;

use scatter_core::{RenderStats, SceneFacts};

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
