//! What the view rays of a frame meet of a height fog: the range of its density, and the largest optical depth.

use crate::at_level;
use crate::camera::{Projection, Window};
use crate::fog_lanes::{FogExtinction, FogLanes};
use crate::fog_ray::FogRay;
use crate::frame::Frame;
use crate::height_falloff::HeightFalloff;
use crate::ray_lanes::{LANES, RayLanes};
use crate::setup::Setup;
use crate::simd::simd_level;

/// Facts of a frame in height fog.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FogFacts {
    /// Smallest and largest `ln ρ` on the view rays.
    pub(crate) log_density: [f64; 2],
    /// Largest optical depth of a view ray, over the channels.
    pub(crate) optical_depth: f64,
}

impl FogFacts {
    /// From where every ray ends: O(pixels), about two exponentials a pixel. `None` in a uniform medium.
    pub(crate) fn of(frame: &Frame<'_>) -> Option<Self> {
        let fog = FogExtinction::new(frame.medium(), frame.camera().eye())?;
        let ([width, height], limit) = (frame.size(), frame.max_distance());
        let mut all = Self { log_density: [f64::INFINITY, f64::NEG_INFINITY], optical_depth: 0.0 };
        at_level!(simd_level(), {
            for y in 0..height {
                let row = &frame.depth().texels()[(y * width) as usize..][..width as usize];
                for (index, depths) in row.chunks(LANES).enumerate() {
                    // Lanes behind the row's end repeat its last pixel's depth on rays beside the image.
                    let mut ends = [0.0f32; LANES];
                    for (lane, end) in ends.iter_mut().enumerate() {
                        *end = (f64::from(depths[lane.min(depths.len() - 1)]).min(limit)) as f32;
                    }
                    let rays = RayLanes::of_pixels(frame.camera(), index as u32 * LANES as u32, y);
                    all.add(&fog, &rays, &ends, depths.len());
                }
            }
        });
        if fog.thickest == 0.0 {
            all.optical_depth = 0.0;
        }
        // f32's largest number stands for ∞.
        if all.optical_depth >= f64::from(f32::MAX) {
            all.optical_depth = f64::INFINITY;
        }
        Some(all)
    }

    #[inline(always)]
    fn add(&mut self, fog: &FogExtinction, rays: &RayLanes, ends: &[f32; LANES], count: usize) {
        let lanes = FogLanes::new(&fog.falloff, fog.eye, rays);
        let depths = lanes.optical_depths(fog.log_thickest, &[0.0; LANES], ends);
        for lane in 0..count {
            let ray = FogRay::from_parts(lanes.log_density[lane], lanes.slope[lane]);
            let [from, to] = [ray.log_density(), ray.log_density_at(ends[lane].into())];
            self.log_density[0] = self.log_density[0].min(from).min(to);
            self.log_density[1] = self.log_density[1].max(from).max(to);
            self.optical_depth = self.optical_depth.max(depths[lane].into());
        }
    }

    /// Bounds of them from the set-up alone, with all rays as long as they may be: from a cone around the camera's axis
    /// that holds the window. O(1).
    pub(crate) fn of_setup(setup: &Setup<'_>) -> Option<Self> {
        let falloff = setup.medium().height_falloff()?;
        let length = setup.max_distance();
        let thickest = setup.medium().sigma_t().into_iter().fold(0.0, f64::max);
        let mut all = Self { log_density: [f64::INFINITY, f64::NEG_INFINITY], optical_depth: 0.0 };
        for (start, direction) in extreme_rays(setup, falloff) {
            let ray = FogRay::from_parts(start, direction);
            let end = ray.log_density_at(length);
            all.log_density[0] = all.log_density[0].min(start).min(end);
            all.log_density[1] = all.log_density[1].max(start).max(end);
            all.optical_depth = all.optical_depth.max(ray.optical_depth(thickest, length));
        }
        Some(all)
    }
}

/// `ln ρ` at the start and its slope, of rays that bound all rays of a camera.
fn extreme_rays(setup: &Setup<'_>, falloff: &HeightFalloff) -> [(f64, f64); 4] {
    let camera = setup.camera();
    let Window { left, right, bottom, top } = camera.window();
    let corners = [(left, bottom), (left, top), (right, bottom), (right, top)];
    if camera.projection() == Projection::Orthographic {
        let slope = falloff.slope(camera.forward());
        let start = |(u, v)| falloff.log_density(camera.eye(), camera.right() * u + camera.up() * v);
        return corners.map(|corner| (start(corner), slope));
    }
    let farthest = corners.iter().map(|(u, v)| u.hypot(*v)).fold(0.0, f64::max).atan();
    let angle = falloff.up().dot(camera.forward()).clamp(-1.0, 1.0).acos();
    let start = falloff.log_density(camera.eye(), glam::DVec3::ZERO);
    let slope = |angle: f64| (angle.cos() / falloff.scale_height()).clamp(-f64::MAX, f64::MAX);
    let steepest = slope((angle - farthest).max(0.0));
    let deepest = slope((angle + farthest).min(std::f64::consts::PI));
    // The thickest way lies between them where the eye is in the densest fog it sees, never beyond.
    [(start, steepest), (start, deepest), (start, steepest), (start, deepest)]
}
