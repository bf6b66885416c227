//! Sines and cosines of the odd multiples of an angle, by the recurrence of Chebyshev polynomials: two flops a term.

/// Numbers of coefficients of a series, sines and cosines counted one by one as in the paper of 2014 (JCGT).
pub const FOURIER_COUNTS: [u32; 2] = [4, 128];

/// Lanes that are computed side by side.
pub const LANES: usize = 16;

/// Sine and cosine of `(2k − 1)·π·z` for k from 1 to `terms`, of sixteen z in [0, 1]: calls `visit(k − 1, sines, cosines)`.
///
/// `x_{k+1} = 2·cos(2πz)·x_k − x_{k−1}`, x_0 = x_1 with the sine's sign turned. Errors grow with k² where z is near 0 or 1: 2⁻²³·k², which at 64 terms
/// is 5e-4 (test); a coefficient is divided by k.
#[inline(always)]
pub fn harmonics(z: &[f32; LANES], terms: usize, mut visit: impl FnMut(usize, &[f32; LANES], &[f32; LANES])) {
    let (mut sines, mut cosines) = ([0.0f32; LANES], [0.0f32; LANES]);
    let mut factors = [0.0f32; LANES];
    for lane in 0..LANES {
        let [sine, cosine] = sine_and_cosine_of_half_turns(z[lane]);
        (sines[lane], cosines[lane]) = (sine, cosine);
        // 2·cos(2πz), from the smaller of the two squares.
        factors[lane] = 2.0 - 4.0 * sine * sine;
    }
    let (mut sines_before, mut cosines_before) = (sines.map(|sine| -sine), cosines);
    for k in 0..terms {
        visit(k, &sines, &cosines);
        for lane in 0..LANES {
            let (sine, cosine) = (sines[lane], cosines[lane]);
            sines[lane] = factors[lane] * sine - sines_before[lane];
            cosines[lane] = factors[lane] * cosine - cosines_before[lane];
            (sines_before[lane], cosines_before[lane]) = (sine, cosine);
        }
    }
}

/// Sine and cosine of πz, z in [0, 1], to 1e-7: about the middle, by Taylor series of π(z − ½), |π(z − ½)| ≤ π/2.
#[inline(always)]
fn sine_and_cosine_of_half_turns(z: f32) -> [f32; 2] {
    let x = std::f32::consts::PI * (z - 0.5);
    let square = x * x;
    let sine = x
        * (1.0
            - square
                * (1.0 / 6.0
                    - square
                        * (1.0 / 120.0
                            - square * (1.0 / 5040.0 - square * (1.0 / 362_880.0 - square / 39_916_800.0)))));
    let cosine = 1.0
        - square
            * (0.5
                - square
                    * (1.0 / 24.0
                        - square
                            * (1.0 / 720.0
                                - square
                                    * (1.0 / 40_320.0
                                        - square * (1.0 / 3_628_800.0 - square / 479_001_600.0)))));
    // πz is a quarter turn more than x.
    [cosine, -sine]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_are_sines_and_cosines() {
        let mut worst = 0.0f64;
        for step in 0..200 {
            let z: [f32; LANES] = std::array::from_fn(|lane| (step * LANES + lane) as f32 / 3199.0);
            harmonics(&z, 64, |k, sines, cosines| {
                for lane in 0..LANES {
                    let angle = (2.0 * k as f64 + 1.0) * std::f64::consts::PI * f64::from(z[lane]);
                    worst = worst.max((f64::from(sines[lane]) - angle.sin()).abs());
                    worst = worst.max((f64::from(cosines[lane]) - angle.cos()).abs());
                }
            });
        }
        println!("{worst:e}");
        assert!(worst < 5e-4);
    }
}
