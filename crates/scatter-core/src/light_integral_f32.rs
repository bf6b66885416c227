//! The in-scattered radiance of any light along sixteen view rays at a time, in f32: what techniques multiply or sum.

use fearless_simd::Level;

use crate::lamp_interval_f32::LampIntegralF32;
use crate::light::Light;
use crate::ray_lanes::{LANES, RayLanes};
use crate::setup::Setup;
use crate::sun_integral_f32::SunIntegralF32;

/// A sun or a lamp along the view rays of one camera. Errors and costs as [`SunIntegralF32`] and [`LampIntegralF32`]
/// state them. The light's texture is left out.
#[derive(Debug, Clone)]
pub enum LightIntegralF32<'a> {
    /// A directional light.
    Sun(SunIntegralF32<'a>),
    /// A point or a spot light.
    Lamp(LampIntegralF32<'a>),
}

impl<'a> LightIntegralF32<'a> {
    /// Of a frame.
    pub fn new(setup: &Setup<'a>) -> Self {
        let (medium, camera) = (setup.medium(), setup.camera());
        match setup.light() {
            Light::Directional(sun) => Self::Sun(SunIntegralF32::new(sun, medium, camera)),
            Light::Point(lamp) => Self::Lamp(LampIntegralF32::point(lamp, medium, camera.eye())),
            Light::Spot(spot) => Self::Lamp(LampIntegralF32::spot(spot, medium, camera.eye())),
        }
    }

    /// In-scattered radiance of the lit intervals `[a, b]` of sixteen rays, 0 ≤ a ≤ b ≤ ∞, as `[channel][ray]`.
    #[inline(always)]
    pub fn intervals(
        &self,
        simd: Level,
        rays: &RayLanes,
        a: &[f32; LANES],
        b: &[f32; LANES],
    ) -> [[f32; LANES]; 3] {
        match self {
            Self::Sun(sun) => sun.intervals(rays, a, b),
            Self::Lamp(lamp) => lamp.intervals(simd, rays, a, b),
        }
    }

    /// Radiance of sixteen pixels from `(x, y)` on whose whole rays are lit, to where they end, `[channel][ray]`;
    /// `through` are the rays' transmittances there ([`transmittances_f32`](crate::transmittances_f32)).
    #[inline(always)]
    pub fn whole_rays(
        &self,
        simd: Level,
        setup: &Setup<'_>,
        (x, y): (u32, u32),
        ends: &[f32; LANES],
        through: &[[f32; LANES]; 3],
    ) -> [[f32; LANES]; 3] {
        match self {
            Self::Sun(sun) => sun.whole_rays(x, y, ends, through),
            Self::Lamp(lamp) => {
                lamp.intervals(simd, &RayLanes::of_pixels(setup.camera(), x, y), &[0.0; LANES], ends)
            }
        }
    }
}
