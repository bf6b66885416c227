//! A packet of rays under a sun in height fog: the share of the unoccluded in-scattering that visibility leaves.
//!
//! The weight of a step is `wᵢ = ∫ᵢ ρ·e^{−τ} dt = e^{−τᵢ}·(1 − e^{−δᵢ})/σ`, exactly, with the optical depth of the step
//! `δᵢ = δ·dᵢ`, dᵢ its density as a share of the densest one's. From the near end to the far one
//!
//! ```text
//!     dᵢ₊₁ = dᵢ·q,   q = e^{−mΔ}                         (one multiplication)
//!     w = T·dᵢ·P(δᵢ),   P(x) = (1 − e^{−x})/x            (a polynomial where x < 1/8)
//!     T ← T − δ·w                                         (no exponential)
//! ```
//!
//! Blocks of steps start from d and `Σd` in f64 and one exponential, so that rounding does not add up over the ray. What
//! is returned is `Σ Vᵢ wᵢ / Σ wᵢ`, both sums taken by the same operations, so that an unoccluded ray gives 1 at any step
//! count, and never more.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;
use scatter_core::FogRay;

use super::lanes::{LANES, Lanes, exp, hashed, load, one_where, splat};
use super::lookups::{SunSamples, TextureLookup, Visibility};
use super::packet::Span;
use super::sun_packet::SunSteps;

/// Steps between two starts from f64: rounding of q leaves 64·2⁻²⁵ a block.
const BLOCK: u32 = 64;
/// Optical depth of a step below which the polynomial serves: the first term left out is x⁵/720 = 4e-8.
const SHORT: f64 = 0.125;
/// An optical depth of a step behind which nothing is: larger ones would only leave f32.
const OPAQUE: f64 = 1e6;

/// What a march through a packet needs besides the map.
#[derive(Clone, Copy)]
pub struct FogSunMarch<'a> {
    /// Steps, ≥ 1.
    pub steps: u32,
    /// Per channel and lane the optical depth of the densest step.
    pub depth: [[f64; LANES]; 3],
    /// Per lane the density of the first step as a share of the densest one's.
    pub first: [f64; LANES],
    /// Per lane the ratio of the densities of neighbouring steps.
    pub rate: [f64; LANES],
    /// The colour texture of the light; needs three channels.
    pub texture: Option<TextureLookup<'a>>,
    /// Per-lane seeds of a jittered march.
    pub seeds: Option<[u32; LANES]>,
}

impl FogSunMarch<'_> {
    /// Of rays in fogs of `sigma_t`, marched in `spans`; without a texture.
    pub fn new(
        steps: u32,
        sigma_t: [f64; 3],
        (fogs, spans): (&[FogRay; LANES], &[Span; LANES]),
        seeds: Option<[u32; LANES]>,
    ) -> Self {
        let (mut depth, mut first, mut rate) = ([[0.0; LANES]; 3], [1.0; LANES], [1.0; LANES]);
        for lane in 0..LANES {
            let (fog, span) = (&fogs[lane], spans[lane]);
            let step = (span.end - span.start) / f64::from(steps);
            let fall = fog.slope() * step;
            rate[lane] = (-fall).exp();
            let densest = if fall >= 0.0 {
                [span.start, span.start + step]
            } else {
                first[lane] = (fall * f64::from(steps - 1)).exp();
                [span.end - step, span.end]
            };
            let unit = fog.optical_depth_between(1.0, densest[0], densest[1]);
            for (depth, sigma) in depth.iter_mut().zip(sigma_t) {
                depth[lane] = if sigma > 0.0 { (sigma * unit).min(OPAQUE) } else { 0.0 };
            }
        }
        Self { steps, depth, first, rate, texture: None, seeds }
    }
}

impl<S: Simd> SunSteps<S> for FogSunMarch<'_> {
    fn is_plain(&self) -> bool {
        self.texture.is_none() && self.seeds.is_none()
    }

    #[inline(always)]
    fn shares<V: Visibility<S>, const CHANNELS: usize, const PLAIN: bool>(
        &self,
        simd: S,
        visibility: V,
    ) -> [[f32; LANES]; 3] {
        let (mut power, mut geometric) = (self.rate, [1.0; LANES]);
        // 1 + q + … + q⁶³ = Π (1 + q^(2^j)).
        for _ in 0..BLOCK.trailing_zeros() {
            for lane in 0..LANES {
                geometric[lane] *= 1.0 + power[lane];
                power[lane] *= power[lane];
            }
        }
        let zero = [splat(simd, 0.0); CHANNELS];
        let (mut sum, mut whole) = (zero, zero);
        let (mut density, mut column) = (self.first, [0.0; LANES]);
        let mut start = 0;
        while start < self.steps {
            let end = self.steps.min(start + BLOCK);
            let mut longest = 0.0f64;
            for depth in self.depth.iter().take(CHANNELS) {
                for lane in 0..LANES {
                    longest = longest.max(depth[lane] * density[lane].max(density[lane] * power[lane]));
                }
            }
            let block = Block { march: self, steps: [start, end], density: &density, column: &column };
            let (lit, all) = if longest < SHORT {
                block.sums::<S, V, CHANNELS, PLAIN, true>(simd, visibility)
            } else {
                block.sums::<S, V, CHANNELS, PLAIN, false>(simd, visibility)
            };
            for channel in 0..CHANNELS {
                sum[channel] += lit[channel];
                whole[channel] += all[channel];
            }
            for lane in 0..LANES {
                column[lane] += density[lane] * geometric[lane];
                density[lane] *= power[lane];
            }
            start = end;
        }
        std::array::from_fn(|channel| {
            let channel = if channel < CHANNELS { channel } else { 0 };
            (sum[channel] / whole[channel]).into()
        })
    }
}

/// Steps that start from one set of numbers in f64.
struct Block<'a> {
    march: &'a FogSunMarch<'a>,
    steps: [u32; 2],
    /// Share of the densest step's density at the first one.
    density: &'a [f64; LANES],
    /// Sum of those of all steps before.
    column: &'a [f64; LANES],
}

impl Block<'_> {
    /// `Σ V·w` and `Σ w` of the block. `THIN`: no step has an optical depth of [`SHORT`].
    #[inline(always)]
    fn sums<S: Simd, V: Visibility<S>, const CHANNELS: usize, const PLAIN: bool, const THIN: bool>(
        &self,
        simd: S,
        visibility: V,
    ) -> ([Lanes<S>; CHANNELS], [Lanes<S>; CHANNELS]) {
        let march = self.march;
        let seeds: u32x16<S> = march.seeds.unwrap_or([0; LANES]).simd_into(simd);
        let rate = load(simd, &march.rate.map(|rate| rate as f32));
        let depth: [Lanes<S>; CHANNELS] =
            std::array::from_fn(|channel| load(simd, &march.depth[channel].map(|depth| depth as f32)));
        let mut through: [Lanes<S>; CHANNELS] = std::array::from_fn(|channel| {
            let before: [f32; LANES] =
                std::array::from_fn(|lane| (-march.depth[channel][lane] * self.column[lane]) as f32);
            exp(simd, load(simd, &before))
        });
        let mut density = load(simd, &self.density.map(|density| density as f32));
        let zero = [splat(simd, 0.0); CHANNELS];
        let (mut lit_sum, mut sum) = (zero, zero);
        let mut first = self.steps[0];
        while first < self.steps[1] {
            let (visibility, [_, after]) = visibility.stretch(first);
            let after = after.min(self.steps[1]);
            for step in first..after {
                let at = if PLAIN || march.seeds.is_none() {
                    splat(simd, step as f32 + 0.5)
                } else {
                    hashed(simd, seeds, step) + step as f32
                };
                let samples = SunSamples { index: at };
                let lit = one_where(simd, visibility.lit(simd, samples));
                let colours = match march.texture {
                    Some(texture) if !PLAIN => Some(texture.colour(simd, samples)),
                    _ => None,
                };
                for channel in 0..CHANNELS {
                    let x = density * depth[channel];
                    let mut p = splat(simd, 1.0 / 120.0);
                    for coefficient in [-1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
                        p = p.mul_add(x, splat(simd, coefficient));
                    }
                    let mut weight = through[channel] * (density * p);
                    let mut after = through[channel] - weight * depth[channel];
                    if !THIN {
                        let left = exp(simd, -x);
                        let is_short = x.simd_lt(splat(simd, SHORT as f32));
                        let long = through[channel] * ((splat(simd, 1.0) - left) / depth[channel]);
                        weight = is_short.select(weight, long);
                        after = is_short.select(after, through[channel] * left);
                    }
                    through[channel] = after;
                    sum[channel] += weight;
                    let seen = match &colours {
                        Some(colours) => lit * colours[channel],
                        None => lit,
                    };
                    lit_sum[channel] = weight.mul_add(seen, lit_sum[channel]);
                }
                density *= rate;
            }
            first = after;
        }
        (lit_sum, sum)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lookups::Clear;
    use super::*;
    use scatter_core::{Level, at_level};

    /// Lit in the steps before the given one.
    #[derive(Clone, Copy)]
    struct LitBefore(f32);

    impl<S: Simd> Visibility<S> for LitBefore {
        fn lit<P: super::super::lookups::Samples<S>>(
            &self,
            simd: S,
            samples: P,
        ) -> super::super::lanes::LaneMask<S> {
            let mut map = super::super::lookups::MapLanes::default();
            map.step[0] = [1.0; LANES];
            map.start[0] = [0.0; LANES];
            samples.position(simd, &map)[0].simd_lt(splat(simd, self.0))
        }
    }

    /// Both kinds of visibility through one door: closures cannot be generic.
    trait Shares {
        fn of(self, march: &FogSunMarch<'_>, level: Level) -> [[f32; LANES]; 3];
    }

    impl Shares for Clear {
        fn of(self, march: &FogSunMarch<'_>, level: Level) -> [[f32; LANES]; 3] {
            at_level!(level, simd => march.shares::<_, 3, true>(simd, self))
        }
    }

    impl Shares for LitBefore {
        fn of(self, march: &FogSunMarch<'_>, level: Level) -> [[f32; LANES]; 3] {
            at_level!(level, simd => march.shares::<_, 3, true>(simd, self))
        }
    }

    #[test]
    fn shares_are_those_of_the_closed_form_at_any_step_count() {
        let mut worst = 0.0f64;
        for level in [Level::new(), Level::baseline()] {
            for (log_density, slope) in [(0.0, 0.0), (-3.0, 0.2), (-40.0, -0.5), (1.0, -1e-7), (2.0, 3.0)] {
                for sigma in [1e-12, 1e-3, 0.4, 60.0, 1e9] {
                    for steps in [1, 7, 64, 65, 1000, 5000] {
                        let fog = FogRay::from_parts(log_density, slope);
                        let end = 90.0;
                        let span = super::super::fog_window::fog_window(&fog, end, sigma);
                        let sigma_t = [sigma, 0.25 * sigma, 0.0];
                        let march = FogSunMarch::new(steps, sigma_t, (&[fog; LANES], &[span; LANES]), None);
                        for channel in Clear.of(&march, level) {
                            assert_eq!(channel, [1.0; LANES]);
                        }
                        let half = steps.div_ceil(2);
                        let found = LitBefore(half as f32).of(&march, level);
                        let cut = span.start + (span.end - span.start) / f64::from(steps) * f64::from(half);
                        for (channel, sigma) in found.iter().zip(sigma_t) {
                            let lit = fog.sun_interval(sigma, span.start, cut);
                            let exact = lit / fog.sun_interval(sigma, span.start, span.end);
                            let error = (f64::from(channel[5]) - exact).abs();
                            assert!(error < 2e-5, "{fog:?} σ {sigma} n {steps}: {} {exact}", channel[5]);
                            worst = worst.max(error);
                        }
                    }
                }
            }
        }
        println!("shares of a sun in height fog: worst error {worst:.1e}");
    }
}
