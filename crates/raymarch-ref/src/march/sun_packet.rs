//! A packet of rays under a sun in a uniform medium: the share of the unoccluded in-scattering that visibility leaves.
//!
//! Steps of equal length have weights `wᵢ = ∫ᵢ e^{−σt} dt = w₀·rⁱ`, exactly, with r = e^{−σΔ}: a Horner scheme from
//! the far end to the near one needs one multiplication a step and no exponential. What is returned is
//! `Σ Vᵢ rⁱ / Σ rⁱ`, both sums taken by the same operations, so that an unoccluded ray gives 1 to the last bit at any
//! step count, and never more.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::lanes::{LANES, Lanes, hashed, one_where, splat};
use super::lookups::{SunSamples, TextureLookup, Visibility};

/// Steps that are summed before they are scaled as one: keeps the error of rounding r at 64·2⁻²⁵ a block.
const BLOCK: u32 = 64;

/// What a march through a packet needs besides the map.
#[derive(Clone, Copy)]
pub struct SunMarch<'a> {
    /// Steps, ≥ 1.
    pub steps: u32,
    /// Per channel and lane `σ·Δ`, the optical depth of a step.
    pub step_depth: [[f64; LANES]; 3],
    /// The colour texture of the light; needs three channels.
    pub texture: Option<TextureLookup<'a>>,
    /// Per-lane seeds of a jittered march.
    pub seeds: Option<[u32; LANES]>,
}

/// A march under a sun: what weights its steps have.
pub trait SunSteps<S: Simd> {
    /// Whether there is neither texture nor jitter.
    fn is_plain(&self) -> bool;

    /// The shares of all lanes, per channel; channels beyond `CHANNELS` repeat the first. `PLAIN`: [`Self::is_plain`].
    fn shares<V: Visibility<S>, const CHANNELS: usize, const PLAIN: bool>(
        &self,
        simd: S,
        visibility: V,
    ) -> [[f32; LANES]; 3];
}

impl<S: Simd> SunSteps<S> for SunMarch<'_> {
    fn is_plain(&self) -> bool {
        self.texture.is_none() && self.seeds.is_none()
    }

    #[inline(always)]
    fn shares<V: Visibility<S>, const CHANNELS: usize, const PLAIN: bool>(
        &self,
        simd: S,
        visibility: V,
    ) -> [[f32; LANES]; 3] {
        march_sun::<S, V, CHANNELS, PLAIN>(simd, self, visibility)
    }
}

/// The shares of all lanes, per channel; channels beyond `CHANNELS` repeat the first.
///
/// `PLAIN`: neither texture nor jitter.
#[inline(always)]
fn march_sun<S: Simd, V: Visibility<S>, const CHANNELS: usize, const PLAIN: bool>(
    simd: S,
    march: &SunMarch<'_>,
    visibility: V,
) -> [[f32; LANES]; 3] {
    let rates: [[f64; LANES]; CHANNELS] = std::array::from_fn(|channel| march.step_depth[channel].map(decay));
    let rate: [Lanes<S>; CHANNELS] = rates.map(|lanes| lanes.map(|r| r as f32).simd_into(simd));
    let block_rate: [Lanes<S>; CHANNELS] =
        rates.map(|lanes| lanes.map(|r| power_of_block(r) as f32).simd_into(simd));
    let seeds: u32x16<S> = march.seeds.unwrap_or([0; LANES]).simd_into(simd);

    let zero = [splat(simd, 0.0); CHANNELS];
    let (mut sum, mut whole) = (zero, zero);
    let mut end = march.steps;
    while end > 0 {
        // The odd block comes first: it is the farthest.
        let start = (end - 1) / BLOCK * BLOCK;
        let (mut block, mut block_whole) = (zero, zero);
        let mut after = end;
        while after > start {
            // From the far end to the near one.
            let (visibility, [first, _]) = visibility.stretch(after - 1);
            let first = first.max(start);
            for step in (first..after).rev() {
                let middle = if PLAIN || march.seeds.is_none() {
                    splat(simd, step as f32 + 0.5)
                } else {
                    hashed(simd, seeds, step) + step as f32
                };
                let samples = SunSamples { index: middle };
                let lit = one_where(simd, visibility.lit(simd, samples));
                match march.texture {
                    Some(texture) if !PLAIN => {
                        let colour = texture.colour(simd, samples);
                        for channel in 0..CHANNELS {
                            block[channel] = block[channel].mul_add(rate[channel], lit * colour[channel]);
                        }
                    }
                    _ => {
                        for channel in 0..CHANNELS {
                            block[channel] = block[channel].mul_add(rate[channel], lit);
                        }
                    }
                }
            }
            after = first;
        }
        for _ in start..end {
            for channel in 0..CHANNELS {
                block_whole[channel] = block_whole[channel].mul_add(rate[channel], splat(simd, 1.0));
            }
        }
        for channel in 0..CHANNELS {
            sum[channel] = sum[channel].mul_add(block_rate[channel], block[channel]);
            whole[channel] = whole[channel].mul_add(block_rate[channel], block_whole[channel]);
        }
        end = start;
    }
    std::array::from_fn(|channel| {
        let channel = if channel < CHANNELS { channel } else { 0 };
        (sum[channel] / whole[channel]).into()
    })
}

/// `e^{−x}` of a step's optical depth, in f64 to 1e-14.
#[inline(always)]
fn decay(x: f64) -> f64 {
    // Steps are short: five terms of the series, without a call to libm. The next is x⁶/720 ≤ 2e-14.
    if x < 1.0 / 64.0 {
        1.0 - x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0))))
    } else {
        (-x).exp()
    }
}

/// `r` to the power of [`BLOCK`].
#[inline(always)]
fn power_of_block(r: f64) -> f64 {
    (0..BLOCK.trailing_zeros()).fold(r, |power, _| power * power)
}
