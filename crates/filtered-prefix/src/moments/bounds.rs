//! What a few power moments of a distribution say of it: bounds of the mass below a point, which are sharp
//! (Chebyshev, Markov and Stieltjes; Peters and Klein 2015, Algorithm 1; Peters et al. 2017).

use fearless_simd::prelude::*;

use super::lanes::Lanes;
use super::roots::real_roots;

/// Moments of the widest set, with the zeroth.
pub const MOST_POWERS: usize = 9;

/// Numbers of moments that there are.
pub const COUNTS: [u32; 3] = [4, 6, 8];

/// How much of the distribution that has most entropy is mixed into one that was stored as f32, by the number of moments (Peters
/// and Klein 2015; Münstermann et al. 2018): enough for the Hankel matrix to stay positive definite.
pub const fn bias_of(count: u32) -> f64 {
    match count {
        4 => 5e-7,
        6 => 5e-6,
        _ => 5e-5,
    }
}

/// The moments b₀ to b₈ of what is mixed in (odd ones are 0).
const fn towards(count: u32) -> [f64; MOST_POWERS] {
    match count {
        4 => [1.0, 0.0, 0.375, 0.0, 0.375, 0.0, 0.0, 0.0, 0.0],
        6 => [1.0, 0.0, 0.48, 0.0, 0.451, 0.0, 0.45, 0.0, 0.0],
        _ => [1.0, 0.0, 0.75, 0.0, 0.677, 0.0, 0.63, 0.0, 0.6],
    }
}

/// Bounds of the mass of distributions side by side, below a point each.
#[derive(Clone, Copy)]
pub struct MassBounds<V> {
    /// Smallest mass below the point.
    pub least: V,
    /// How much more it may be.
    pub width: V,
}

/// Bounds of the mass below `z` (in [−1, 1]) of distributions with the moments `1, b₁, …, b_{2N}`, N = 2, 3, 4, after `bias` of
/// each was replaced by the distribution of most entropy.
///
/// The mass below z of that mixture lies between `least` and `least + width`; of the distribution itself at most `bias` beside.
/// `width` is the largest mass that can lie in z itself, 1/(vᵀB⁻¹v), v = (1, z, …, z^N), and includes what the weights found
/// miss of 1. About 200 flops and fifteen divisions for N = 3, no branch; as exact as the lanes, which are f64 where it is a bound.
#[inline(always)]
pub fn mass_below<const N: usize, S: Simd, V: Lanes<S>>(
    simd: S,
    b: &[V; MOST_POWERS],
    z: V,
    bias: f64,
) -> MassBounds<V> {
    let of = |value: f64| V::of(simd, value);
    let (zero, one) = (of(0.0), of(1.0));
    let target = towards(2 * N as u32);
    let mut moments = [zero; MOST_POWERS];
    for power in 0..=2 * N {
        moments[power] = b[power] * of(1.0 - bias) + of(bias * target[power]);
    }
    // B = L·D·Lᵀ of the Hankel matrix.
    let mut lower = [[zero; 5]; 5];
    let (mut diagonal, mut inverse) = ([one; 5], [one; 5]);
    for j in 0..=N {
        let mut d = moments[2 * j];
        for k in 0..j {
            d = d.less_product(lower[j][k] * lower[j][k], diagonal[k]);
        }
        // Rounding must not turn a mass negative.
        d = d.max(of(V::LEAST_PIVOT));
        (diagonal[j], inverse[j]) = (d, one / d);
        for i in j + 1..=N {
            let mut l = moments[i + j];
            for k in 0..j {
                l = l.less_product(lower[i][k] * lower[j][k], diagonal[k]);
            }
            lower[i][j] = l * inverse[j];
        }
    }
    // The kernel polynomial of z, and the mass in z.
    let mut kernel = [zero; 5];
    let width = mass_at::<N, S, V>(&lower, &inverse, (one, z), &mut kernel);
    for i in (0..=N).rev() {
        for k in i + 1..=N {
            kernel[i] = kernel[i].less_product(lower[k][i], kernel[k]);
        }
    }
    let roots = real_roots::<N, S, V>(simd, &kernel);
    let (mut below, mut above) = (zero, zero);
    for &root in &roots[..N] {
        let mass = mass_at::<N, S, V>(&lower, &inverse, (one, root), &mut [zero; 5]);
        let own = root.below(z, mass);
        (below, above) = (below + own, above + (mass - own));
    }
    // The masses of all nodes are 1 together; what is missing could be anywhere.
    let missing = (one - below - above - width).abs();
    MassBounds { least: (below - missing).max(zero), width: width + (missing + missing) }
}

/// The largest mass that can lie in z: 1/(vᵀB⁻¹v). Leaves `D⁻¹L⁻¹v` in `solved`.
#[inline(always)]
fn mass_at<const N: usize, S: Simd, V: Lanes<S>>(
    lower: &[[V; 5]; 5],
    inverse: &[V; 5],
    (one, z): (V, V),
    solved: &mut [V; 5],
) -> V {
    let mut y = [one; 5];
    let mut power = one;
    let mut sum = one;
    for i in 0..=N {
        let mut value = power;
        for k in 0..i {
            value = value.less_product(lower[i][k], y[k]);
        }
        y[i] = value;
        solved[i] = value * inverse[i];
        sum = if i == 0 { value * solved[i] } else { sum + value * solved[i] };
        power = power * z;
    }
    one / sum
}

/// [`mass_below`] of one distribution: `[least, width]`.
#[cfg(test)]
pub fn mass_bounds<const N: usize>(b: &[f64; MOST_POWERS], z: f64, bias: f64) -> [f64; 2] {
    use fearless_simd::f64x8;

    scatter_core::at_level!(scatter_core::Level::new(), simd => {
        let lanes = b.map(|b| f64x8::splat(simd, b));
        let bounds = mass_below::<N, _, _>(simd, &lanes, f64x8::splat(simd, z), bias);
        [bounds.least.as_slice()[5], bounds.width.as_slice()[5]]
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Moments of a distribution, rounded to f32 as they are stored.
    fn moments(atoms: &[(f64, f64)]) -> [f64; MOST_POWERS] {
        let total: f64 = atoms.iter().map(|(_, w)| w).sum();
        std::array::from_fn(|power| {
            let sum: f64 = atoms.iter().map(|(z, w)| w * z.powi(power as i32)).sum();
            f64::from((sum / total) as f32)
        })
    }

    fn mass(atoms: &[(f64, f64)], z: f64) -> f64 {
        let total: f64 = atoms.iter().map(|(_, w)| w).sum();
        atoms.iter().filter(|(at, _)| *at < z).map(|(_, w)| w).sum::<f64>() / total
    }

    /// How far the true mass lies outside of its bounds, beyond the bias.
    fn violation<const N: usize>(atoms: &[(f64, f64)], z: f64) -> f64 {
        let bias = bias_of(2 * N as u32);
        let [least, width] = mass_bounds::<N>(&moments(atoms), z, bias);
        let exact = mass(atoms, z);
        assert!(least >= 0.0 && width >= 0.0 && least.is_finite() && width.is_finite());
        (least - exact).max(exact - least - width) - bias
    }

    fn atoms(most: usize) -> impl Strategy<Value = Vec<(f64, f64)>> {
        let place = prop_oneof![2 => -1.0..=1.0f64, 1 => (-8i32..=8).prop_map(|n| f64::from(n) / 8.0)];
        prop::collection::vec((place, prop_oneof![3 => 0.01..1.0f64, 1 => 1e-5..1e-3f64]), 1..most)
    }

    /// The middle of the bounds by sixteen f32 lanes.
    fn middle_in_f32<const N: usize>(b: &[f64; MOST_POWERS], z: f64, bias: f64) -> f64 {
        use fearless_simd::f32x16;

        scatter_core::at_level!(scatter_core::Level::new(), simd => {
            let lanes = b.map(|b| f32x16::splat(simd, b as f32));
            let bounds = mass_below::<N, _, _>(simd, &lanes, f32x16::splat(simd, z as f32), bias);
            f64::from(bounds.least.as_slice()[9] + 0.5 * bounds.width.as_slice()[9])
        })
    }

    /// RMS error of the middle of the bounds, in f64 and in f32, over rows of up to `most` surfaces.
    fn errors<const N: usize>(most: usize) -> [f64; 2] {
        let mut random = scatter_testing::Random(7);
        let mut sums = [0.0f64; 2];
        let count = 20_000;
        for _ in 0..count {
            let surfaces = 1 + random.index(most);
            let atoms: Vec<(f64, f64)> =
                (0..surfaces).map(|_| (random.range(-0.9, 0.9), random.range(0.01, 1.0))).collect();
            let (b, z) = (moments(&atoms), random.range(-0.9, 0.9));
            let bias = bias_of(2 * N as u32);
            let [least, width] = mass_bounds::<N>(&b, z, bias);
            let exact = mass(&atoms, z);
            for (sum, middle) in
                sums.iter_mut().zip([least + 0.5 * width, middle_in_f32::<N>(&b, z, bias).clamp(0.0, 1.0)])
            {
                *sum += (middle - exact) * (middle - exact);
            }
        }
        sums.map(|sum| (sum / f64::from(count)).sqrt())
    }

    #[test]
    fn f32_errs_hardly_more_than_f64() {
        for most in [40, 3] {
            let found = [errors::<2>(most), errors::<3>(most), errors::<4>(most)];
            println!("up to {most} surfaces, RMS errors in f64 and f32: {found:?}");
            // Stored moments are off by f32's rounding already; solving in it adds as much again, and that is the smaller part beside
            // what moments do not know. Not with eight, whose pivots are smaller: those are solved in f64.
            for [in_f64, in_f32] in &found[..2] {
                assert!(*in_f32 < 1.1 * in_f64);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]
        #[test]
        fn the_mass_below_a_point_lies_within_its_bounds(atoms in atoms(40), z in -1.0..1.0f64) {
            // f32 moments are off by 6e-8 each, which is what the bias is there for: a quarter of it may show.
            prop_assert!(violation::<2>(&atoms, z) < 0.25 * bias_of(4));
            prop_assert!(violation::<3>(&atoms, z) < 0.25 * bias_of(6));
            prop_assert!(violation::<4>(&atoms, z) < 0.25 * bias_of(8));
        }

        #[test]
        fn half_as_many_layers_as_moments_are_exact(gaps in prop::collection::vec(0.45..0.6f64, 3), weights in prop::collection::vec(0.1..1.0f64, 4), at in 0.0..1.0f64) {
            let places: Vec<f64> = gaps.iter().scan(-1.4, |z, gap| { *z += gap; Some(*z) }).collect();
            let atoms: Vec<(f64, f64)> = places.into_iter().zip(weights).filter(|(z, _)| *z <= 1.0).collect();
            let z = 2.0 * at - 1.0;
            if atoms.iter().any(|(place, _)| (place - z).abs() < 0.15) {
                return Ok(());
            }
            let check = |[least, width]: [f64; 2], layers: usize, most: f64| {
                let exact = mass(&atoms[..layers], z);
                let middle = least + 0.5 * width;
                (middle - exact).abs() < most
            };
            for layers in 1..=atoms.len().min(2) {
                prop_assert!(check(mass_bounds::<2>(&moments(&atoms[..layers]), z, bias_of(4)), layers, 1e-3));
            }
            for layers in 1..=atoms.len().min(3) {
                prop_assert!(check(mass_bounds::<3>(&moments(&atoms[..layers]), z, bias_of(6)), layers, 3e-2));
            }
        }
    }
}
