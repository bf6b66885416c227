//! A packet of rays near a lamp: equi-angular steps (Kulla and Fajardo 2012) or uniform ones.
//!
//! With φ the angle at the lamp between the perpendicular on the ray and a point, `dt/d² = dφ/h`, so steps of equal
//! angle have equal weights in a thin isotropic medium: each step's share of `∫ dt/d²` is taken exactly, and only
//! the smooth factors (extinction, phase function, cone) are evaluated at its sample. In `ξ = φ/2 + π/4` everything
//! follows from one sine and one cosine: `cos φ = 2 sin ξ cos ξ`, `sin φ = sin²ξ − cos²ξ`, `sin²(θ/2) = sin²ξ`, and
//! the way through the medium is `t + d = t₀ + h·tan ξ`.
//!
//! Uniform steps use the same factors at `t₀ + x` and the exact angle of each step, `atan2(h·Δ, h² + x₀·x₁)`; they are
//! what equi-angular steps are measured against.
//!
//! An unoccluded ray is not normalised by its closed form (that costs more than a hundred steps): the midpoint rule
//! in ξ converges as 1/n², two orders ahead of the edges of shadows.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;
use scatter_core::{INV_4PI, Phase};

use super::fog_lamp_lanes::FogLampLanes;
use super::lanes::{LANES, Lanes, exp, hashed, load, sin_cos, splat, upper_angle};
use super::lookups::{LampSamples, TextureLookup, Visibility};

/// Steps that are summed before they are added to the total: keeps f32 sums of 65,536 steps at 1e-5.
const BLOCK: u32 = 128;

/// One scattering component: weight per channel and phase function.
#[derive(Debug, Clone, Copy)]
pub struct PhaseTerm {
    /// σs per channel, or 1 where the march has one channel for three.
    pub weight: [f32; 3],
    /// Its phase function.
    pub phase: Phase,
}

/// The spot cone along the rays.
#[derive(Debug, Clone, Copy)]
pub struct ConeLanes {
    /// Cosine between the cone's axis and the ray.
    pub along: [f32; LANES],
    /// Cosine between the axis and the way from the lamp to the foot.
    pub across: [f32; LANES],
    /// Cosine of the outer half angle.
    pub cos_outer: f32,
    /// Slope of the cone's factor.
    pub slope: f32,
}

/// What a march through a packet needs besides the map.
#[derive(Clone, Copy)]
pub struct LampMarch<'a> {
    /// Steps, ≥ 1.
    pub steps: u32,
    /// Whether steps have equal lengths instead of equal angles.
    pub uniform: bool,
    /// Equi-angular: ξ at the start \[radians\]. Uniform: the start's distance behind the foot over h.
    pub first: [f32; LANES],
    /// Equi-angular: a step of ξ. Uniform: a step's length over h.
    pub step: [f32; LANES],
    /// Equi-angular: 1 in lanes whose angles are counted from the other end, as π/2 − ξ with a negative step; else 0.
    /// Of a ray that leads away from the lamp ξ comes so close to π/2 that f32 has no digits left for its cosine.
    pub from_end: [f32; LANES],
    /// `σt·t₀` per channel: the extinction up to the foot, may be negative.
    pub depth_to_foot: [[f32; LANES]; 3],
    /// `σt·h` per channel.
    pub depth_of_distance: [[f32; LANES]; 3],
    /// Whether there is any extinction.
    pub extinction: bool,
    /// Height fog, instead of the three above.
    pub fog: Option<FogLampLanes>,
    /// Phase functions that depend on the angle; empty if none does.
    pub terms: &'a [PhaseTerm],
    /// The spot's cone.
    pub cone: Option<ConeLanes>,
    /// The colour texture of the light; needs three channels.
    pub texture: Option<TextureLookup<'a>>,
    /// Per-lane seeds of a jittered march.
    pub seeds: Option<[u32; LANES]>,
}

/// `Σ V·C·Σσs·p·e^{−σt(t+d)}·Δξ`, per channel and lane: to be multiplied by 2·I/h (and, without phase terms, by the
/// isotropic scattering). Channels beyond `CHANNELS` repeat the first. `FOG`: there may be height fog, `ρ` times as much
/// and with its optical depths.
#[inline(always)]
pub fn march_lamp<S: Simd, V: Visibility<S>, const CHANNELS: usize, const FOG: bool>(
    simd: S,
    march: &LampMarch<'_>,
    visibility: V,
) -> [[f32; LANES]; 3] {
    let (first, step_size) = (load(simd, &march.first), load(simd, &march.step));
    let any_from_end = march.from_end.iter().any(|&lane| lane > 0.0);
    let from_end = load(simd, &march.from_end).simd_gt(splat(simd, 0.5));
    let seeds: u32x16<S> = march.seeds.unwrap_or([0; LANES]).simd_into(simd);
    let one = splat(simd, 1.0);
    let zero = [splat(simd, 0.0); CHANNELS];
    let mut sum = zero;
    let mut start = 0;
    while start < march.steps {
        let end = march.steps.min(start + BLOCK);
        let mut block = zero;
        for step in start..end {
            let offset = if march.seeds.is_none() {
                splat(simd, step as f32 + 0.5)
            } else {
                hashed(simd, seeds, step) + step as f32
            };
            let at = offset.mul_add(step_size, first);
            let (sample, tan_half, haversine, weight) = if march.uniform {
                let from = splat(simd, step as f32).mul_add(step_size, first);
                uniform_sample(simd, at, from, step_size)
            } else {
                let (mut sine, mut cosine) = sin_cos(simd, at);
                if any_from_end {
                    (sine, cosine) = (from_end.select(cosine, sine), from_end.select(sine, cosine));
                }
                // The last step's end may round beyond π/2.
                let cosine = cosine.max(splat(simd, 1e-12));
                let sample = LampSamples { cos: 2.0 * sine * cosine, sin: sine * sine - cosine * cosine };
                (sample, sine / cosine, sine * sine, one)
            };
            let mut factor = visibility.lit(simd, sample).select(weight, splat(simd, 0.0));
            if let Some(cone) = &march.cone {
                let cos_axis =
                    load(simd, &cone.along).mul_add(sample.sin, load(simd, &cone.across) * sample.cos);
                let share = ((cos_axis - cone.cos_outer) * cone.slope).max(splat(simd, 0.0)).min(one);
                factor = factor * share * share;
            }
            let mut values = [factor; CHANNELS];
            if !march.terms.is_empty() {
                let mut scattering = zero;
                for term in march.terms {
                    let phase = phase_at(simd, term.phase, haversine);
                    for (sum, weight) in scattering.iter_mut().zip(term.weight) {
                        *sum = phase.mul_add(splat(simd, weight), *sum);
                    }
                }
                for (value, scattering) in values.iter_mut().zip(scattering) {
                    *value *= scattering;
                }
            }
            if let Some(fog) = march.fog.as_ref().filter(|_| FOG) {
                let weights: [Lanes<S>; CHANNELS] = fog.weights(simd, sample);
                for (value, weight) in values.iter_mut().zip(weights) {
                    *value *= weight;
                }
            } else if march.extinction {
                let depths = march.depth_of_distance.iter().zip(&march.depth_to_foot);
                for (value, (of_distance, to_foot)) in values.iter_mut().zip(depths) {
                    let depth = tan_half.mul_add(load(simd, of_distance), load(simd, to_foot));
                    // t + d ≥ 0, whatever rounding makes of it.
                    *value *= exp(simd, (-depth).min(splat(simd, 0.0)));
                }
            }
            if let Some(texture) = march.texture {
                for (value, colour) in values.iter_mut().zip(texture.colour(simd, sample)) {
                    *value *= colour;
                }
            }
            for (sum, value) in block.iter_mut().zip(values) {
                *sum += value;
            }
        }
        for (sum, block) in sum.iter_mut().zip(block) {
            *sum += block;
        }
        start = end;
    }
    if !march.uniform {
        for channel in &mut sum {
            *channel *= step_size.abs();
        }
    }
    std::array::from_fn(|channel| sum[if channel < CHANNELS { channel } else { 0 }].into())
}

/// A sample at `x = (t − t₀)/h`, and half the angle of its step `[from, from + length]`.
#[inline(always)]
fn uniform_sample<S: Simd>(
    simd: S,
    x: Lanes<S>,
    from: Lanes<S>,
    length: Lanes<S>,
) -> (LampSamples<S>, Lanes<S>, Lanes<S>, Lanes<S>) {
    let one = splat(simd, 1.0);
    let distance = x.mul_add(x, one).sqrt();
    let cos = one / distance;
    // p/h = x + d/h, without cancellation before the foot.
    let width = x.abs() + distance;
    let before = x.simd_lt(splat(simd, 0.0));
    let tan_half = before.select(one / width, width);
    let haversine = 0.5 * cos * tan_half;
    let angle = upper_angle(simd, length, from.mul_add(from + length, one));
    (LampSamples { cos, sin: x * cos }, tan_half, haversine, 0.5 * angle)
}

/// A phase function at `sin²(θ/2)`, as [`Phase::at_haversine`] in f32.
#[inline(always)]
fn phase_at<S: Simd>(simd: S, phase: Phase, haversine: Lanes<S>) -> Lanes<S> {
    let one = splat(simd, 1.0);
    match phase {
        Phase::Isotropic => splat(simd, INV_4PI as f32),
        Phase::Rayleigh => {
            let cos = (-2.0 * haversine) + 1.0;
            cos.mul_add(cos, one) * (0.75 * INV_4PI) as f32
        }
        Phase::HenyeyGreenstein { g } => {
            let away = if g >= 0.0 { haversine } else { one - haversine };
            let gap = 1.0 - g.abs();
            let denominator =
                away.mul_add(splat(simd, (4.0 * g.abs()) as f32), splat(simd, (gap * gap) as f32));
            splat(simd, (INV_4PI * gap * (1.0 + g.abs())) as f32) / (denominator * denominator.sqrt())
        }
    }
}
