//! Weights in height fog: the optical depth along view rays of a slice, by light ray.

use epipolar::driver::SliceView;
use glam::DVec3;
use scatter_core::{FogLanes, Medium, RayLanes, ViewRay};

const LANES: usize = RayLanes::COUNT;

/// The fog of a frame: extinction of the thickest channel, and the share that a channel has of it.
#[derive(Debug, Clone, Copy)]
pub struct Fog {
    log_sigma: f64,
    shares: [f32; 3],
}

impl Fog {
    /// Of a medium whose density falls with height; `None` of a uniform one.
    pub fn of(medium: &Medium) -> Option<Self> {
        medium.height_falloff()?;
        let sigma_t = medium.sigma_t();
        let most = sigma_t.into_iter().fold(0.0, f64::max);
        // What nothing scatters has no shares: any number will do.
        let shares = sigma_t.map(|sigma| if most > 0.0 { (sigma / most) as f32 } else { 0.0 });
        Some(Self { log_sigma: most.ln(), shares })
    }

    /// Optical depths of a channel, of sixteen view rays of a slice, up to the light rays `gammas`; and how fast the logarithm
    /// of the density falls there by γ. View rays are given by column, from the slice's first.
    #[inline(always)]
    pub fn depths(
        &self,
        slice: &SliceView<'_>,
        channel: usize,
        columns: &[u32; LANES],
        gammas: &[f32; LANES],
    ) -> [[f32; LANES]; 2] {
        let frame = slice.frame();
        let Some(falloff) = frame.medium().height_falloff() else { return [[0.0; LANES]; 2] };
        let (sines, cosines) = (slice.sines(), slice.cosines());
        let rays = RayLanes::from_fn(|lane| {
            let column = columns[lane] as usize;
            let (sine, cosine) = (f64::from(sines[column]), f64::from(cosines[column]));
            let direction = slice.plane.across * sine + slice.plane.to_light * cosine;
            ViewRay { origin: DVec3::ZERO, direction }
        });
        let fog = FogLanes::new(falloff, frame.camera().eye(), &rays);
        let (mut lengths, mut slopes) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let cosecant = 1.0 / sines[columns[lane] as usize];
            lengths[lane] = gammas[lane] * cosecant;
            slopes[lane] = (fog.slope[lane] * f64::from(cosecant)) as f32;
        }
        let mut depths = fog.optical_depths(self.log_sigma, &[0.0; LANES], &lengths);
        for depth in &mut depths {
            *depth *= self.shares[channel];
        }
        [depths, slopes]
    }
}
