//! Adaptive Gauss-Kronrod quadrature (7, 15), bisecting until the two rules agree to rounding.

/// `∫ₐᵇ f`, to about 1e-14 of the integral of |f| for integrands with at most kinks.
pub(super) fn integrate(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    if !(b > a) {
        return 0.0;
    }
    // Parts that halve towards both ends, where airlight integrands pile up: a spike there must not be stepped over.
    let middle = 0.5 * (a + b);
    let mut ends = vec![a, middle, b];
    let mut width = middle - a;
    for _ in 0..HALVINGS {
        width *= 0.5;
        ends.extend([a + width, b - width]);
    }
    ends.sort_by(f64::total_cmp);
    let parts = || ends.windows(2).filter(|pair| pair[1] > pair[0]);
    // A first estimate of the whole says what is negligible in a part.
    let whole: f64 = parts().map(|pair| kronrod(f, pair[0], pair[1]).0.abs()).sum();
    parts().map(|pair| refine(f, pair[0], pair[1], whole, DEPTH)).sum()
}

/// `∫ f` from the first of some sorted cuts to the last, for integrands that are smooth enough between two cuts for 15
/// points to see what they have there: a twentieth of the cost.
pub(super) fn integrate_smooth(f: &dyn Fn(f64) -> f64, cuts: &[f64]) -> f64 {
    let parts = || cuts.windows(2).filter(|pair| pair[1] > pair[0]);
    let whole: f64 = parts().map(|pair| kronrod(f, pair[0], pair[1]).0.abs()).sum();
    parts().map(|pair| refine(f, pair[0], pair[1], whole, DEPTH)).sum()
}

/// First parts at each end: the narrowest spike that is found there is 2⁻⁴⁰ of the interval wide.
const HALVINGS: u32 = 40;
/// Bisections of a part: 2⁻⁶⁰ of it is below f64's resolution.
const DEPTH: u32 = 60;
/// Share of the whole that a part's error may have: parts add up, so well below what tests ask for (1e-12).
const TOLERANCE: f64 = 2e-16;
/// Relative difference of both rules at which a part is as good as f64 has it.
const ROUNDING: f64 = 1e-14;

fn refine(f: &dyn Fn(f64) -> f64, a: f64, b: f64, whole: f64, depth: u32) -> f64 {
    let (value, error) = kronrod(f, a, b);
    if depth == 0 || error <= TOLERANCE * whole || error <= ROUNDING * value.abs() {
        return value;
    }
    let middle = 0.5 * (a + b);
    if !(middle > a && middle < b) {
        return value;
    }
    refine(f, a, middle, whole, depth - 1) + refine(f, middle, b, whole, depth - 1)
}

/// The 15-point Kronrod value and its distance from the 7-point Gauss value.
fn kronrod(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> (f64, f64) {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let centre = f(middle);
    let (mut kronrod, mut gauss) = (KRONROD[7] * centre, GAUSS[3] * centre);
    for i in 0..7 {
        let pair = f(middle - half * NODES[i]) + f(middle + half * NODES[i]);
        kronrod += KRONROD[i] * pair;
        if i % 2 == 1 {
            gauss += GAUSS[i / 2] * pair;
        }
    }
    (kronrod * half, ((kronrod - gauss) * half).abs())
}

/// Kronrod nodes on (0, 1), QUADPACK's order (Piessens et al. 1983, qk15).
#[expect(clippy::excessive_precision, reason = "as the table prints them")]
const NODES: [f64; 7] = [
    0.991_455_371_120_812_639_2,
    0.949_107_912_342_758_524_5,
    0.864_864_423_359_769_072_8,
    0.741_531_185_599_394_439_9,
    0.586_087_235_467_691_130_3,
    0.405_845_151_377_397_166_9,
    0.207_784_955_007_898_467_6,
];
/// Kronrod weights, the centre last.
#[expect(clippy::excessive_precision, reason = "as the table prints them")]
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224_96,
    0.063_092_092_629_978_553_29,
    0.104_790_010_322_250_183_8,
    0.140_653_259_715_525_918_7,
    0.169_004_726_639_267_902_8,
    0.190_350_578_064_785_409_9,
    0.204_432_940_075_298_892_4,
    0.209_482_141_084_727_828_0,
];
/// Gauss weights of every second node, the centre last.
#[expect(clippy::excessive_precision, reason = "as the table prints them")]
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_693_3,
    0.279_705_391_489_276_667_9,
    0.381_830_050_505_118_944_9,
    0.417_959_183_673_469_387_8,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_to_degree_22_are_exact_in_one_panel() {
        for degree in 0..=22 {
            let (value, _) = kronrod(&|x| x.powi(degree), 0.0, 1.0);
            assert!((value * f64::from(degree + 1) - 1.0).abs() < 1e-14, "{degree}: {value}");
        }
    }

    #[test]
    fn a_peak_a_kink_and_a_decay_are_found() {
        let peak = integrate(&|x| 1e-6 / (x * x + 1e-12), 0.0, 1.0);
        assert!((peak / (1e6f64).atan() - 1.0).abs() < 1e-12, "{peak}");
        let kink = integrate(&|x| (x - 0.3).abs(), 0.0, 1.0);
        assert!((kink / 0.29 - 1.0).abs() < 1e-12, "{kink}");
        let decay = integrate(&|x| (-1e5 * x).exp(), 0.0, 1.0);
        assert!((decay * 1e5 - 1.0).abs() < 1e-12, "{decay}");
    }
}
