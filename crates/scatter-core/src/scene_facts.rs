//! What a frame requires, found in one cheap pass, so that a technique models nothing else (ARCHITECTURE.md).

use crate::frame::Frame;
use crate::light::Light;
use crate::phase::Phase;

/// The kind of a frame's light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LightKind {
    /// A sun.
    Directional,
    /// A lamp.
    Point,
    /// A lamp with a cone.
    Spot,
}

/// Facts of a frame that choose inner loops and options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneFacts {
    /// `[width, height]` of the image.
    pub size: [u32; 2],
    /// Largest side of the shadow map in texels; 0 without one.
    pub shadow_map_side: u32,
    /// The light.
    pub light: LightKind,
    /// Whether all channels are extinguished alike.
    pub grey_extinction: bool,
    /// Largest `σt·D` over channels and pixels, with the way from the lamp left out; ∞ for an endless ray.
    pub max_optical_depth: f64,
    /// Longest ray \[world units\].
    pub longest_ray: f64,
    /// Whether a component's phase function depends on the angle.
    pub anisotropic: bool,
    /// Largest |g| of the components.
    pub largest_g: f64,
    /// Scattering components with σs > 0.
    pub component_count: usize,
    /// Whether the light carries a colour texture.
    pub textured: bool,
    /// Whether anything casts a shadow.
    pub casts_shadow: bool,
}

impl SceneFacts {
    /// Reads every depth texel, and shadow texels up to the first that holds a surface: O(pixels).
    pub fn of(frame: &Frame<'_>) -> Self {
        let medium = frame.medium();
        let limit = frame.max_distance();
        let longest_ray = frame.depth().texels().iter().map(|&d| f64::from(d).min(limit)).fold(0.0, f64::max);
        let largest_sigma = medium.sigma_t().into_iter().fold(0.0, f64::max);
        let scattering = medium.components().iter().filter(|c| c.sigma_s.iter().any(|&s| s > 0.0));
        Self {
            size: frame.size(),
            shadow_map_side: frame
                .shadow()
                .layers()
                .map(|layer| layer.projection().size().into_iter().max().unwrap_or(0))
                .max()
                .unwrap_or(0),
            light: match frame.light() {
                Light::Directional(_) => LightKind::Directional,
                Light::Point(_) => LightKind::Point,
                Light::Spot(_) => LightKind::Spot,
            },
            grey_extinction: medium.is_grey(),
            // 0·∞ is no depth at all.
            max_optical_depth: if largest_sigma > 0.0 { largest_sigma * longest_ray } else { 0.0 },
            longest_ray,
            anisotropic: scattering.clone().any(|c| !c.phase.is_isotropic()),
            largest_g: scattering
                .clone()
                .map(|c| if let Phase::HenyeyGreenstein { g } = c.phase { g.abs() } else { 0.0 })
                .fold(0.0, f64::max),
            component_count: scattering.count(),
            textured: frame.texture().is_some(),
            casts_shadow: frame.shadow().casts_shadow(),
        }
    }
}
