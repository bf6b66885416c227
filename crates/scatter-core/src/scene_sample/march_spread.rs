//! How far a march of n steps is off on one ray, for the n of a ladder: the standard deviation over where steps lie.
//!
//! A march counts the steps whose middle is lit. A lit stretch that is f steps long is counted as ⌊f⌋ or ⌈f⌉ steps, so where it
//! is shorter than one, the variance is f(1 − f) squared steps, and a sixth (two edges that are a twelfth each) where it is
//! longer.

/// Steps for which spreads are kept: 2³ to 2¹⁴.
const MARCH_STEPS: usize = 12;
const FIRST_POWER: f64 = 3.0;

/// Standard deviations of the radiance, a number of steps each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MarchSpread {
    log2: [f32; MARCH_STEPS],
}

/// Sums of variances.
#[derive(Debug, Clone, Copy, Default)]
pub struct Variances([f64; MARCH_STEPS]);

impl Variances {
    /// Adds a lit stretch: its length over that of the whole ray, both in what steps are even in; its light; and how many of
    /// its ends are edges of shadows.
    pub fn add(&mut self, share: f64, light: f64, edges: u32) {
        if edges == 0 || !(share > 0.0) {
            return;
        }
        for (power, sum) in self.0.iter_mut().enumerate() {
            let steps = (FIRST_POWER + power as f64).exp2();
            let length = share * steps;
            let variance =
                if edges > 1 && length < 1.0 { length * (1.0 - length) } else { f64::from(edges) / 12.0 };
            // The light of a step.
            *sum += variance * (light / length).powi(2);
        }
    }

    /// Their roots.
    pub fn spread(&self) -> MarchSpread {
        // A stretch far below all steps is nearly never met: no light, and no deviation either.
        MarchSpread { log2: self.0.map(|variance| (0.5 * variance.log2()).max(-1e3) as f32) }
    }
}

/// Numbers of steps for which errors of whole pictures are kept, and those between them by powers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MarchErrors {
    /// p99 and RMS over the mean.
    p99: MarchSpread,
    rms: MarchSpread,
}

impl MarchErrors {
    /// Of rays with these spreads, each with what its own is relative to, and of a picture with that mean.
    pub fn of(rays: &[(MarchSpread, f64)], mean: f64) -> Self {
        let mut errors = [[f32::NEG_INFINITY; MARCH_STEPS]; 2];
        for power in 0..MARCH_STEPS {
            let spread = |ray: &(MarchSpread, f64)| f64::from(ray.0.log2[power]).exp2();
            let squares: f64 = rays.iter().map(|ray| spread(ray).powi(2)).sum();
            let relative: Vec<f64> = rays.iter().map(|ray| spread(ray) / ray.1).collect();
            let rms = (squares / rays.len().max(1) as f64).sqrt() / mean;
            let p99 = quantile_of_spreads(&relative, 0.01);
            for (kept, error) in errors.iter_mut().zip([p99, rms]) {
                kept[power] = error.log2().max(-1e3) as f32;
            }
        }
        let [p99, rms] = errors.map(|log2| MarchSpread { log2 });
        Self { p99, rms }
    }

    /// p99 and RMS over the mean at a number of steps.
    pub fn at(&self, steps: f64) -> [f64; 2] {
        [self.p99.at(steps), self.rms.at(steps)]
    }
}

impl MarchSpread {
    /// The deviation at a number of steps ≥ 1, between those that are kept by powers.
    pub fn at(&self, steps: f64) -> f64 {
        let place = steps.max(1.0).log2() - FIRST_POWER;
        let low = place.floor().clamp(0.0, (MARCH_STEPS - 2) as f64);
        let [a, b] = [self.log2[low as usize], self.log2[low as usize + 1]].map(f64::from);
        (a + (b - a) * (place - low)).exp2()
    }
}

/// The value that a share of normal deviations with these spreads, mixed in equal parts, exceed in size.
fn quantile_of_spreads(spreads: &[f64], share: f64) -> f64 {
    let largest = spreads.iter().copied().fold(0.0, f64::max);
    if !(largest > 0.0) {
        return 0.0;
    }
    let beyond = |x: f64| {
        let of = |&spread: &f64| if spread > 0.0 { two_sided_tail(x / spread) } else { 0.0 };
        spreads.iter().map(of).sum::<f64>() / spreads.len() as f64
    };
    let (mut low, mut high) = (0.0, 6.0 * largest);
    // To 6·2⁻¹⁸ of the largest spread.
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        if beyond(middle) > share { low = middle } else { high = middle }
    }
    high
}

/// P(|N(0,1)| > x) for x ≥ 0: `erfc(x/√2)` by Abramowitz and Stegun 7.1.26, to 1.5e-7.
fn two_sided_tail(x: f64) -> f64 {
    if x > 6.0 {
        return 0.0;
    }
    let z = x * std::f64::consts::FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let polynomial = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    polynomial.into_iter().fold(0.0, |sum, term| sum * t + term) * t * (-z * z).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_are_those_of_counted_middles() {
        // Light 1 on a share of the ray, at 997 places: the deviation of the counted share.
        for share in [0.37, 0.011, 1.3e-3] {
            let mut variances = Variances::default();
            variances.add(share, 1.0, 2);
            let spread = variances.spread();
            for steps in [64.0, 512.0] {
                let squares = (0..997).map(|n| {
                    let from = 0.3 + f64::from(n) / 997.0 / steps;
                    let middles = |t: f64| (t * steps + 0.5).floor();
                    let counted = middles(from + share) - middles(from);
                    (counted / steps / share - 1.0).powi(2)
                });
                let expected = (squares.sum::<f64>() / 997.0).sqrt();
                // Of longer stretches the fraction of a step that is left over is not looked at: it moves the deviation by √(3/2)
                // at the most, and to nothing where there is none.
                let ratio = spread.at(steps) / expected;
                let within = if share * steps < 1.0 { 1.01 } else { 2.0 };
                assert!(ratio < within && ratio > 1.0 / 1.3, "{share} {steps}: {ratio}");
            }
        }
    }

    #[test]
    fn the_quantile_of_equal_spreads_is_the_normal_one() {
        assert!((quantile_of_spreads(&[0.5; 7], 0.01) - 0.5 * 2.575_83).abs() < 1e-4);
        // Half of them are right: one in fifty of the others.
        assert!((quantile_of_spreads(&[0.0, 2.0], 0.01) - 2.0 * 2.326_35).abs() < 1e-4);
        assert_eq!(quantile_of_spreads(&[0.0; 3], 0.01), 0.0);
        assert_eq!(quantile_of_spreads(&[], 0.01), 0.0);
    }
}
