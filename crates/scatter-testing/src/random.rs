//! Random numbers that are the same on every machine: SplitMix64.
//!
//! Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014, figure 17. (The built-in shots
//! have a generator of their own, beside functions that use no math library: they are part of the product.)

use std::f64::consts::TAU;

use glam::DVec3;

/// A stream of numbers; the field is the seed, and any seed is a good one.
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [`low`, `high`), with 53 random bits.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in 0..`count`; 0 for a `count` of 0. (Small counts: the remainder prefers low values by `count`/2⁶⁴.)
    pub fn below(&mut self, count: u32) -> u32 {
        (self.bits() % u64::from(count.max(1))) as u32
    }

    /// Uniform in 0..`count`, for places in a list; 0 for a `count` of 0.
    pub fn index(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }

    /// One of the values, which must not be none.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.index(from.len())]
    }

    /// Uniform in the cube of that half side around the origin.
    pub fn in_cube(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.range(-half, half), self.range(-half, half), self.range(-half, half))
    }

    /// A unit vector, uniform on the sphere (Archimedes: its z is uniform).
    pub fn direction(&mut self) -> DVec3 {
        let z: f64 = self.range(-1.0, 1.0);
        let angle = self.range(0.0, TAU);
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }

    /// Three numbers, each uniform in [`low`, `high`).
    pub fn rgb(&mut self, low: f64, high: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.range(low, high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_splitmix64() {
        // The values that other implementations give for this seed (Vigna's splitmix64.c).
        let mut random = Random(1_234_567);
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(expected.map(|_| random.bits()), expected);
    }

    #[test]
    fn numbers_fill_their_ranges_and_directions_the_sphere() {
        let mut random = Random(7);
        const COUNT: u32 = 10_000;
        // The mean of n values of variance v is off by more than five times √(v/n) once in two million.
        let five_sigma = |variance: f64| 5.0 * (variance / f64::from(COUNT)).sqrt();
        let (mut sum, mut squares, mut axis) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for _ in 0..COUNT {
            let value = random.range(2.0, 5.0);
            assert!((2.0..5.0).contains(&value) && random.below(7) < 7);
            sum += value;
            let direction = random.direction();
            assert!((direction.length() - 1.0).abs() < 1e-15);
            (axis, squares) = (axis + direction, squares + direction * direction);
        }
        let count = f64::from(COUNT);
        assert!((sum / count - 3.5).abs() < five_sigma(9.0 / 12.0));
        assert!((axis / count).abs().max_element() < five_sigma(1.0 / 3.0));
        // ⟨x⁴⟩ − ⟨x²⟩² = 1/5 − 1/9.
        assert!((squares / count - 1.0 / 3.0).abs().max_element() < five_sigma(1.0 / 5.0 - 1.0 / 9.0));
        assert_eq!(random.below(0), 0);
        assert_eq!(random.pick(&[9]), 9);
    }
}
