//! What the texels of a map are filled with.

use crate::random::Random;

/// Depths of a map's texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling {
    /// The same everywhere: 0 is all shadow, `+∞` all light.
    Constant(f32),
    /// These two in turn, along rows and columns; the first one in the first texel.
    Checkerboard(f32, f32),
    /// By SplitMix64 of that seed: a quarter `+∞`, the others uniform in \[0.05, `far`).
    Random {
        /// Seed, to which the index of the map is added.
        seed: u64,
        /// Where depths end.
        far: f64,
    },
}

impl Filling {
    /// Depths of map number `index` of `size`, `[row][column]`.
    pub fn texels(self, index: usize, [width, height]: [u32; 2]) -> Vec<f32> {
        match self {
            Self::Constant(depth) => vec![depth; (width * height) as usize],
            Self::Checkerboard(first, second) => (0..width * height)
                .map(|n| if (n % width + n / width).is_multiple_of(2) { first } else { second })
                .collect(),
            Self::Random { seed, far } => {
                let mut random = Random(seed.wrapping_add(index as u64));
                (0..width * height).map(|_| random_depth(&mut random, far)).collect()
            }
        }
    }
}

/// `+∞` once in four times, else uniform in \[0.05, `far`).
pub(crate) fn random_depth(random: &mut Random, far: f64) -> f32 {
    if random.below(4) == 0 { f32::INFINITY } else { random.range(0.05, far) as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_on_a_checkerboard_of_odd_width_differ() {
        let texels = Filling::Checkerboard(1.0, 2.0).texels(0, [3, 2]);
        assert_eq!(texels, [1.0, 2.0, 1.0, 2.0, 1.0, 2.0]);
        let texels = Filling::Checkerboard(1.0, 2.0).texels(0, [2, 2]);
        assert_eq!(texels, [1.0, 2.0, 2.0, 1.0]);
    }

    #[test]
    fn maps_of_one_seed_differ_from_each_other_and_not_from_themselves() {
        let filling = Filling::Random { seed: 3, far: 8.0 };
        assert_eq!(filling.texels(1, [9, 5]), filling.texels(1, [9, 5]));
        assert_ne!(filling.texels(0, [9, 5]), filling.texels(1, [9, 5]));
    }
}
