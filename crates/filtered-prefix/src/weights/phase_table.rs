//! What a medium scatters around a lamp, as a table over the angle.

use scatter_core::Setup;

/// Intervals of a phase function's table.
const STEPS: usize = 2048;

/// Fills what a medium scatters around a lamp by the angle, of a channel; nothing if all angles are alike.
pub(super) fn fill_phase(setup: &Setup<'_>, channel: usize, phase: &mut Vec<f32>) {
    phase.clear();
    let medium = setup.medium();
    if medium.components().iter().all(|component| component.phase.is_isotropic()) {
        return;
    }
    phase.reserve(STEPS + 1);
    let mut brightest = 0.0f32;
    for step in 0..=STEPS {
        let half = 0.5 * std::f64::consts::PI * step as f64 / STEPS as f64;
        let rgb = medium.scattering_towards(half.sin().powi(2));
        // A channel that scatters nothing may stand for the others, where their shares are alike.
        let value = if rgb[channel] > 0.0 { rgb[channel] } else { rgb.element_sum() } as f32;
        brightest = brightest.max(value);
        phase.push(value);
    }
    let scale = if brightest > 0.0 { 1.0 / brightest } else { 0.0 };
    phase.iter_mut().for_each(|value| *value *= scale);
}

/// How fast the logarithm of a phase function's table changes at the most \[1/radian\].
pub(super) fn lobe_of(phase: &[f32]) -> f32 {
    let changes = phase.windows(2).map(|pair| (pair[1] / pair[0]).ln().abs());
    // The slope between two nodes is a mean: a lobe of g = 0.99 is ten nodes wide.
    changes.fold(0.0, f32::max) * (1.1 * STEPS as f32 / std::f32::consts::PI)
}

/// A phase function's table over [0, π] at an angle ≥ 0, linear between its entries.
#[inline(always)]
pub(super) fn phase_at(phase: &[f32], angle: f32) -> f32 {
    if phase.len() < 2 {
        return 1.0;
    }
    let last = phase.len() - 1;
    let place = angle * (last as f32 * std::f32::consts::FRAC_1_PI);
    let index = (place as usize).min(last - 1);
    phase[index] + (place - index as f32).min(1.0) * (phase[index + 1] - phase[index])
}
