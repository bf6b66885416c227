//! Height fog: a density that falls exponentially with height, one for scattering and absorption (MODEL.md).

use glam::DVec3;

use crate::error::{ModelError, checked, checked_direction};

/// The density of height fog, `ρ(x) = exp(−(up·x − base_height)/scale_height)`: σs and σa of the medium are multiplied by
/// it, so they are what they are at the base height.
///
/// Along a view ray `ln ρ` is linear, so optical depths and the lit intervals of a sun have closed forms
/// ([`FogRay`](crate::FogRay)). A sun is not attenuated on its way; a lamp's light is, along the straight way from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightFalloff {
    up: DVec3,
    base_height: f64,
    scale_height: f64,
}

impl HeightFalloff {
    /// `up` is a direction of any length (it is normalised), `base_height` the height along it \[world units\] at which the
    /// density is 1, `scale_height` > 0 the height over which it falls by a factor of e \[world units\].
    ///
    /// Errors: an `up` of length 0, and numbers that are not finite.
    pub fn new(up: [f64; 3], base_height: f64, scale_height: f64) -> Result<Self, ModelError> {
        Ok(Self {
            up: checked_direction("medium.height_falloff.up", up)?,
            base_height: checked(
                "medium.height_falloff.base_height",
                base_height,
                |_| true,
                "a finite number",
            )?,
            scale_height: checked(
                "medium.height_falloff.scale_height",
                scale_height,
                |scale| scale > 0.0,
                "a finite number > 0",
            )?,
        })
    }

    /// Unit vector against which the density falls.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Height along [`Self::up`] at which the density is 1 \[world units\].
    pub fn base_height(&self) -> f64 {
        self.base_height
    }

    /// Height over which the density falls by a factor of e \[world units\], > 0.
    pub fn scale_height(&self) -> f64 {
        self.scale_height
    }

    /// `ln ρ` at the point `reference + offset` (world space), finite.
    ///
    /// The reference's height above the base comes first, so that a point near the eye keeps its digits however far the
    /// eye is from the origin.
    pub fn log_density(&self, reference: DVec3, offset: DVec3) -> f64 {
        let height = (self.up.dot(reference) - self.base_height) + self.up.dot(offset);
        finite(-height / self.scale_height)
    }

    /// `−d(ln ρ)/dt` along the unit direction `direction` \[1/length\]: > 0 where a ray climbs out of the fog. Finite.
    pub fn slope(&self, direction: DVec3) -> f64 {
        finite(self.up.dot(direction) / self.scale_height)
    }
}

/// Scale heights down to the smallest f64 make quotients that overflow. Sums of finite numbers are never NaN.
fn finite(quotient: f64) -> f64 {
    quotient.clamp(-f64::MAX, f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_is_one_at_the_base_and_falls_by_e_over_a_scale_height() {
        let fog = HeightFalloff::new([0.0, 3.0, 0.0], 2.0, 0.5).unwrap();
        assert_eq!(fog.up(), DVec3::Y);
        assert_eq!(fog.log_density(DVec3::new(7.0, 2.0, 1.0), DVec3::ZERO), 0.0);
        assert_eq!(fog.log_density(DVec3::new(7.0, 2.0, 1.0), DVec3::Y), -2.0);
        assert_eq!(fog.slope(DVec3::Y), 2.0);
        assert_eq!(fog.slope(DVec3::X), 0.0);
    }

    #[test]
    fn what_has_no_meaning_is_an_error_that_names_the_field() {
        let message = |up, base, scale| match HeightFalloff::new(up, base, scale) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        assert_eq!(message([0.0, 1e-200, 0.0], -1e300, 5e-324), "");
        assert!(message([0.0; 3], 0.0, 1.0).contains("medium.height_falloff.up"));
        assert!(message([0.0, f64::NAN, 1.0], 0.0, 1.0).contains("medium.height_falloff.up"));
        assert!(message([0.0, 1.0, 0.0], f64::INFINITY, 1.0).contains("medium.height_falloff.base_height"));
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let message = message([0.0, 1.0, 0.0], 0.0, scale);
            assert!(message.contains("medium.height_falloff.scale_height") && message.contains("> 0"));
        }
    }

    #[test]
    fn the_smallest_scale_height_gives_finite_numbers() {
        let fog = HeightFalloff::new([0.0, 1.0, 0.0], 1e300, 5e-324).unwrap();
        assert_eq!(fog.log_density(DVec3::ZERO, DVec3::ZERO), f64::MAX);
        assert_eq!(fog.slope(DVec3::NEG_Y), -f64::MAX);
    }
}
