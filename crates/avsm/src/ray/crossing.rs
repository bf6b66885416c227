//! A view ray across one texel of adaptive curves: all stretches between nodes at once, in lanes of f32.
//!
//! ```text
//! stretch k of the curve runs from node k to node k + 1; cut to the crossing's depths it may be empty
//! share of the crossing       w_a … w_b, 0 to 1, in the order of depths
//! exponent at its ends        A = τ + σ·L·w        (suns; against the ray: σ·L·(1 − w))
//! its integral                (w_b − w_a)·(e^{−A_a} − e^{−A_b})/(A_b − A_a)
//! ```
//!
//! No lane looks for its place and none branches: stretches that lie outside have no length. The last one has no end, and before
//! the first node τ is 0. Where the light's own radiance is no exponential (lamps, height fog), it is taken as a parabola over
//! the crossing, whose integral follows from the centroid and the variance of each stretch's transmittance.

use scatter_core::exp_f32;

/// A ray's way through one texel.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Ray parameters of its ends \[world units\], the smaller one first.
    pub t: [f64; 2],
    /// Depths at its ends, the smaller one first.
    pub depths: [f64; 2],
    /// Whether depth grows along the ray.
    pub is_along: bool,
    /// Depth at the ray parameter 0, and its growth for a unit of it.
    pub line: [f64; 2],
}

impl Crossing {
    /// Whether f32 tells places on it apart: its depths are more than rounding, and it ends.
    pub fn is_resolved(&self) -> bool {
        let [near, far] = self.depths;
        // At the least, a node is misplaced by 6e-8/1e-4 of the crossing.
        far - near > 1e-4 * far.abs().max(near.abs()) && self.t[1] < f64::INFINITY
    }

    /// The ray parameter at which the ray has a depth.
    pub fn parameter_at(&self, depth: f64) -> f64 {
        (depth - self.line[0]) / self.line[1]
    }

    /// The ray parameter of a share of the crossing in the order of depths.
    pub fn at(&self, share: f64) -> f64 {
        let [a, b] = self.t;
        let share = if self.is_along { share } else { 1.0 - share };
        a + (b - a) * share
    }
}

/// Shares and optical depths of a curve's stretches, cut to a crossing.
struct Stretches<const N: usize> {
    from: [f32; N],
    length: [f32; N],
    sum: [f32; N],
    growth: [f32; N],
    /// The share before the first node.
    clear: f32,
}

#[inline(always)]
fn stretches<const N: usize>(depths: &[f32; N], sums: &[f32; N], crossing: &Crossing) -> Stretches<N> {
    let [near, far] = crossing.depths.map(|depth| depth as f32);
    let scale = 1.0 / (far - near);
    let mut found =
        Stretches { from: [0.0; N], length: [0.0; N], sum: [0.0; N], growth: [0.0; N], clear: 0.0 };
    let next = |values: &[f32; N], last: f32| {
        let mut next = [last; N];
        next[..N - 1].copy_from_slice(&values[1..]);
        next
    };
    let (ends, end_sums) = (next(depths, f32::INFINITY), next(sums, sums[N - 1]));
    for k in 0..N {
        let (from, to) = (depths[k].max(near).min(far), ends[k].max(near).min(far));
        let span = ends[k] - depths[k];
        // Free nodes lie at ∞, a step has no span.
        let rate = (end_sums[k] - sums[k]) / span;
        let rate = if span > 0.0 && span < f32::INFINITY { rate } else { 0.0 };
        let sum_at = |depth: f32| sums[k] + (depth - depths[k]).max(0.0) * rate;
        found.from[k] = (from - near) * scale;
        found.length[k] = (to - from) * scale;
        found.sum[k] = sum_at(from);
        found.growth[k] = sum_at(to) - sum_at(from);
    }
    found.clear = ((depths[0].min(far) - near) * scale).max(0.0);
    found
}

/// `∫₀¹ e^{−xs} ds` for a stretch with `start = e^{0}` scaled in: (start − end)/x, by its series where that cancels.
#[inline(always)]
fn mean(start: f32, end: f32, x: f32) -> f32 {
    // The next term of the series is x⁴/120: 5e-8.
    let series = start * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0))));
    let quotient = (start - end) / x;
    if x.abs() < 0.05 { series } else { quotient }
}

/// The mean of `e^{−τ − σ(t − t_min)}` over a crossing, `optical_depth = σ·(t_max − t_min)` ≥ 0. Relative error 1e-5, and 6e-8 of
/// a depth over the crossing's for the place of a node.
#[inline(always)]
pub fn mean_under_sun<const N: usize>(
    depths: &[f32; N],
    sums: &[f32; N],
    crossing: &Crossing,
    optical_depth: f32,
) -> f32 {
    let cut = stretches(depths, sums, crossing);
    let (offset, slope) =
        if crossing.is_along { (0.0, optical_depth) } else { (optical_depth, -optical_depth) };
    let mut total = 0.0;
    let mut means = [0.0f32; N];
    for (k, value) in means.iter_mut().enumerate() {
        let start = cut.sum[k] + offset + slope * cut.from[k];
        let x = cut.growth[k] + slope * cut.length[k];
        *value = cut.length[k] * mean(exp_f32(-start), exp_f32(-(start + x)), x);
    }
    for value in means {
        total += value;
    }
    if cut.clear > 0.0 {
        let x = slope * cut.clear;
        total += cut.clear * mean(exp_f32(-offset), exp_f32(-(offset + x)), x);
    }
    total
}

/// The mean of `e^{−τ}·(f_0 + f_1·w + f_2·w²)` over a crossing, w the share in the order of depths: coefficients of three
/// channels. To 1e-4 of it.
#[inline(always)]
pub fn mean_of_parabola<const N: usize>(
    depths: &[f32; N],
    sums: &[f32; N],
    crossing: &Crossing,
    coefficients: &[[f32; 3]; 3],
) -> [f32; 3] {
    let cut = stretches(depths, sums, crossing);
    // Zeroth, first and second moment of the transmittance over w.
    let [mut zeroth, mut first, mut second] = [[0.0f32; N]; 3];
    for (k, ((zeroth, first), second)) in zeroth.iter_mut().zip(&mut first).zip(&mut second).enumerate() {
        let x = cut.growth[k];
        let (start, end) = (exp_f32(-cut.sum[k]), exp_f32(-(cut.sum[k] + x)));
        let weight = cut.length[k] * mean(start, end, x);
        // The centroid of e^{−xs} on 0 … 1: 1/x − 1/(eˣ − 1).
        let lost = (start - end).max(f32::MIN_POSITIVE);
        let series = 0.5 - x * (1.0 / 12.0 - x * x * (1.0 / 720.0));
        let centroid = if x < 1.0 { series } else { 1.0 / x - end / lost };
        // Its variance: 1/x² − eˣ/(eˣ − 1)².
        let series = 1.0 / 12.0 - x * x * (1.0 / 240.0);
        let variance = if x < 1.0 { series } else { 1.0 / (x * x) - start * (end / lost) / lost };
        let place = cut.from[k] + cut.length[k] * centroid;
        *zeroth = weight;
        *first = weight * place;
        *second = weight * (place * place + cut.length[k] * cut.length[k] * variance);
    }
    let [zeroth, first, second] = [zeroth, first, second].map(|values| values.iter().sum::<f32>());
    let clear = cut.clear;
    let [zeroth, first, second] =
        [zeroth + clear, first + 0.5 * clear * clear, second + clear * clear * clear * (1.0 / 3.0)];
    std::array::from_fn(|channel| {
        let [constant, linear, square] = coefficients.map(|values| values[channel]);
        constant * zeroth + linear * first + square * second
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::TransmittanceCurve;
    use crate::curves::avsm::AvsmCurve;
    use scatter_core::TranslucentSegment;

    /// Sums over 20,000 points of the crossing, of random curves that begin before it, in it and behind it.
    #[test]
    fn means_are_sums_over_many_points() {
        let mut worst = 0.0f64;
        for seed in 0..60u32 {
            let at = |n: u32| (f64::from(n * 31 + seed * 17) * 0.618_034).fract();
            let mut curve = AvsmCurve::<8>::default();
            for n in 0..seed % 9 {
                let entry = 10.0 * at(n) as f32;
                let length = if n % 3 == 0 { 0.0 } else { 3.0 * at(n + 50) as f32 };
                curve.insert(&TranslucentSegment {
                    entry,
                    exit: entry + length,
                    optical_depth: if n == 7 { f32::INFINITY } else { 2.0 * at(n + 90) as f32 },
                });
            }
            let (depths, sums) = curve.lanes();
            let near = 8.0 * at(1);
            let depths_crossed = [near, near + 0.05 + 4.0 * at(2)];
            let crossing = Crossing {
                t: [2.0, 2.7],
                depths: depths_crossed,
                is_along: seed % 2 == 0,
                line: [f64::NAN; 2],
            };
            let depth_at = |w: f64| crossing.depths[0] + w * (crossing.depths[1] - crossing.depths[0]);
            let count = 20_000;
            let sum = |weight: &dyn Fn(f64) -> f64| {
                (0..count)
                    .map(|n| (f64::from(n) + 0.5) / f64::from(count))
                    .map(|w| curve.transmittance(depth_at(w)) * weight(w) / f64::from(count))
                    .sum::<f64>()
            };
            for optical_depth in [0.0, 1e-6, 0.03, 0.8, 7.0] {
                let expected = sum(&|w| (-optical_depth * (crossing.at(w) - 2.0) / 0.7).exp());
                let found = f64::from(mean_under_sun(depths, sums, &crossing, optical_depth as f32));
                worst = worst.max((found - expected).abs());
            }
            let parabola = [[1.0f32, 2.0, 0.5], [-0.3, 0.6, 0.5], [0.1, 0.0, -0.2]];
            let found = mean_of_parabola(depths, sums, &crossing, &parabola);
            for channel in 0..3 {
                let [constant, linear, square] = parabola.map(|values| f64::from(values[channel]));
                let expected = sum(&|w| constant + linear * w + square * w * w);
                worst = worst.max((f64::from(found[channel]) - expected).abs());
            }
        }
        // Of sums at midpoints a step is off by half a point, eight of them by 2e-4.
        println!("worst {worst:.1e} of 2e-4");
        assert!(worst < 2e-4, "{worst}");
    }
}
