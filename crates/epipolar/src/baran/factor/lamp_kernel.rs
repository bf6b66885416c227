//! The integrand of a lamp along a view ray, in angles: `A(g, b) = e^{−σL·(C − 1)}·p(b + g)`, and where it is sampled.
//!
//! Eye O, lamp P, L = |OP|; b the angle at O between view ray and the way to P, g the angle at P between the way to O
//! and the light ray. Then by the law of sines the point lies at `s = L·sin g/sin(b+g)` from the eye and
//! `d = L·sin b/sin(b+g)` from the lamp, `ds/d² = dg/(L·sin b)`, and
//!
//! ```text
//! (s + d)/L = C = cos((b−g)/2)/cos((b+g)/2),   C − 1 = 2·sin(b/2)·sin(g/2)/cos((b+g)/2).
//! ```
//!
//! The third angle of the triangle is π − b − g and light travels away from P, so the phase angle between its travel
//! and the way to the camera is θ = b + g: forward scattering sits where both angles are small. `1/(L·sin b)` and
//! `e^{−σL}` are constant along a ray and cancel in vis.
//!
//! A ray at b has `g < π − b`, and less where it ends. Behind that the function goes on smoothly, never to a step: C is
//! bent to a constant in `q = tan(b/2)·tan(g/2)`, on which alone it depends, `C = (1 + q)/(1 − q)`.

use std::f64::consts::PI;

/// One channel of a medium around a lamp, as an eye sees it.
pub struct LampMedium<'a> {
    /// σt·L: extinction times the distance between eye and lamp. ≥ 0.
    pub optical_depth: f64,
    /// Length of the longest view ray over L. > 0; a ray without an end counts as 10⁶.
    pub reach: f64,
    /// Scattering by the haversine `sin²(θ/2)` of the phase angle, ≥ 0, in any unit: one channel of
    /// `Medium::scattering_towards`.
    pub phase: &'a dyn Fn(f64) -> f64,
}

/// Sine and cosine of half an angle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Half {
    sin: f64,
    cos: f64,
}

/// The integrand.
pub(super) struct Kernel<'a> {
    depth: f64,
    reach: f64,
    phase: &'a dyn Fn(f64) -> f64,
    /// What the phase function is divided by.
    phase_unit: f64,
    /// Angles in which the phase function falls by half, from θ = 0 and from θ = π.
    lobes: [f64; 2],
}

/// Values of g at which a band is sampled, and what they stand for in an integral.
#[derive(Default, Debug, Clone)]
pub(super) struct Grid {
    pub(super) g: Vec<f64>,
    pub(super) half: Vec<Half>,
    /// Trapezoidal weights.
    pub(super) weight: Vec<f64>,
}

impl Half {
    /// Of an angle, in radians.
    pub(super) fn of(angle: f64) -> Self {
        let (sin, cos) = (0.5 * angle).sin_cos();
        Self { sin, cos }
    }
}

impl<'a> Kernel<'a> {
    /// Of a medium; numbers that are none, or out of range, are taken to the nearest that are usable.
    pub(super) fn new(medium: &LampMedium<'a>) -> Self {
        let phase = medium.phase;
        let lobe = |haversine: &dyn Fn(f64) -> f64| {
            let peak = phase(haversine(0.0));
            // Halvings of the angle; the narrowest lobe of the model, |g| = 0.9999, is 1e-4 wide.
            (0..16)
                .map(|k| PI * 0.5f64.powi(k))
                .find(|&angle| phase(haversine((0.25 * angle).sin().powi(2))) > 0.5 * peak)
                .unwrap_or(1e-4)
        };
        Self {
            depth: within(medium.optical_depth, 0.0, 1e4),
            reach: within(medium.reach, 1e-3, 1e6),
            phase,
            phase_unit: phase(0.0) + phase(0.5) + phase(1.0),
            lobes: [lobe(&|h| h), lobe(&|h| 1.0 - h)],
        }
    }

    /// `A(g, b)`, continued behind the end of the ray; > 0 wherever the exponential has not underflowed.
    pub(super) fn value(&self, b: Half, g: Half) -> f64 {
        // d ≤ s + L, so C − 1 ≤ 2·reach; q there is c/(c + 2).
        let longest = 2.0 * self.reach;
        let product = b.sin * g.sin;
        let cos = b.cos * g.cos - product;
        let extra = if 2.0 * product <= longest * cos {
            2.0 * product / cos
        } else {
            // c·(1 + u/(1 + u)), equal in value and slope: d(C − 1)/dq = (c + 2)²/2 there.
            let from = longest / (longest + 2.0);
            let beyond = product / (b.cos * g.cos).max(1e-300) - from;
            let u = 0.5 * (longest + 2.0).powi(2) / longest * beyond.clamp(0.0, 1e100);
            longest * (1.0 + u / (1.0 + u))
        };
        let sin = b.sin * g.cos + b.cos * g.sin;
        let phase = if self.phase_unit > 0.0 { (self.phase)(sin * sin) / self.phase_unit } else { 1.0 };
        (-self.depth * extra).exp() * phase.max(1e-30)
    }

    /// The largest g of a ray at `b`.
    pub(super) fn end(&self, b: f64) -> f64 {
        (self.reach * b.sin()).atan2(1.0 - self.reach * b.cos())
    }

    /// The angle below which nothing changes on a smaller scale of b.
    ///
    /// That is the forward lobe's, or where the exponent becomes 1 half way round the lamp, at most 0.05: even in thin
    /// media a ray that passes the lamp at b changes within b of g = π, which is the share b/π of its light.
    pub(super) fn scale(&self) -> f64 {
        self.lobes[0].min(0.05).min(1.0 / (1.0 + self.depth))
    }

    /// The length in g that tables must resolve for `b ∈ [b_min, b_max]`.
    pub(super) fn feature(&self, b_min: f64, b_max: f64) -> f64 {
        // With 70 nodes a feature the trapezoidal rule errs by 1e-4 of what lies in it. A layer of width w at the end holds
        // w/π of a ray, and this length in its place makes that 1e-4 of the ray.
        self.near_feature(b_min, b_max).min(self.far_feature(b_min, b_max, 1.75))
    }

    /// The length in g over which A changes near g = 0: by the forward lobe or by the exponent.
    fn near_feature(&self, b_min: f64, b_max: f64) -> f64 {
        (b_min + 0.5 * self.lobes[0]).min(1.0 / (1.0 + self.depth * (0.5 * b_max).tan()))
    }

    /// The length in g over which A changes towards the far end of a ray, where b + g is nearly π.
    ///
    /// That is half of the backward lobe, or w = `σL·sin b`, half of the distance from g = π − b at which the exponent is 1;
    /// and no less than what the longest ray misses of it. As a layer that thin holds w/π of a ray, `thin·√w` will do.
    fn far_feature(&self, b_min: f64, b_max: f64, thin: f64) -> f64 {
        let at = |b: f64| {
            let missed = (PI - b - self.end(b)).max(0.0);
            let layer = self.depth * b.sin();
            // Less than 5e-4 is too little light for anything.
            let layer = if layer < 5e-4 { PI } else { layer.max(missed) };
            layer.max(thin * layer.sqrt()).min(0.5 * self.lobes[1] + missed)
        };
        at(b_min).min(at(0.5 * (b_min + b_max))).min(at(b_max))
    }

    /// Samples of g for `b ∈ [b_min, b_max]`: steps in proportion to the distance from both lobes and both ends.
    ///
    /// False where that took too many: the rest is not sampled.
    pub(super) fn grid(&self, b_min: f64, b_max: f64, grid: &mut Grid) -> bool {
        /// Of that distance. Half of it moves the measured errors by a tenth.
        const STEP: f64 = 0.1;
        /// Enough for a band as wide as a backward lobe of g = −0.99 lets eight products reach.
        const MOST: usize = 1500;
        let ends = (0..=16).map(|i| self.end(b_min + (b_max - b_min) * f64::from(i) / 16.0));
        let (shortest, longest) = ends.fold((PI, 1e-6f64), |(s, l), end| (end.min(s), end.max(l)));
        let near = self.near_feature(b_min, b_max).min(0.5 * shortest.max(1e-3 * longest));
        let Grid { g: samples, half, weight } = grid;
        samples.clear();
        // Steps of a third of a layer that holds 1 % of a ray are enough for errors of 1e-3.
        let far = self.far_feature(b_min, b_max, 0.35);
        let mut g = 0.0;
        while samples.len() + 1 < MOST && g < longest {
            samples.push(g);
            let from_back = (PI - b_max - g).max(0.0) + far;
            let from_end = PI - g + 0.3 * self.scale();
            g += (STEP * (near + g).min(from_back).min(from_end)).min(PI / 40.0);
        }
        let resolved = g >= longest;
        samples.push(longest);
        half.clear();
        half.extend(samples.iter().map(|&g| Half::of(g)));
        let last = samples.len() - 1;
        weight.clear();
        weight.extend((0..=last).map(|i| 0.5 * (samples[(i + 1).min(last)] - samples[i.saturating_sub(1)])));
        resolved
    }
}

/// The nearest to `value` in [low, high]; `low` for what is no number.
pub(super) fn within(value: f64, low: f64, high: f64) -> f64 {
    if value > low { value.min(high) } else { low }
}
