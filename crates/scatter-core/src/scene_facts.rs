//! What a frame requires, found in one cheap pass, so that a technique models nothing else (ARCHITECTURE.md).

use crate::fog_facts::FogFacts;
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
    /// Largest optical depth of a view ray over channels and pixels, with the way from the lamp left out: `σt·D`, or
    /// height fog's `τ(D)` (in f32 of a frame, a bound of a set-up). ∞ for an endless ray that is not extinguished less
    /// and less.
    pub max_optical_depth: f64,
    /// Height fog: smallest and largest `ln ρ` on the view rays, between the eye and where they end; may be infinite where
    /// rays are endless. `None` in a uniform medium.
    pub log_density: Option<[f64; 2]>,
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
    /// Whether translucent occluders dim the light.
    pub translucent: bool,
}

impl SceneFacts {
    /// Reads every depth texel, and shadow texels up to the first that holds a surface: O(pixels).
    pub fn of(frame: &Frame<'_>) -> Self {
        let limit = frame.max_distance();
        let longest_ray = f64::from(largest(frame.depth().texels())).min(limit);
        let fog = FogFacts::of(frame);
        Self::with(frame.setup(), longest_ray, frame.shadow().casts_shadow(), fog)
    }

    /// What the set-up alone tells: rays may be as long as `max_distance`, and every map may cast a shadow. O(1).
    pub fn of_setup(setup: &Setup<'_>) -> Self {
        let casts_shadow = setup.maps().kind() != MapKind::Unshadowed;
        Self::with(setup, setup.max_distance(), casts_shadow, FogFacts::of_setup(setup))
    }

    fn with(setup: &Setup<'_>, longest_ray: f64, casts_shadow: bool, fog: Option<FogFacts>) -> Self {
        let medium = setup.medium();
        let largest_sigma = medium.sigma_t().into_iter().fold(0.0, f64::max);
        let scattering = medium.components().iter().filter(|c| c.sigma_s.iter().any(|&s| s > 0.0));
        Self {
            size: setup.size(),
            shadow_map_side: setup.maps().largest_side(),
            light: LightKind::of(setup.light()),
            grey_extinction: medium.is_grey(),
            max_optical_depth: match &fog {
                Some(fog) => fog.optical_depth,
                None if largest_sigma > 0.0 => largest_sigma * longest_ray,
                // 0·∞ is no depth at all.
                None => 0.0,
            },
            log_density: fog.map(|fog| fog.log_density),
            longest_ray,
            anisotropic: scattering.clone().any(|c| !c.phase.is_isotropic()),
            largest_g: scattering
                .clone()
                .map(|c| if let Phase::HenyeyGreenstein { g } = c.phase { g.abs() } else { 0.0 })
                .fold(0.0, f64::max),
            component_count: scattering.count(),
            textured: setup.texture().is_some(),
            casts_shadow,
            translucent: setup.translucent(),
        }
    }
}

/// The largest of depths, which are ≥ 0 and no NaN: sixteen at a time, since one maximum after the other waits for the last.
fn largest(depths: &[f32]) -> f32 {
    const LANES: usize = 16;
    let (blocks, rest) = depths.as_chunks::<LANES>();
    let mut largest = [0.0f32; LANES];
    for block in blocks {
        for (largest, &depth) in largest.iter_mut().zip(block) {
            *largest = if depth > *largest { depth } else { *largest };
        }
    }
    rest.iter().chain(&largest).copied().fold(0.0, f32::max)
}
