//! Roots of polynomials all of whose roots are real, of degrees 2 to 4, several polynomials side by side, without a libm call but
//! square roots.
//!
//! The polynomials are kernels of a positive measure with one node given, so their roots are real and apart (Peters and Klein
//! 2015, Algorithm 1). One of them may be far away or infinite: it is clamped to [`Lanes::FARTHEST`], where its weight is nothing.

use fearless_simd::prelude::*;

use super::lanes::Lanes;

/// The N roots of `c[0] + c[1]·z + … + c[N]·z^N`, in any order; N is 2, 3 or 4.
///
/// In f64 to about 1e-8 for roots in [−2, 2] whose polynomial has its coefficients of one size, unless two are as near; a caller can check
/// the sum of their weights.
#[inline(always)]
pub fn real_roots<const N: usize, S: Simd, V: Lanes<S>>(simd: S, c: &[V; 5]) -> [V; 4] {
    let of = |value: f64| V::of(simd, value);
    let mut largest = of(V::TINY);
    for c in &c[..=N] {
        largest = largest.max(c.abs());
    }
    let leading = c[N].abs().max(largest * of(V::LEAST_LEADING)).copysign(c[N]);
    let scale = of(1.0) / leading;
    let mut roots = [of(0.0); 4];
    match N {
        2 => {
            let (b, c) = (c[1] * scale * of(0.5), c[0] * scale);
            let root = (b * b - c).max(of(0.0)).sqrt();
            // Of the two signs the one that adds; the other root follows from their product.
            let far = of(0.0) - (b + root.copysign(b));
            roots[0] = far;
            roots[1] = c / far.abs().max(of(V::TINY)).copysign(far);
        }
        3 => {
            let [one, two, three] = cubic(simd, c[2] * scale, c[1] * scale, c[0] * scale);
            [roots[0], roots[1], roots[2]] = [one, two, three];
        }
        _ => roots = quartic(simd, c[3] * scale, c[2] * scale, c[1] * scale, c[0] * scale),
    }
    for root in &mut roots[..N] {
        if N > 2 {
            // What closed forms lose beside a root far away, Newton's steps find again.
            for _ in 0..V::STEPS * (N - 2) {
                *root = polished::<N, S, V>(simd, c, *root);
            }
        }
        *root = root.max(of(-V::FARTHEST)).min(of(V::FARTHEST));
    }
    roots
}

/// One step of Newton's, shorter than a unit.
#[inline(always)]
fn polished<const N: usize, S: Simd, V: Lanes<S>>(simd: S, c: &[V; 5], z: V) -> V {
    let (mut value, mut slope) = (c[N], V::of(simd, 0.0));
    for k in (0..N).rev() {
        slope = slope.mul_add(z, value);
        value = value.mul_add(z, c[k]);
    }
    let step = value / slope;
    z - step.abs().below(V::of(simd, 1.0), step)
}

/// Roots of `z³ + a·z² + b·z + c`: `z = 2m·u − a/3` turns it into `4u³ − 3u = x`, |x| ≤ 1.
#[inline(always)]
fn cubic<S: Simd, V: Lanes<S>>(simd: S, a: V, b: V, c: V) -> [V; 3] {
    let of = |value: f64| V::of(simd, value);
    let third = a * of(1.0 / 3.0);
    let minus_p = (third * a - b).max(of(0.0));
    let q = third * (third * third * of(2.0) - b) + c;
    let m = (minus_p * of(1.0 / 3.0)).sqrt();
    let x = q * of(-0.5) / (m * m * m).max(of(V::TINY));
    let target = x.abs().min(of(1.0));
    // The root with the sign of x is in [cos 30°, 1], where the slope is at least 6: some steps from within 0.006.
    let mut u = target * of(0.134) + of(0.866);
    for _ in 0..V::CUBIC_STEPS {
        let square = u * u;
        u = u - ((square * of(4.0) - of(3.0)) * u - target) / (square * of(12.0) - of(3.0));
    }
    let u = u.min(of(1.0));
    let other = ((of(1.0) - u * u) * of(0.75)).max(of(0.0)).sqrt();
    let twice = (m * of(2.0)).copysign(x);
    let half = u * of(-0.5);
    [u, half + other, half - other].map(|u| twice * u - third)
}

/// Roots of `z⁴ + a·z³ + b·z² + c·z + d` by Euler's resolvent, whose roots are real and ≥ 0 where those of the quartic are real.
#[inline(always)]
fn quartic<S: Simd, V: Lanes<S>>(simd: S, a: V, b: V, c: V, d: V) -> [V; 4] {
    let of = |value: f64| V::of(simd, value);
    let quarter = a * of(0.25);
    let square = quarter * quarter;
    let p = b - square * of(6.0);
    let q = c - quarter * b * of(2.0) + quarter * square * of(8.0);
    let r = d - quarter * c + square * b - square * square * of(3.0);
    let minus_q = V::of(simd, 0.0) - q;
    let resolved = cubic(simd, p * of(2.0), p * p - r * of(4.0), minus_q * q);
    let [one, two, three] = resolved.map(|z| z.max(V::of(simd, 0.0)).sqrt());
    // The product of the three roots is −q.
    let three = three.copysign(minus_q);
    let half = |x: V| x * of(0.5) - quarter;
    let (sum, difference) = (one + two, one - two);
    let zero = V::of(simd, 0.0);
    [half(sum + three), half(difference - three), half(zero - difference - three), half(three - sum)]
}

#[cfg(test)]
mod tests {
    use fearless_simd::f64x8;
    use proptest::prelude::*;
    use scatter_core::{Level, at_level};

    use super::*;

    fn roots_of<const N: usize>(c: &[f64; 5]) -> Vec<f64> {
        at_level!(Level::new(), simd => {
            let lanes = c.map(|c| f64x8::splat(simd, c));
            real_roots::<N, _, _>(simd, &lanes)[..N].iter().map(|root| root.as_slice()[3]).collect()
        })
    }

    fn coefficients(roots: &[f64]) -> [f64; 5] {
        let mut c = [1.0, 0.0, 0.0, 0.0, 0.0];
        for (degree, root) in roots.iter().enumerate() {
            for k in (0..=degree + 1).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * if k <= degree { c[k] } else { 0.0 };
            }
        }
        c
    }

    /// Largest distance of found roots from the true ones.
    fn error<const N: usize>(true_roots: &[f64], factor: f64) -> f64 {
        let mut found = roots_of::<N>(&coefficients(true_roots).map(|c| factor * c));
        let mut exact = true_roots.to_vec();
        found.sort_by(f64::total_cmp);
        exact.sort_by(f64::total_cmp);
        exact.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn roots_are_found(
            gaps in prop::collection::vec(0.02..0.8f64, 4),
            start in -2.0..0.0f64,
            factor in -30.0..30.0f64,
        ) {
            prop_assume!(factor.abs() > 1e-3);
            let mut at = start;
            let roots: Vec<f64> = gaps.iter().map(|gap| { at += gap; at }).collect();
            // A root moves by ε·|c|/|p'|, and |p'| ≥ 0.02³: 1e-16·30/8e-6.
            prop_assert!(error::<2>(&roots[..2], factor) < 1e-9);
            prop_assert!(error::<3>(&roots[..3], factor) < 1e-9);
            prop_assert!(error::<4>(&roots, factor) < 1e-8);
        }
    }

    #[test]
    fn a_root_that_goes_away_leaves_the_others() {
        for far in [1e2, 1e4, 1e5] {
            let roots = [-0.7, 0.1, 0.6, far];
            let near =
                |found: &[f64], exact: f64| found.iter().map(|z| (z - exact).abs()).fold(f64::MAX, f64::min);
            let (quartic, cubic) =
                (roots_of::<4>(&coefficients(&roots)), roots_of::<3>(&coefficients(&roots[1..])));
            println!("{far}: {quartic:?} {cubic:?}");
            assert!(roots[..3].iter().all(|&root| near(&quartic, root) < 1e-6));
            assert!(roots[1..3].iter().all(|&root| near(&cubic, root) < 1e-6));
        }
        assert!(roots_of::<3>(&[0.0; 5]).iter().all(|root| root.is_finite()));
    }
}
