//! The light of a lamp along one view ray of a slice, as a table over its light rays.

use epipolar::driver::SliceView;
use epipolar::geometry::direction_of_diamond_angle;
use scatter_core::exp_f32;

/// Intervals over γ in [0, 2]: an angle of 0.006 at the most.
const INTERVALS: usize = 1024;

/// What a reference ray sees of a lamp, up to every light ray: `∫ cone(γ)·p(β+γ)·e^{−σ(s+d−L)} dγ`, without 1/d², which cancels against
/// the Jacobian of the angle γ at the lamp (Baran et al. 2010, Section 9).
#[derive(Debug, Default)]
pub struct LampTable {
    /// Per interval: its middle as (cosine, sine) and as an angle, and its width \[radians\].
    turns: Vec<[f32; 4]>,
    /// Light up to the start of each interval.
    light: Vec<f32>,
    /// Largest light of an interval's angle times its variation so far: what the table's steps can be off by.
    rough: Vec<f32>,
}

impl LampTable {
    /// Room for all tables.
    pub fn reserve(&mut self) {
        if self.turns.is_empty() {
            let angle = |turn: usize| {
                let direction = direction_of_diamond_angle(turn as f64 * (2.0 / INTERVALS as f64));
                direction.y.atan2(direction.x)
            };
            self.turns.extend((0..INTERVALS).map(|turn| {
                let (from, to) = (angle(turn), angle(turn + 1));
                let (sine, cosine) = (0.5 * (from + to)).sin_cos();
                [cosine as f32, sine as f32, 0.5 * (from + to) as f32, (to - from) as f32]
            }));
            self.light.resize(INTERVALS + 1, 0.0);
            self.rough.resize(INTERVALS + 1, 0.0);
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
        let turns = self.turns.iter();
        // First the light of an angle in every interval, in place of the sums.
        let beta = sine.atan2(cosine);
        for (light, &[own_cosine, own_sine, gamma, _]) in self.light[1..].iter_mut().zip(turns) {
            let bright = cone.map_or(1.0, |[towards, across, outer, slope]| {
                let factor = ((towards * own_cosine + across * own_sine - outer) * slope).clamp(0.0, 1.0);
                factor * factor
            });
            // Without transmittance a light ray counts that this view ray does not meet.
            let lost = if depth > 0.0 { detour([sine, cosine], [own_sine, own_cosine]) * depth } else { 0.0 };
            *light =
                bright * phase_at(phase, beta + gamma) * exp_f32(-(if lost < 87.0 { lost } else { 87.0 }));
        }
        let (mut sum, mut variation, mut before) = (0.0f32, 0.0f32, self.light[1]);
        self.light[0] = 0.0;
        let sums = self.light[1..].iter_mut().zip(&mut self.rough[1..]).zip(&self.turns);
        for ((light, rough), &[.., width]) in sums {
            variation += (*light - before).abs() * width;
            before = *light;
            sum += *light * width;
            (*light, *rough) = (sum, variation);
        }
    }

    /// Light up to light rays, and what it can be off by.
    #[inline(always)]
    pub fn read(&self, gammas: &[f32], out: &mut [f32]) {
        for (out, &gamma) in out.iter_mut().zip(gammas) {
            *out = at(&self.light, gamma);
        }
    }

    /// What the light up to a light ray can be off by.
    #[inline(always)]
    pub fn rough(&self, gamma: f32) -> f32 {
        // As the interval's end has it: variation within the interval counts.
        let place = (gamma * (0.5 * INTERVALS as f32)).clamp(0.0, INTERVALS as f32 - 1.0) as usize;
        self.rough[(place + 2).min(INTERVALS)]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        16 * self.turns.capacity() + 4 * (self.light.capacity() + self.rough.capacity())
    }
}

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

/// A phase function's table over [0, π] at an angle ≥ 0, the nearest entry.
#[inline(always)]
fn phase_at(phase: &[f32], angle: f32) -> f32 {
    let Some(last) = phase.len().checked_sub(1) else { return 1.0 };
    phase[((angle * (last as f32 * std::f32::consts::FRAC_1_PI) + 0.5) as usize).min(last)]
}

/// A table's value at γ in [0, 2], linear between its entries.
#[inline(always)]
fn at(table: &[f32], gamma: f32) -> f32 {
    let place = (gamma * (0.5 * INTERVALS as f32)).clamp(0.0, INTERVALS as f32);
    let index = (place as usize).min(INTERVALS - 1);
    let (from, to) = (table[index], table[index + 1]);
    from + (place - index as f32) * (to - from)
}
