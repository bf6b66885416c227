//! Phase functions, normalised to 1 over the sphere: isotropic, Rayleigh and Henyey-Greenstein.
//!
//! The phase angle is written down here once: `cos_theta = dot(light_travel_dir, dir_to_camera)`. With it
//! Henyey-Greenstein reads `1 + g² − 2g·cosθ`, and g > 0 glows when one looks **towards** the light. (pbrt's two
//! directions both point away from the scattering point, hence its plus sign.)

use std::f64::consts::PI;

use crate::error::{ModelError, checked};

/// `1 / 4π`: the isotropic phase function \[1/sr\].
pub const INV_4PI: f64 = 1.0 / (4.0 * PI);

/// How a medium scatters, by the angle between the light's travel and the way to the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// The same in all directions.
    Isotropic,
    /// Molecules: `3/16π · (1 + cos²θ)`.
    Rayleigh,
    /// Henyey and Greenstein 1941.
    HenyeyGreenstein {
        /// Mean cosine, |g| ≤ 0.9999.
        g: f64,
    },
}

impl Phase {
    /// Henyey-Greenstein with mean cosine `g` in [−0.9999, 0.9999].
    pub fn henyey_greenstein(g: f64) -> Result<Self, ModelError> {
        let g = checked("medium.g", g, |v| v.abs() <= 0.9999, "a number in [-0.9999, 0.9999]")?;
        Ok(Self::HenyeyGreenstein { g })
    }

    /// The phase function \[1/sr\] at `cos_theta` in [−1, 1].
    ///
    /// Near the lobe of a strong g prefer [`Self::at_haversine`]: rounding in the cosine alone costs
    /// `2g/(1−g)²·2⁻⁵³` of the value (1e-8 at g = 0.9999).
    pub fn at(&self, cos_theta: f64) -> f64 {
        self.at_haversine(0.5 * (1.0 - cos_theta))
    }

    /// The phase function at `haversine = sin²(θ/2)`, in [0, 1].
    ///
    /// With unit vectors `a` (light travel) and `b` (to the camera) it is `|a − b|²/4`, which has all its digits
    /// where the cosine has lost them. The denominator is `(1−g)² + 4g·sin²(θ/2)` for g ≥ 0 and its mirror image for
    /// g < 0: a sum of two non-negative terms, exact to rounding up to |g| = 0.9999.
    pub fn at_haversine(&self, haversine: f64) -> f64 {
        let sin_sq = haversine.clamp(0.0, 1.0);
        match *self {
            Self::Isotropic => INV_4PI,
            Self::Rayleigh => {
                let cos = 1.0 - 2.0 * sin_sq;
                0.75 * INV_4PI * (1.0 + cos * cos)
            }
            Self::HenyeyGreenstein { g } => {
                let away = if g >= 0.0 { sin_sq } else { 1.0 - sin_sq };
                let gap = 1.0 - g.abs();
                let denominator = gap * gap + 4.0 * g.abs() * away;
                INV_4PI * gap * (1.0 + g.abs()) / (denominator * denominator.sqrt())
            }
        }
    }

    /// [`Self::at_haversine`] in f32, from `sin²(θ/2)` and `cos²(θ/2)` both, so that neither lobe cancels.
    #[inline]
    pub fn at_haversine_f32(&self, sin_sq: f32, cos_sq: f32) -> f32 {
        const INV_4PI: f32 = self::INV_4PI as f32;
        match *self {
            Self::Isotropic => INV_4PI,
            Self::Rayleigh => {
                let cos = cos_sq - sin_sq;
                0.75 * INV_4PI * (1.0 + cos * cos)
            }
            Self::HenyeyGreenstein { g } => {
                let away = if g >= 0.0 { sin_sq } else { cos_sq };
                let gap = (1.0 - g.abs()) as f32;
                let g = g.abs() as f32;
                let denominator = gap * gap + 4.0 * g * away;
                INV_4PI * gap * (1.0 + g) / (denominator * denominator.sqrt())
            }
        }
    }

    /// Whether the value depends on the angle.
    pub fn is_isotropic(&self) -> bool {
        matches!(self, Self::Isotropic | Self::HenyeyGreenstein { g: 0.0 })
    }

    /// The largest value over all angles \[1/sr\].
    pub fn peak(&self) -> f64 {
        match *self {
            Self::HenyeyGreenstein { g } if g < 0.0 => self.at_haversine(1.0),
            _ => self.at_haversine(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Phase; 8] = [
        Phase::Isotropic,
        Phase::Rayleigh,
        Phase::HenyeyGreenstein { g: 0.0 },
        Phase::HenyeyGreenstein { g: 0.5 },
        Phase::HenyeyGreenstein { g: -0.5 },
        Phase::HenyeyGreenstein { g: 0.99 },
        Phase::HenyeyGreenstein { g: -0.99 },
        Phase::HenyeyGreenstein { g: 0.9999 },
    ];

    /// `∫ f dΩ` by the midpoint rule in `y = ln(haversine + ε)`, which resolves a lobe of any width.
    fn over_the_sphere(f: impl Fn(f64) -> f64) -> f64 {
        let count = 200_000;
        let smallest = 1e-12f64;
        let half = |mirror: bool| -> f64 {
            let step = (0.5f64 / smallest).ln() / f64::from(count);
            (0..count)
                .map(|i| {
                    let h = smallest * ((f64::from(i) + 0.5) * step).exp();
                    f(if mirror { 1.0 - h } else { h }) * h * step
                })
                .sum()
        };
        // dΩ = 2π d(cosθ) = 4π d(haversine).
        4.0 * PI * (half(false) + half(true))
    }

    #[test]
    fn every_phase_function_integrates_to_one_over_the_sphere() {
        for phase in ALL {
            let sum = over_the_sphere(|h| phase.at_haversine(h));
            // The midpoint rule's own error is 1e-8; the cut-off at 1e-12 costs 1e-4 · of the narrowest lobe.
            assert!((sum - 1.0).abs() < 2e-4, "{phase:?}: {sum}");
        }
    }

    #[test]
    fn g_is_the_mean_cosine() {
        for g in [-0.99, -0.5, 0.0, 0.3, 0.99] {
            let phase = Phase::HenyeyGreenstein { g };
            let mean = over_the_sphere(|h| phase.at_haversine(h) * (1.0 - 2.0 * h));
            assert!((mean - g).abs() < 1e-4, "{g}: {mean}");
        }
    }

    #[test]
    fn positive_g_glows_when_one_looks_towards_the_light() {
        // Looking towards the sun: the light travels towards the camera, so cosθ = +1.
        let light_travel_dir = glam::DVec3::NEG_Z;
        let dir_to_camera = glam::DVec3::NEG_Z;
        let phase = Phase::HenyeyGreenstein { g: 0.8 };
        let towards = phase.at(light_travel_dir.dot(dir_to_camera));
        let away = phase.at(light_travel_dir.dot(-dir_to_camera));
        // (1−g²)/(1∓g)³: ratio ((1+g)/(1−g))³ = 729.
        assert!((towards / away - 729.0).abs() < 1e-9);
    }

    #[test]
    fn the_peak_of_a_needle_is_exact() {
        // (1−g²)/(1−g)³/4π = (1+g)/(1−g)²/4π; the naive f32 form gives 143141 instead of 159079 at g = 0.999.
        let value = Phase::HenyeyGreenstein { g: 0.999 }.at_haversine(0.0);
        assert!((value / 159_075.366_8 - 1.0).abs() < 1e-5, "{value}");
        let needle = Phase::HenyeyGreenstein { g: 0.9999 };
        let exact = 1.9999 / (0.0001f64 * 0.0001) * INV_4PI;
        // 1 − 0.9999 in f64 is 1e-4 to 1e-12 relative; it enters squared.
        assert!((needle.peak() / exact - 1.0).abs() < 1e-11);
    }

    #[test]
    fn g_outside_of_its_range_is_an_error() {
        for g in [1.0, -1.0, 0.99995, f64::NAN] {
            assert!(Phase::henyey_greenstein(g).is_err());
        }
    }
}
