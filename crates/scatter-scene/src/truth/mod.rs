//! Ray-cast truth: visibility by the triangles themselves, without sampling, in f64 (MODEL.md, References).
//!
//! For one view ray and one light all shadow rays lie in one plane. Each triangle meets that plane in a segment and
//! shadows one closed-form interval of the ray (`shadow_plane`); the union of the intervals is exact
//! (`shadow_spans`), and each lit rest is integrated in closed form ([`RayLight`]). A closed mesh is cut in closed
//! polylines (`caster::ray_plane`) whose intervals abut bit by bit, and the ray's own first hit is a crossing of the
//! same polylines: inside of a closed mesh the radiance is exactly 0.

mod shadow_plane;
mod shadow_spans;
mod shadow_walk;

#[cfg(test)]
mod second_way;
#[cfg(test)]
mod tests;

use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, LightKind, Limits, MAX_CASCADES, MapKind, PhaseKind,
    RayLight, RenderError, RenderStats, ScatterImage, SceneFacts, StageClock, ViewRay, VolumetricShadow,
    parallel,
};

use crate::caster::{RayPlane, SceneCaster};
use shadow_plane::LightOnRay;
use shadow_walk::{ShadowWalk, WalkCounts};

/// The reference that sees the triangles: id `truth-raycast`.
///
/// It ignores the frame's depth and shadow maps. Memory: 8 bytes a pixel and little else, reused from frame to frame.
#[derive(Debug)]
pub struct RaycastTruth<'a> {
    caster: &'a SceneCaster,
    /// `[y][x]`: where each pixel's ray ends.
    ray_ends: Vec<f64>,
    /// A walk's buffers for each thread of the pool.
    walks: Vec<Mutex<ShadowWalk>>,
    /// Counts of each row.
    row_counts: Vec<WalkCounts>,
}

/// Every light, medium and camera of the model; no map is read.
const CAPABILITIES: Capabilities = Capabilities {
    lights: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    glass: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    maps: &[
        MapKind::Unshadowed,
        MapKind::Orthographic,
        MapKind::Perspective,
        MapKind::Cube,
        MapKind::Faces,
        MapKind::Cascades,
    ],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre, CameraKind::Orthographic],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
};

impl<'a> RaycastTruth<'a> {
    /// The truth of this scene.
    pub fn new(caster: &'a SceneCaster) -> Self {
        Self { caster, ray_ends: Vec::new(), walks: Vec::new(), row_counts: Vec::new() }
    }

    fn find_ray_ends(&mut self, frame: &Frame<'_>) {
        let [width, height] = frame.size();
        self.ray_ends.clear();
        self.ray_ends.resize(width as usize * height as usize, 0.0);
        let caster = self.caster;
        parallel::for_each_row(&mut self.ray_ends, width as usize, |y, row| {
            for (x, end) in row.iter_mut().enumerate() {
                let ray = frame.camera().pixel_ray(x as u32, y as u32);
                let light = LightOnRay::new(frame.light(), frame.camera().eye(), &ray);
                // A hit beyond max_distance is not looked for, as if it were not there.
                *end = caster
                    .first_crossing(light.plane(), frame.max_distance())
                    .unwrap_or(frame.max_distance());
            }
        });
    }

    fn integrate(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) {
        let [width, height] = frame.size();
        self.row_counts.clear();
        self.row_counts.resize(height as usize, WalkCounts::default());
        let threads = rayon::current_num_threads().max(1);
        while self.walks.len() < threads {
            self.walks.push(Mutex::default());
        }
        let Self { caster, ray_ends, walks, row_counts } = self;
        let width = width as usize;
        let (inscattered, transmittance) = out.pixels_mut();
        let ray_ends = &*ray_ends;
        let images = (inscattered, transmittance, row_counts.as_mut_slice());
        parallel::for_each_band(images, [width, 1], |y, inscattered, transmittance, counts| {
            let ends = &ray_ends[y * width..][..width];
            let thread = rayon::current_thread_index().unwrap_or(0) % walks.len();
            // A poisoned walk holds nothing that the next row reads.
            let mut walk = walks[thread].lock().unwrap_or_else(PoisonError::into_inner);
            walk.restart();
            for x in 0..width {
                let ray = frame.camera().pixel_ray(x as u32, y as u32);
                let radiance = ray_radiance(caster, &mut walk, frame, &ray, ends[x]);
                inscattered[x] = radiance.as_vec3().to_array();
                transmittance[x] = frame.medium().transmittance(ends[x]).map(|t| t as f32);
            }
            counts[0] = walk.counts;
        });
    }

    fn memory_bytes(&self) -> u64 {
        let walks = self.walks.iter().map(|walk| walk.lock().map_or(0, |walk| walk.memory_bytes()));
        let rows = self.row_counts.capacity() * size_of::<WalkCounts>();
        (self.ray_ends.capacity() * size_of::<f64>() + rows) as u64 + walks.sum::<u64>()
    }
}

impl VolumetricShadow for RaycastTruth<'_> {
    fn id(&self) -> &'static str {
        "truth-raycast"
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        out.resize(frame.size());
        self.find_ray_ends(frame);
        clock.lap(&mut stats, "first-hit");
        self.integrate(frame, out);
        clock.lap(&mut stats, "shadow");
        let total = |count: fn(&WalkCounts) -> u64| self.row_counts.iter().map(count).sum();
        stats.counts.push("boxes", total(|c| c.boxes));
        stats.counts.push("candidates", total(|c| c.candidates));
        stats.counts.push("intervals", total(|c| c.intervals));
        stats.modelled.push("exact-visibility", ());
        // No map is read.
        let facts = SceneFacts { casts_shadow: false, ..SceneFacts::of_setup(frame.setup()) };
        stats.push_modelled(&facts);
        if facts.light == LightKind::Spot {
            stats.modelled.push("cone", ());
        }
        stats.memory_bytes = self.memory_bytes() + self.caster.memory_bytes();
        Ok(stats)
    }
}

/// In-scattered radiance of one ray that ends at `end`.
fn ray_radiance(
    caster: &SceneCaster,
    walk: &mut ShadowWalk,
    frame: &Frame<'_>,
    ray: &ViewRay,
    end: f64,
) -> DVec3 {
    let eye = frame.camera().eye();
    let light = RayLight::new(frame.light(), frame.medium(), eye, ray);
    let all_or_nothing =
        |dark: bool| if dark { DVec3::ZERO } else { lit_radiance(frame, &light, ray, 0.0, end) };
    match LightOnRay::new(frame.light(), eye, ray) {
        LightOnRay::Plane(shadow) => {
            walk.collect(caster, &shadow, end);
            walk.spans.lit().map(|(a, b)| lit_radiance(frame, &light, ray, a, b)).sum()
        }
        // A surface before the light shadows all before it, and the ray does not get past it. Without one all points
        // see the light: those behind a lamp too, since the ray ends at the first surface behind it.
        LightOnRay::Towards(plane, distance) => all_or_nothing(caster.any_crossing(&plane, distance)),
        // Light that comes from behind reaches all of the ray or nothing.
        LightOnRay::Away(plane, distance) => {
            let back = RayPlane::any(plane.reference, plane.start, -plane.along);
            all_or_nothing(caster.any_crossing(&back, distance))
        }
    }
}

/// In-scattered radiance of the lit interval `[a, b]`, through the light's texture if it has one.
fn lit_radiance(frame: &Frame<'_>, light: &RayLight<'_>, ray: &ViewRay, a: f64, b: f64) -> DVec3 {
    let Some(texture) = frame.texture() else { return light.interval(a, b) };
    let mut sum = DVec3::ZERO;
    texture.pieces(frame.camera().eye(), ray.origin, ray.direction, [a, b], |a, b, colour| {
        if colour != [0.0; 3] {
            sum += light.interval(a, b) * DVec3::from(colour.map(f64::from));
        }
    });
    sum
}
