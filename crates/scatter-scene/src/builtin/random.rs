//! Deterministic numbers for the built-in shots: a SplitMix64 stream, and sines that need no math library.
//!
//! SplitMix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014, figure 17.
//! Only `+ − × /` and square roots are used, which IEEE 754 rounds alike everywhere, so that a shot has the
//! same bytes on every platform.

use glam::DVec3;
use std::f64::consts::TAU;

/// A stream of pseudo-random numbers, fixed by its seed.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    /// A stream of its own for each seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    pub(crate) fn unit(&mut self) -> f64 {
        unit_from_bits(self.bits())
    }

    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in the unit ball, by rejection (no trigonometry).
    pub(crate) fn in_ball(&mut self) -> DVec3 {
        loop {
            let p = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if p.length_squared() < 1.0 {
                return p;
            }
        }
    }

    /// A uniform unit direction.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.in_ball();
            // Close to the centre the division would lose digits.
            if p.length_squared() > 1e-4 {
                return p / p.length();
            }
        }
    }
}

/// SplitMix64's output function: a bijection of 64 bits without visible structure.
pub(crate) fn mix(bits: u64) -> u64 {
    let z = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The top 53 bits as a number in [0, 1).
pub(crate) fn unit_from_bits(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// Sine and cosine of an angle given in turns, to 2e-15; exact at every quarter turn.
///
/// Folded to an eighth of a turn, then Taylor series: the term left out, (π/4)¹⁷/17!, is below 5e-17.
pub(crate) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let quarters = 4.0 * (turns - turns.floor());
    let nearest = (quarters + 0.5).floor();
    let x = (quarters - nearest) * (TAU / 4.0);
    let x_sq = x * x;
    let (mut sine, mut sine_term) = (x, x);
    let (mut cosine, mut cosine_term) = (1.0, 1.0);
    for k in 1..8 {
        let even = f64::from(2 * k);
        cosine_term *= -x_sq / (even * (even - 1.0));
        sine_term *= -x_sq / (even * (even + 1.0));
        cosine += cosine_term;
        sine += sine_term;
    }
    match nearest as u32 % 4 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_splitmix64() {
        // First outputs for seed 1234567, as printed with the reference implementation in C.
        let mut random = Random::new(1_234_567);
        assert_eq!(
            [random.bits(), random.bits(), random.bits()],
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]
        );
    }

    #[test]
    fn sines_agree_with_the_math_library() {
        // Eight added terms of size up to 1 and a folded argument of up to π/4: a few ulp of 1.
        const TOLERANCE: f64 = 4e-16;
        for i in -2000..2000 {
            let turns = f64::from(i) / 777.0;
            let (sine, cosine) = sin_cos_turns(turns);
            // The library's own argument is off by turns·2π·ε; taking off the whole turns costs 2π·ε.
            let slack = TOLERANCE + (turns.abs() + 1.0) * TAU * f64::EPSILON;
            assert!((sine - (turns * TAU).sin()).abs() < slack, "sine of {turns} turns");
            assert!((cosine - (turns * TAU).cos()).abs() < slack, "cosine of {turns} turns");
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        for (turns, expected) in
            [(0.0, (0.0, 1.0)), (0.25, (1.0, 0.0)), (-0.5, (0.0, -1.0)), (1.75, (-1.0, 0.0))]
        {
            assert_eq!(sin_cos_turns(turns), expected, "{turns} turns");
        }
    }

    #[test]
    fn directions_are_unit_and_balanced() {
        let mut random = Random::new(5);
        let count = 20_000;
        let mut mean = DVec3::ZERO;
        for _ in 0..count {
            let direction = random.direction();
            assert!((direction.length() - 1.0).abs() < 1e-14);
            mean += direction / f64::from(count);
        }
        // Each component's mean has a standard deviation of sqrt(1/3/20000) = 0.004: five of them.
        assert!(mean.abs().max_element() < 0.02, "mean direction {mean}");
    }
}
