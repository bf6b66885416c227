//! Phase functions as the textbooks write them (Henyey and Greenstein 1941; Rayleigh 1871), `[1/sr]`.
//!
//! `cos_theta` is the cosine between the way the light travels and the way to the eye: +1 looking into the sun.

use std::f64::consts::PI;

/// How a particle scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhaseFunction {
    /// `1/4π`.
    Isotropic,
    /// `3/16π·(1 + cos²θ)`.
    Rayleigh,
    /// `(1 − g²) / (4π·(1 + g² − 2g·cosθ)^{3/2})`, |g| < 1.
    HenyeyGreenstein(f64),
}

impl PhaseFunction {
    /// Its value \[1/sr\] at `cos_theta` in [−1, 1].
    pub fn at(self, cos_theta: f64) -> f64 {
        match self {
            Self::Isotropic => 1.0 / (4.0 * PI),
            Self::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos_theta * cos_theta),
            Self::HenyeyGreenstein(g) => {
                (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::quadrature::integrate;
    use super::*;

    #[test]
    fn each_integrates_to_one_over_the_sphere_and_its_mean_cosine_is_g() {
        let cases = [
            (PhaseFunction::Isotropic, 0.0),
            (PhaseFunction::Rayleigh, 0.0),
            (PhaseFunction::HenyeyGreenstein(0.0), 0.0),
            (PhaseFunction::HenyeyGreenstein(0.76), 0.76),
            (PhaseFunction::HenyeyGreenstein(-0.99), -0.99),
        ];
        for (phase, g) in cases {
            let sphere = integrate(&|mu| 2.0 * PI * phase.at(mu), -1.0, 1.0);
            let mean = integrate(&|mu| 2.0 * PI * mu * phase.at(mu), -1.0, 1.0);
            // The quadrature stops at 1e-13; the lobe of |g| = 0.99 costs 2g/(1−g)² ulp of its cosine, 2e4 · 1e-16.
            assert!((sphere - 1.0).abs() < 1e-11 && (mean - g).abs() < 1e-11, "{phase:?}: {sphere} {mean}");
        }
    }

    #[test]
    fn a_positive_g_glows_when_one_looks_towards_the_light() {
        let phase = PhaseFunction::HenyeyGreenstein(0.5);
        // (1 − g²)/(1 − g)³ = 0.75/0.125 = 6 times the isotropic value ahead; 0.75/3.375 behind.
        assert!((phase.at(1.0) * 4.0 * PI - 6.0).abs() < 1e-14);
        assert!((phase.at(-1.0) * 4.0 * PI - 0.75 / 3.375).abs() < 1e-14);
    }
}
