//! What a frame requires, found in one cheap pass, so that a technique models nothing else (ARCHITECTURE.md).

use crate::frame::Frame;
use crate::kinds::{LightKind, MapKind};
use crate::phase::Phase;
use crate::setup::Setup;

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
        let limit = frame.max_distance();
        let longest_ray = frame.depth().texels().iter().map(|&d| f64::from(d).min(limit)).fold(0.0, f64::max);
        Self::with(frame.setup(), longest_ray, frame.shadow().casts_shadow())
    }

    /// What the set-up alone tells: rays may be as long as `max_distance`, and every map may cast a shadow. O(1).
    pub fn of_setup(setup: &Setup<'_>) -> Self {
        Self::with(setup, setup.max_distance(), setup.maps().kind() != MapKind::Unshadowed)
    }

    fn with(setup: &Setup<'_>, longest_ray: f64, casts_shadow: bool) -> Self {
        let medium = setup.medium();
        let largest_sigma = medium.sigma_t().into_iter().fold(0.0, f64::max);
        let scattering = medium.components().iter().filter(|c| c.sigma_s.iter().any(|&s| s > 0.0));
        Self {
            size: setup.size(),
            shadow_map_side: setup.maps().largest_side(),
            light: LightKind::of(setup.light()),
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
            textured: setup.texture().is_some(),
            casts_shadow,
        }
    }
}
