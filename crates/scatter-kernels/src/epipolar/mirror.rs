//! The sums of `epipolar` by their definition, in the integers of the shaders: what these must give to the bit.

use super::factor_tables::{TERMS, prefix_at};

/// A run as `rows` leaves it: bits of the light ray γ where it starts, and the columns, counted from the light, that see it lit.
pub type Run = [u32; 2];

/// The sum of all lit runs before the light ray `gamma` (its bits), for the view ray of column `rank`; and the prefix up to it.
/// `runs` are those of a row without its header, with the end behind them; `scale` is the band's ([`super::EpipolarUniform::bands`]).
/// O(runs).
pub fn sum_mirror(
    runs: &[Run],
    (nodes, bits, scale): (&[[i32; TERMS]], u32, f32),
    rank: u32,
    gamma: u32,
) -> [[i32; TERMS]; 2] {
    let prefix = |gamma| prefix_at(nodes, bits, scale, gamma);
    let end = prefix(gamma);
    let mut sum = [0i32; TERMS];
    for pair in runs.windows(2) {
        let [[start, lit], [next, _]] = [pair[0], pair[1]];
        // Bits of numbers that are not negative are in their order.
        if start > gamma {
            break;
        }
        if lit > rank {
            let (from, to) = (prefix(start), if next > gamma { end } else { prefix(next) });
            sum = std::array::from_fn(|term| sum[term].wrapping_add(to[term].wrapping_sub(from[term])));
        }
    }
    [sum, end]
}
