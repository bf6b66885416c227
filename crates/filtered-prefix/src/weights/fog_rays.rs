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

    /// Optical depth of each channel over that of the thickest.
    pub fn shares(&self) -> [f32; 3] {
        self.shares
    }

    /// Replaces light rays by the optical depths of the thickest channel up to them, on the view rays of `columns`.
    #[inline(always)]
    pub fn find_depths(&self, slice: &SliceView<'_>, columns: &[u32], gammas: &mut [f32]) {
        let Some(&some) = columns.first() else { return };
        for (columns, gammas) in columns.chunks(LANES).zip(gammas.chunks_mut(LANES)) {
            let (mut own_columns, mut own_gammas) = ([some; LANES], [0.0f32; LANES]);
            own_columns[..columns.len()].copy_from_slice(columns);
            own_gammas[..columns.len()].copy_from_slice(gammas);
            let [depths, _] = self.thickest_depths(slice, &own_columns, &own_gammas);
            gammas.copy_from_slice(&depths[..columns.len()]);
        }
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
        let [mut depths, slopes] = self.thickest_depths(slice, columns, gammas);
        for depth in &mut depths {
            *depth *= self.shares[channel];
        }
        [depths, slopes]
    }

    #[inline(always)]
    fn thickest_depths(
        &self,
        slice: &SliceView<'_>,
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
        [fog.optical_depths(self.log_sigma, &[0.0; LANES], &lengths), slopes]
    }
}
