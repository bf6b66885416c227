//! One Gauss-Legendre panel of the airlight integral, sixteen rays at a time in f32.
//!
//! The integral of `2/(1+r²)·phase·C·e^{−κr}` over `[r₀, r₁]`, by points in x where `r = N/M`, N and M linear in x,
//! `r(½) = √(r₀r₁)`. That is ln r to second order, at the price of a quotient: `2dr/(1+r²)` becomes
//! `2(r₁−r₀)√(r₀/r₁)·dx/(M²+N²)`, and sin²(θ/2) = N²/(M²+N²).
//!
//! No operation is fused, so that every instruction set gives the same bits.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};
use glam::DVec3;

use crate::medium::{Medium, Scattering};
use crate::phase::{INV_4PI, Phase};

/// A lane a ray.
pub(crate) type Lanes<S> = f32x16<S>;

/// Points and weights on [0, 1], and how long a panel may be.
pub(crate) struct Rule {
    /// Largest `r₁/r₀ − 1`.
    growth: f32,
    /// The same where the cone fades.
    fading_growth: f32,
    /// Largest optical depth.
    pub(crate) optical_depth: f32,
    points: &'static [[f32; 2]],
}

/// Gauss-Legendre (Abramowitz and Stegun, table 25.4), 4, 6, 8 and 12 points.
///
/// `growth` is e^0.75, e^1.75, e^2.6 and e^4.1, less 1: up to there a panel's error is ≤ 6e-6 of it for every |g| ≤ 0.99,
/// place on the ray and optical depth up to the one named. A cone's factor is a square of the second degree, times up to
/// 10⁶: there it is e^0.15, e^0.9, e^1.75 and e^3.2, for 8e-6 of the panel without the cone. Longer panels fail the tests
/// of [`LampIntegralF32`](crate::LampIntegralF32).
pub(crate) const RULES: [Rule; 4] = [
    Rule { growth: 1.117, fading_growth: 0.161, optical_depth: 2.0, points: &FOUR },
    Rule { growth: 4.75, fading_growth: 1.459, optical_depth: 4.0, points: &SIX },
    Rule { growth: 12.46, fading_growth: 4.75, optical_depth: 8.0, points: &EIGHT },
    Rule { growth: 59.3, fading_growth: 23.5, optical_depth: 8.0, points: &TWELVE },
];

/// A panel `[start + from, start + from + step]` in r, start that of the piece.
pub(crate) struct Panel<S: Simd> {
    pub(crate) simd: S,
    pub(crate) start: Lanes<S>,
    pub(crate) from: Lanes<S>,
    pub(crate) step: Lanes<S>,
}

/// How a medium scatters at the points of a panel, in `C` channels.
pub(crate) trait Scatter<const C: usize> {
    /// `1/M`, and `phase/(M²+N²)` by channel.
    fn at<S: Simd>(&self, simd: S, point: &Point<S>) -> (Lanes<S>, [Lanes<S>; C]);
}

/// `r = N/M`.
pub(crate) struct Point<S: Simd> {
    m: Lanes<S>,
    m_sq: Lanes<S>,
    n_sq: Lanes<S>,
    /// M² + N².
    sum_sq: Lanes<S>,
}

/// Isotropic, without the constant.
pub(crate) struct Even;

/// Henyey-Greenstein, without its constant [`Lobe::strength`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lobe {
    gap_sq: f32,
    /// 4·|g| for the sine where g > 0, for the cosine where g < 0.
    of_sin: f32,
    of_cos: f32,
}

/// Any medium, all three channels with its σs.
#[derive(Debug, Clone)]
pub(crate) struct Mixed<'a> {
    /// `Σ σs/4π` of what is isotropic, and `Σ 3σs/16π` of what is Rayleigh's.
    isotropic: [f32; 3],
    rayleigh: [f32; 3],
    /// Of these the lobes: few enough to be made again at each point, so that a frame allocates nothing.
    components: &'a [Scattering],
}

/// A cone along each ray: `saturate((along·(N²−M²)/(M²+N²) + across·2MN/(M²+N²) − cos outer)·slope)²`.
pub(crate) struct Fading<S: Simd> {
    pub(crate) along: Lanes<S>,
    pub(crate) across: Lanes<S>,
    pub(crate) cos_outer: f32,
    pub(crate) slope: f32,
}

impl Rule {
    /// Largest `r₁/r₀ − 1`, with or without a cone that fades.
    #[inline(always)]
    pub(crate) fn growth(&self, fades: bool) -> f32 {
        if fades { self.fading_growth } else { self.growth }
    }

    /// Adds a panel's integral to the sums. `exponents` are −σh·log₂e by channel, the first one for all if
    /// `shared`; attenuation counts from the piece's start.
    #[inline(always)]
    pub(crate) fn add<S: Simd, const C: usize>(
        &self,
        panel: &Panel<S>,
        air: &impl Scatter<C>,
        exponents: &[Lanes<S>; C],
        shared: bool,
        fading: Option<&Fading<S>>,
        sums: &mut [Lanes<S>; C],
    ) {
        let simd = panel.simd;
        let begin = panel.start + panel.from;
        let end = begin + panel.step;
        let tilt = (begin / end).sqrt();
        // M = 1 + x·(tilt − 1), N = r₀·M + x·rise, and r − r₀ = x·rise/M without cancellation.
        let (slope, rise) = (tilt - 1.0, panel.step * tilt);
        let n_slope = begin * slope + rise;
        let (mut depth, mut steps) = (*exponents, *exponents);
        for c in 0..C {
            depth[c] *= panel.from;
            steps[c] *= rise;
        }
        let mut integral = [Lanes::splat(simd, 0.0); C];
        for &[x, weight] in self.points {
            let m = slope * x + 1.0;
            let n = n_slope * x + begin;
            let (m_sq, n_sq) = (m * m, n * n);
            let point = Point { m, m_sq, n_sq, sum_sq: m_sq + n_sq };
            let (inverse_m, scattered) = air.at(simd, &point);
            let way = inverse_m * x;
            let weight = match fading {
                None => Lanes::splat(simd, weight),
                Some(fading) => fading.at(simd, &point, n) * weight,
            };
            let mut attenuation = weight;
            for c in 0..C {
                if c == 0 || !shared {
                    attenuation = exp2(simd, steps[c] * way + depth[c]) * weight;
                }
                integral[c] = scattered[c] * attenuation + integral[c];
            }
        }
        for c in 0..C {
            sums[c] = (rise + rise) * integral[c] + sums[c];
        }
    }
}

impl Scatter<1> for Even {
    #[inline(always)]
    fn at<S: Simd>(&self, _: S, point: &Point<S>) -> (Lanes<S>, [Lanes<S>; 1]) {
        let inverse = 1.0 / (point.m * point.sum_sq);
        (inverse * point.sum_sq, [inverse * point.m])
    }
}

impl Lobe {
    #[inline(always)]
    pub(crate) fn new(g: f64) -> Self {
        let gap = 1.0 - g.abs();
        let four_g = (4.0 * g.abs()) as f32;
        Self {
            gap_sq: (gap * gap) as f32,
            of_sin: if g >= 0.0 { four_g } else { 0.0 },
            of_cos: if g >= 0.0 { 0.0 } else { four_g },
        }
    }

    /// `(1 − g²)/4π`.
    #[inline(always)]
    pub(crate) fn strength(g: f64) -> f64 {
        INV_4PI * (1.0 - g.abs()) * (1.0 + g.abs())
    }

    /// `(gap² + 4|g|·sin²(θ/2))·(M²+N²)`: a sum of terms ≥ 0.
    #[inline(always)]
    fn denominator<S: Simd>(&self, point: &Point<S>) -> Lanes<S> {
        let tail = point.n_sq * self.of_sin + point.m_sq * self.of_cos;
        point.sum_sq * self.gap_sq + tail
    }
}

impl Scatter<1> for Lobe {
    #[inline(always)]
    fn at<S: Simd>(&self, _: S, point: &Point<S>) -> (Lanes<S>, [Lanes<S>; 1]) {
        // (Q/n)^{3/2}/Q = √(Q/n)/n: one division for it and 1/M.
        let denominator = self.denominator(point);
        let inverse = 1.0 / (point.m * denominator);
        let of_denominator = inverse * point.m;
        (inverse * denominator, [(point.sum_sq * of_denominator).sqrt() * of_denominator])
    }
}

impl<'a> Mixed<'a> {
    pub(crate) fn new(medium: &'a Medium) -> Self {
        let mut mixed = Self { isotropic: [0.0; 3], rayleigh: [0.0; 3], components: medium.components() };
        for component in medium.components() {
            let times = |factor: f64| (DVec3::from(component.sigma_s) * factor).as_vec3();
            let add =
                |sum: &mut [f32; 3], term: glam::Vec3| *sum = (glam::Vec3::from(*sum) + term).to_array();
            match component.phase {
                Phase::Isotropic | Phase::HenyeyGreenstein { g: 0.0 } => {
                    add(&mut mixed.isotropic, times(INV_4PI));
                }
                Phase::Rayleigh => add(&mut mixed.rayleigh, times(0.75 * INV_4PI)),
                Phase::HenyeyGreenstein { .. } => {}
            }
        }
        mixed
    }
}

impl Scatter<3> for Mixed<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, point: &Point<S>) -> (Lanes<S>, [Lanes<S>; 3]) {
        let inverse = 1.0 / (point.m * point.sum_sq);
        let even = inverse * point.m;
        let cos = (point.m_sq - point.n_sq) * even;
        let rayleigh = cos * cos + 1.0;
        let mut sums = [even; 3];
        for (sum, (rayleigh_s, isotropic_s)) in sums.iter_mut().zip(self.rayleigh.iter().zip(&self.isotropic))
        {
            *sum *= rayleigh * *rayleigh_s + *isotropic_s;
        }
        for component in self.components {
            let Phase::HenyeyGreenstein { g } = component.phase else { continue };
            if g == 0.0 {
                continue;
            }
            let of_denominator = Lanes::splat(simd, 1.0) / Lobe::new(g).denominator(point);
            let value = (point.sum_sq * of_denominator).sqrt() * of_denominator;
            let strength = Lobe::strength(g);
            for (sum, sigma_s) in sums.iter_mut().zip(component.sigma_s) {
                *sum += value * ((sigma_s * strength) as f32);
            }
        }
        (inverse * point.sum_sq, sums)
    }
}

impl<S: Simd> Fading<S> {
    #[inline(always)]
    fn at(&self, simd: S, point: &Point<S>, n: Lanes<S>) -> Lanes<S> {
        let across = self.across * (point.m * n) * 2.0;
        let cos = ((point.n_sq - point.m_sq) * self.along + across) / point.sum_sq;
        let share = (cos - self.cos_outer) * self.slope;
        let share = share.max(Lanes::splat(simd, 0.0)).min(Lanes::splat(simd, 1.0));
        share * share
    }
}

/// `2ˣ` for x ≤ 0, at least 2⁻¹²⁵: relative error ≤ 3e-7.
#[inline(always)]
pub(crate) fn exp2<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    // Adding 1.5·2²³ rounds to a whole number, which is then in the last bits.
    const ROUND: f32 = 12_582_912.0;
    // 2ᶠ on [−½, ½] by interpolation at Chebyshev's points.
    const POLYNOMIAL: [f32; 5] =
        [0.001_339_086_3, 0.009_676_032, 0.055_503_57, 0.240_221_07, std::f32::consts::LN_2];
    let x = x.max(Lanes::splat(simd, -125.0));
    let shifted = x + ROUND;
    let f = x - (shifted - ROUND);
    let mut p = Lanes::splat(simd, POLYNOMIAL[0]);
    for &coefficient in &POLYNOMIAL[1..] {
        p = p * f + coefficient;
    }
    let p = p * f + 1.0;
    // The shift leaves the whole number alone; p is in [0.7, 1.5], so that the sum is an exponent, too.
    (p.bitcast::<i32x16<S>>() + (shifted.bitcast::<i32x16<S>>() << 23)).bitcast()
}

const FOUR: [[f32; 2]; 4] = [
    [0.069_431_84, 0.173_927_43],
    [0.330_009_5, 0.326_072_57],
    [0.669_990_54, 0.326_072_57],
    [0.930_568_16, 0.173_927_43],
];

const SIX: [[f32; 2]; 6] = [
    [0.033_765_24, 0.085_662_246],
    [0.169_395_31, 0.180_380_79],
    [0.380_690_4, 0.233_956_96],
    [0.619_309_6, 0.233_956_96],
    [0.830_604_7, 0.180_380_79],
    [0.966_234_74, 0.085_662_246],
];

const EIGHT: [[f32; 2]; 8] = [
    [0.019_855_07, 0.050_614_268],
    [0.101_666_76, 0.111_190_52],
    [0.237_233_79, 0.156_853_32],
    [0.408_282_67, 0.181_341_89],
    [0.591_717_3, 0.181_341_89],
    [0.762_766_2, 0.156_853_32],
    [0.898_333_25, 0.111_190_52],
    [0.980_144_9, 0.050_614_268],
];

const TWELVE: [[f32; 2]; 12] = [
    [0.009_219_683, 0.023_587_668],
    [0.047_941_37, 0.053_469_66],
    [0.115_048_66, 0.080_039_166],
    [0.206_341_03, 0.101_583_71],
    [0.316_084_24, 0.116_746_27],
    [0.437_383_3, 0.124_573_52],
    [0.562_616_7, 0.124_573_52],
    [0.683_915_73, 0.116_746_27],
    [0.793_659, 0.101_583_71],
    [0.884_951_35, 0.080_039_166],
    [0.952_058_6, 0.053_469_66],
    [0.990_780_3, 0.023_587_668],
];

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::at_level;

    #[test]
    fn the_exponential_keeps_its_bound_and_never_becomes_subnormal() {
        let mut worst = 0.0f64;
        for n in 0..100_000u32 {
            let exponents: [f32; 16] = std::array::from_fn(|lane| (n * 16 + lane as u32) as f32 * -7.8e-5);
            let mut values = [0.0f32; 16];
            at_level!(Level::new(), simd => {
                exp2(simd, Lanes::from_slice(simd, &exponents)).store_slice(&mut values);
            });
            for (x, value) in exponents.into_iter().zip(values) {
                worst = worst.max((f64::from(value) / f64::from(x).max(-125.0).exp2() - 1.0).abs());
            }
        }
        println!("exp2: worst relative error {worst:.2e}");
        assert!(worst < 3e-7, "{worst}");
        let far = at_level!(Level::new(), simd => {
            let far = exp2(simd, Lanes::splat(simd, f32::NEG_INFINITY));
            let far: [f32; 16] = far.into();
            far[7]
        });
        assert_eq!(far, 2f32.powi(-125));
    }

    #[test]
    fn each_rule_integrates_polynomials_of_its_degree() {
        for rule in &RULES {
            for degree in 0..2 * rule.points.len() as i32 {
                let sum: f64 = rule
                    .points
                    .iter()
                    .map(|&[x, weight]| f64::from(weight) * f64::from(x).powi(degree))
                    .sum();
                // Points and weights are rounded to 2⁻²⁵; a point's counts `degree` times.
                let rounding = (1.0 + f64::from(degree)) * 2f64.powi(-25);
                assert!(
                    (sum - 1.0 / f64::from(degree + 1)).abs() < rounding,
                    "{degree} of {}",
                    rule.points.len()
                );
            }
        }
    }
}
