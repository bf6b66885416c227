//! What a frame requires of whoever models it: the names in [`RenderStats::modelled`](crate::RenderStats::modelled).

use crate::render_stats::RenderStats;
use crate::scene_facts::SceneFacts;

impl RenderStats {
    /// Writes down what a technique models of a frame with these facts: `transmittance`, `rgb-extinction`, `height-fog`, `phase`,
    /// `light-texture`, `shadow-map`, `translucent-occluders`, each where the frame has it.
    pub fn push_modelled(&mut self, facts: &SceneFacts) {
        let required = [
            ("transmittance", facts.max_optical_depth > 0.0),
            ("rgb-extinction", !facts.grey_extinction),
            ("height-fog", facts.log_density.is_some()),
            ("phase", facts.anisotropic),
            ("light-texture", facts.textured),
            ("shadow-map", facts.casts_shadow),
            ("translucent-occluders", facts.translucent),
        ];
        for (name, _) in required.into_iter().filter(|(_, required)| *required) {
            self.modelled.push(name, ());
        }
    }
}
