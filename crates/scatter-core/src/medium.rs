//! A medium: a short list of scattering components that share one extinction, uniform or as height fog.

use glam::DVec3;

use crate::camera::ViewRay;
use crate::error::{ModelError, checked_rgb};
use crate::fog_ray::FogRay;
use crate::height_falloff::HeightFalloff;
use crate::phase::Phase;

/// One kind of particle: how much it scatters, and where to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scattering {
    /// RGB scattering coefficient σs \[1/length\], finite, ≥ 0.
    pub sigma_s: [f64; 3],
    /// Its phase function.
    pub phase: Phase,
}

/// Scattering components and absorption; `σt = Σ σs + σa`. The same everywhere, or with a density that falls with height
/// ([`Self::with_height_falloff`]), by which all coefficients are multiplied.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    pub(crate) components: Vec<Scattering>,
    pub(crate) sigma_a: [f64; 3],
    pub(crate) sigma_t: [f64; 3],
    pub(crate) height_falloff: Option<HeightFalloff>,
}

impl Medium {
    /// A medium of any number of components; air is Rayleigh + Henyey-Greenstein.
    pub fn new(components: Vec<Scattering>, sigma_a: [f64; 3]) -> Result<Self, ModelError> {
        let sigma_a = checked_rgb("medium.absorption", sigma_a)?;
        let mut sigma_t = sigma_a;
        for component in &components {
            let sigma_s = checked_rgb("medium.scattering", component.sigma_s)?;
            if let Phase::HenyeyGreenstein { g } = component.phase {
                Phase::henyey_greenstein(g)?;
            }
            for (t, s) in sigma_t.iter_mut().zip(sigma_s) {
                *t += s;
            }
        }
        let sigma_t = checked_rgb("medium extinction", sigma_t)?;
        Ok(Self { components, sigma_a, sigma_t, height_falloff: None })
    }

    /// A medium of one component.
    pub fn homogeneous(sigma_s: [f64; 3], sigma_a: [f64; 3], phase: Phase) -> Result<Self, ModelError> {
        Self::new(vec![Scattering { sigma_s, phase }], sigma_a)
    }

    /// The same medium as height fog: its coefficients are what they are at the falloff's base height.
    pub fn with_height_falloff(self, falloff: HeightFalloff) -> Self {
        Self { height_falloff: Some(falloff), ..self }
    }

    /// How the density falls with height; `None` in a uniform medium.
    pub fn height_falloff(&self) -> Option<&HeightFalloff> {
        self.height_falloff.as_ref()
    }

    /// The density along a ray of a camera whose eye is at `eye` (world space); `None` in a uniform medium.
    pub fn fog_ray(&self, eye: DVec3, ray: &ViewRay) -> Option<FogRay> {
        self.height_falloff.as_ref().map(|falloff| FogRay::new(falloff, eye, ray))
    }

    /// The scattering components.
    pub fn components(&self) -> &[Scattering] {
        &self.components
    }

    /// RGB absorption σa \[1/length\] (height fog: at the base height).
    pub fn sigma_a(&self) -> [f64; 3] {
        self.sigma_a
    }

    /// RGB extinction σt \[1/length\] (height fog: at the base height).
    pub fn sigma_t(&self) -> [f64; 3] {
        self.sigma_t
    }

    /// `Σ σs·p` over the components, RGB \[1/(length·sr)\], at `haversine = sin²(θ/2)` of the phase angle.
    pub fn scattering_towards(&self, haversine: f64) -> DVec3 {
        self.components
            .iter()
            .map(|component| DVec3::from(component.sigma_s) * component.phase.at_haversine(haversine))
            .sum()
    }

    /// Whether all three channels are extinguished alike.
    pub fn is_grey(&self) -> bool {
        self.sigma_t[0] == self.sigma_t[1] && self.sigma_t[1] == self.sigma_t[2]
    }

    /// Transmittance per channel of the first `distance` of a ray of a camera whose eye is at `eye` (world space):
    /// [`Self::transmittance`] in a uniform medium, `exp(−τ)` of its [`FogRay`] in height fog.
    pub fn transmittance_along(&self, eye: DVec3, ray: &ViewRay, distance: f64) -> [f64; 3] {
        match self.fog_ray(eye, ray) {
            None => self.transmittance(distance),
            Some(fog) => self.sigma_t.map(|sigma| fog.transmittance(sigma, distance)),
        }
    }

    /// `exp(−σt·distance)` per channel; 1 where σt = 0, at any distance. In height fog: of a way at the base height; of a
    /// view ray ask [`Self::transmittance_along`].
    pub fn transmittance(&self, distance: f64) -> [f64; 3] {
        self.sigma_t.map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * distance).exp() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extinction_is_the_sum_of_scattering_and_absorption() {
        let air = Medium::new(
            vec![
                Scattering { sigma_s: [1.0, 2.0, 4.0], phase: Phase::Rayleigh },
                Scattering { sigma_s: [3.0; 3], phase: Phase::HenyeyGreenstein { g: 0.7 } },
            ],
            [0.5, 0.25, 0.0],
        );
        assert_eq!(air.unwrap().sigma_t(), [4.5, 5.25, 7.0]);
    }

    #[test]
    fn transmittance_is_multiplicative() {
        let medium = Medium::homogeneous([0.3, 0.1, 0.0], [0.0; 3], Phase::Isotropic).unwrap();
        let (a, b, ab) = (medium.transmittance(2.0), medium.transmittance(3.0), medium.transmittance(5.0));
        for c in 0..3 {
            assert!((a[c] * b[c] - ab[c]).abs() < 1e-15);
        }
        assert_eq!(medium.transmittance(f64::INFINITY), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn negative_or_nan_coefficients_are_errors() {
        assert!(Medium::homogeneous([-0.1, 0.0, 0.0], [0.0; 3], Phase::Isotropic).is_err());
        assert!(Medium::homogeneous([0.1; 3], [0.0, f64::NAN, 0.0], Phase::Isotropic).is_err());
        assert!(Medium::homogeneous([1e308; 3], [1e308; 3], Phase::Isotropic).is_err());
    }
}
