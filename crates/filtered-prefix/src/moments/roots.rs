//! Roots of polynomials all of whose roots are real, of degrees 2 to 4, eight polynomials side by side, without a libm call but
//! square roots.
//!
//! The polynomials are kernels of a positive measure with one node given, so their roots are real and apart (Peters and Klein
//! 2015, Algorithm 1). One of them may be far away or infinite: it is clamped to [`FARTHEST`], where its weight is nothing.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

/// Roots beyond are taken there.
const FARTHEST: f64 = 1e6;

/// A leading coefficient that is smaller than this part of the largest one is taken to be as large: the root that it sends
/// away lies beyond everything that has a weight.
const LEAST_LEADING: f64 = 1e-9;

/// The N roots of `c[0] + c[1]·z + … + c[N]·z^N`, in any order; N is 2, 3 or 4.
///
/// To about 1e-8 for roots in [−2, 2] whose polynomial has its coefficients of one size, unless two are as near; a caller can check
/// the sum of their weights.
#[inline(always)]
pub fn real_roots<const N: usize, S: Simd>(simd: S, c: &[f64x8<S>; 5]) -> [f64x8<S>; 4] {
    let splat = |value: f64| f64x8::splat(simd, value);
    let mut largest = splat(1e-200);
    for c in &c[..=N] {
        largest = largest.max(c.abs());
    }
    let leading = c[N].abs().max(largest * LEAST_LEADING).copysign(c[N]);
    let scale = splat(1.0) / leading;
    let mut roots = [splat(0.0); 4];
    match N {
        2 => {
            let (b, c) = (c[1] * scale * 0.5, c[0] * scale);
            let root = (b * b - c).max(splat(0.0)).sqrt();
            // Of the two signs the one that adds; the other root follows from their product.
            let far = splat(0.0) - (b + root.copysign(b));
            roots[0] = far;
            roots[1] = c / far.abs().max(splat(1e-200)).copysign(far);
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
            for _ in 2..N {
                *root = polished::<N, S>(simd, c, *root);
            }
        }
        *root = root.max(splat(-FARTHEST)).min(splat(FARTHEST));
    }
    roots
}

/// One step of Newton's, no longer than a unit.
#[inline(always)]
fn polished<const N: usize, S: Simd>(simd: S, c: &[f64x8<S>; 5], z: f64x8<S>) -> f64x8<S> {
    let (mut value, mut slope) = (c[N], f64x8::splat(simd, 0.0));
    for k in (0..N).rev() {
        slope = slope.mul_add(z, value);
        value = value.mul_add(z, c[k]);
    }
    let step = value / slope;
    let short = step.abs().simd_le(f64x8::splat(simd, 1.0));
    z - short.select(step, f64x8::splat(simd, 0.0))
}

/// Roots of `z³ + a·z² + b·z + c`: `z = 2m·u − a/3` turns it into `4u³ − 3u = x`, |x| ≤ 1.
#[inline(always)]
fn cubic<S: Simd>(simd: S, a: f64x8<S>, b: f64x8<S>, c: f64x8<S>) -> [f64x8<S>; 3] {
    let splat = |value: f64| f64x8::splat(simd, value);
    let third = a * (1.0 / 3.0);
    let minus_p = (third * a - b).max(splat(0.0));
    let q = third * (third * third * 2.0 - b) + c;
    let m = (minus_p * (1.0 / 3.0)).sqrt();
    let x = q * -0.5 / (m * m * m).max(splat(1e-200));
    let target = x.abs().min(splat(1.0));
    // The root with the sign of x is in [cos 30°, 1], where the slope is at least 6: three steps from within 0.006.
    let mut u = target * 0.134 + 0.866;
    for _ in 0..3 {
        let square = u * u;
        u -= ((square * 4.0 - 3.0) * u - target) / (square * 12.0 - 3.0);
    }
    let u = u.min(splat(1.0));
    let other = ((splat(1.0) - u * u) * 0.75).max(splat(0.0)).sqrt();
    let twice = (m * 2.0).copysign(x);
    let half = u * -0.5;
    [u, half + other, half - other].map(|u| twice * u - third)
}

/// Roots of `z⁴ + a·z³ + b·z² + c·z + d` by Euler's resolvent, whose roots are real and ≥ 0 where those of the quartic are real.
#[inline(always)]
fn quartic<S: Simd>(simd: S, a: f64x8<S>, b: f64x8<S>, c: f64x8<S>, d: f64x8<S>) -> [f64x8<S>; 4] {
    let quarter = a * 0.25;
    let square = quarter * quarter;
    let p = b - square * 6.0;
    let q = c - quarter * b * 2.0 + quarter * square * 8.0;
    let r = d - quarter * c + square * b - square * square * 3.0;
    let minus_q = f64x8::splat(simd, 0.0) - q;
    let resolved = cubic(simd, p * 2.0, p * p - r * 4.0, minus_q * q);
    let [one, two, three] = resolved.map(|z| z.max(f64x8::splat(simd, 0.0)).sqrt());
    // The product of the three roots is −q.
    let three = three.copysign(minus_q);
    let half = |x: f64x8<S>| x * 0.5 - quarter;
    let (sum, difference) = (one + two, one - two);
    let zero = f64x8::splat(simd, 0.0);
    [half(sum + three), half(difference - three), half(zero - difference - three), half(three - sum)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use scatter_core::{Level, at_level};

    use super::*;

    fn roots_of<const N: usize>(c: &[f64; 5]) -> Vec<f64> {
        at_level!(Level::new(), simd => {
            let lanes = c.map(|c| f64x8::splat(simd, c));
            real_roots::<N, _>(simd, &lanes)[..N].iter().map(|root| root.as_slice()[3]).collect()
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
