//! How much light is lost along the view rays of a slice, in media whose density falls with height.

use glam::DVec3;
use scatter_core::{HeightFalloff, Medium, exp_f32};

use crate::geometry::SlicePlane;

/// Largest slope and logarithm: their products with light rays stay within f32.
const LARGEST: f64 = 1e18;

/// A frame's height fog: what its slices share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightFog {
    falloff: HeightFalloff,
    /// Logarithm of the extinction at the eye, of the channel that has most.
    ln_extinction: f32,
    /// Extinction of each channel over the largest.
    relative: [f32; 3],
    channels: usize,
}

impl HeightFog {
    /// Of a medium whose density falls with height; `None` of a uniform one.
    pub fn of(medium: &Medium, eye: DVec3) -> Option<Self> {
        let falloff = *medium.height_falloff()?;
        let sigma_t = medium.sigma_t();
        let most = sigma_t.into_iter().fold(0.0, f64::max);
        let ln_density = falloff.log_density(eye, DVec3::ZERO);
        // What nothing scatters has no shares; any number will do.
        let ln_extinction = if most > 0.0 { most.ln() + ln_density } else { 0.0 };
        Some(Self {
            falloff,
            ln_extinction: ln_extinction.clamp(-LARGEST, LARGEST) as f32,
            relative: sigma_t.map(|sigma| if most > 0.0 { (sigma / most) as f32 } else { 0.0 }),
            channels: if medium.is_grey() { 1 } else { 3 },
        })
    }

    /// Channels whose shares differ, 1 or 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Extinction of a channel over the largest one.
    pub fn relative(&self, channel: usize) -> f32 {
        self.relative[channel]
    }

    /// As a slice's view rays see it.
    pub fn in_slice(&self, plane: &SlicePlane) -> FogInSlice {
        let slope = |way: DVec3| self.falloff.slope(way).clamp(-LARGEST, LARGEST) as f32;
        FogInSlice {
            ln_extinction: self.ln_extinction,
            across: slope(plane.across),
            to_light: slope(plane.to_light),
        }
    }
}

/// The fog of one slice.
#[derive(Debug, Clone, Copy)]
pub struct FogInSlice {
    /// Logarithm of the largest extinction at the eye \[1/length\].
    pub ln_extinction: f32,
    across: f32,
    to_light: f32,
}

impl FogInSlice {
    /// `−d(ln ρ)/dγ` along a view ray, by 1/sin β and cos β.
    #[inline(always)]
    pub fn slope(&self, cosecant: f32, cosine: f32) -> f32 {
        self.across + self.to_light * (cosine * cosecant)
    }
}

/// Where density is largest between the eye and the light ray γ: there `ln ρ/ρ(eye)` is this; 0 or more.
#[inline(always)]
pub fn ln_densest(slope: f32, gamma: f32) -> f32 {
    let rise = -slope * gamma;
    if rise > 0.0 { rise } else { 0.0 }
}

/// What the length of a ray up to the light ray γ counts, relative to the density at its denser end: `γ/sin β·φ(|s·γ|)`,
/// ≤ its length.
#[inline(always)]
pub fn length_at_densest(cosecant: f32, slope: f32, gamma: f32) -> f32 {
    let x = (slope * gamma).abs();
    // Infinite where the ray never ends; 1/x is as good as 0 from here on.
    let x = if x < 1e30 { x } else { 1e30 };
    gamma * cosecant * absorbed_over(x)
}

/// Optical depth up to the light ray γ, wherever the eye is and however steeply the ray descends: relative to its denser end.
#[inline(always)]
pub fn steep_depth(cosecant: f32, slope: f32, ln_extinction: f32, gamma: f32) -> f32 {
    length_at_densest(cosecant, slope, gamma) * exp_f32(ln_extinction + ln_densest(slope, gamma))
}

/// The same by an exponential less, where neither the extinction over sin β at the eye, `factor`, nor `e^{−s·γ}` leaves f32.
#[inline(always)]
pub fn mild_depth(factor: f32, slope: f32, gamma: f32) -> f32 {
    factor * (gamma * absorbed_over(slope * gamma))
}

/// `1 − e^{−τ}` to a few roundings of f32, τ ≥ 0, also where it is tiny or infinite.
#[inline(always)]
pub fn absorbed(depth: f32) -> f32 {
    let thin = depth * absorbed_series(depth);
    let thick = 1.0 - exp_f32(-depth);
    if depth < 0.5 { thin } else { thick }
}

/// `φ(x) = (1 − e^{−x})/x`, x ≥ −80, φ(0) = 1.
#[inline(always)]
fn absorbed_over(x: f32) -> f32 {
    let thick = (1.0 - exp_f32(-x)) / x;
    if x.abs() < 0.5 { absorbed_series(x) } else { thick }
}

/// φ by its series: between −½ and ½ the first term left out is x⁸/9! < 1.1e-8.
#[inline(always)]
fn absorbed_series(x: f32) -> f32 {
    let mut series = -1.0f32 / 40320.0;
    for coefficient in [1.0 / 5040.0, -1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0] {
        series = series * x + coefficient;
    }
    series
}
