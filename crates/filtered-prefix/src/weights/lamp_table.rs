//! The light of a lamp along one view ray of a slice, as a table over its light rays.

use epipolar::driver::SliceView;
use epipolar::geometry::direction_of_diamond_angle;
use scatter_core::exp_f32;

use super::phase_table::phase_at;

/// Intervals over γ in [0, 2]: an angle of 0.006 at the most.
const INTERVALS: usize = 1024;

/// Width of an interval.
const WIDTH: f32 = 2.0 / INTERVALS as f32;

/// What a reference ray sees of a lamp, up to every light ray: `∫ cone(γ)·p(β+γ)·e^{−σ(s+d−L)} dγ`, without 1/d², which cancels against
/// the Jacobian of the angle γ at the lamp (Baran et al. 2010, Section 9).
///
/// The light of a light ray is linear between nodes, so that what it can be off by follows from its second differences.
#[derive(Debug, Default)]
pub struct LampTable {
    /// Per node: cosine, sine and angle of its light ray, and what it counts in the coordinate γ, dθ/dγ.
    turns: Vec<[f32; 4]>,
    /// Light of each node.
    density: Vec<f32>,
    /// Light up to each node.
    light: Vec<f32>,
    /// What that can be off by.
    rough: Vec<f32>,
}

impl LampTable {
    /// Room for all tables.
    pub fn reserve(&mut self) {
        if self.turns.is_empty() {
            self.turns.extend((0..=INTERVALS).map(|node| {
                let direction = direction_of_diamond_angle(node as f64 * (2.0 / INTERVALS as f64));
                let unit = direction.normalize();
                let angle = direction.y.atan2(direction.x);
                [unit.x as f32, unit.y as f32, angle as f32, direction.length_squared().recip() as f32]
            }));
            for list in [&mut self.density, &mut self.light, &mut self.rough] {
                list.resize(INTERVALS + 1, 0.0);
            }
        }
    }

    /// Fills the table for the view ray of an angle β to the light, in a medium of the optical depth `depth` between eye and
    /// lamp (0 leaves transmittance out), that scatters as `phase` says; empty if that does not depend on the angle.
    #[inline(always)]
    pub fn fill(&mut self, slice: &SliceView<'_>, [sine, cosine]: [f32; 2], depth: f32, phase: &[f32]) {
        self.reserve();
        let cone = slice.spot().map(|spot| {
            let axis = spot.direction();
            [
                -axis.dot(slice.plane.to_light) as f32,
                axis.dot(slice.plane.across) as f32,
                spot.cos_outer() as f32,
                spot.cone_slope() as f32,
            ]
        });
        let beta = sine.atan2(cosine);
        for (density, &[own_cosine, own_sine, gamma, per_gamma]) in self.density.iter_mut().zip(&self.turns) {
            let bright = cone.map_or(1.0, |[towards, across, outer, slope]| {
                let factor = ((towards * own_cosine + across * own_sine - outer) * slope).clamp(0.0, 1.0);
                factor * factor
            });
            // Without transmittance a light ray counts that this view ray does not meet.
            let lost = if depth > 0.0 { detour([sine, cosine], [own_sine, own_cosine]) * depth } else { 0.0 };
            let through = exp_f32(-(if lost < 87.0 { lost } else { 87.0 }));
            *density = bright * phase_at(phase, beta + gamma) * through * per_gamma;
        }
        let (mut sum, mut rough) = (0.0f32, 0.0f32);
        for node in 0..=INTERVALS {
            (self.light[node], self.rough[node]) = (sum, rough);
            let [before, own, next] =
                [node.max(1) - 1, node, (node + 1).min(INTERVALS)].map(|node| self.density[node]);
            sum += 0.5 * WIDTH * (own + next);
            // A kink between two nodes leaves a triangle of an eighth of both differences; the curvature of what is smooth less.
            // Where γ turns at 1 the density may have a kink, too, but at a node.
            rough += ROUGH * WIDTH * (next - own - (own - before)).abs();
        }
    }

    /// Light up to light rays, and what it can be off by.
    #[inline(always)]
    pub fn read(&self, gammas: &[f32], out: &mut [f32]) {
        for (out, &gamma) in out.iter_mut().zip(gammas) {
            let place = (gamma * (0.5 * INTERVALS as f32)).clamp(0.0, INTERVALS as f32);
            let index = (place as usize).min(INTERVALS - 1);
            let part = place - index as f32;
            let (own, next) = (self.density[index], self.density[index + 1]);
            *out = self.light[index] + WIDTH * part * (own + 0.5 * part * (next - own));
        }
    }

    /// What the light up to a light ray can be off by.
    #[inline(always)]
    pub fn rough(&self, gamma: f32) -> f32 {
        let place = (gamma * (0.5 * INTERVALS as f32)).clamp(0.0, INTERVALS as f32 - 1.0) as usize;
        // With the differences on both sides of its interval.
        self.rough[(place + 2).min(INTERVALS)]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        16 * self.turns.capacity()
            + 4 * (self.density.capacity() + self.light.capacity() + self.rough.capacity())
    }
}

/// Part of a second difference and of an interval that a linear density can be off by; an eighth, and half of it again for what
/// normalising adds.
const ROUGH: f32 = 0.1875;

/// `(s + d)/L − 1` where the view ray at the angle β to the light meets the light ray γ, by sines and cosines: the way over the
/// meeting point beyond the straight one. ∞ where they do not meet.
///
/// With t = tan(β/2), u = tan(γ/2) it is `2·t·u/(1 − t·u)`.
#[inline(always)]
pub fn detour([sine, cosine]: [f32; 2], [own_sine, own_cosine]: [f32; 2]) -> f32 {
    // tan(x/2) = sin x/(1 + cos x), as a fraction: nothing is infinite but where both look away.
    let top = sine * own_sine;
    let bottom = (1.0 + cosine) * (1.0 + own_cosine) - top;
    if bottom > 1e-30 { 2.0 * top / bottom } else { f32::INFINITY }
}
