//! Ray-cast truth: visibility by the triangles themselves, without sampling, in f64 (MODEL.md, References).
//!
//! For one view ray and one light all shadow rays lie in one plane. Each triangle meets that plane in a segment and
//! shadows one closed-form interval of the ray (`shadow_plane`); the union of the intervals is exact
//! (`shadow_spans`), and each lit rest is integrated in closed form ([`RayLight`](scatter_core::RayLight)). A closed mesh is cut in closed
//! polylines (`caster::ray_plane`) whose intervals abut bit by bit, and the ray's own first hit is a crossing of the
//! same polylines: inside of a closed mesh the radiance is exactly 0.
//!
//! Smoke and hair dim what is lit (`dimming`): spheres cut that plane in discs, strands pass near its shadow rays, and the
//! product of their transmittances is integrated between all kinks and jumps to 1e-9 of the ray's unoccluded radiance.

mod dimming;
mod disc_shadow;
mod mask_line;
mod ray_radiance;
mod shadow_plane;
mod shadow_spans;
mod shadow_walk;
mod strand_shadow;
mod sun_wedge;
mod wedge_frame;

#[cfg(test)]
mod second_way;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::DVec3;
use rayon::prelude::*;
use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Light, LightKind, Limits, MAX_CASCADES, MapKind,
    PhaseKind, Projection, RenderError, RenderStats, ScatterImage, SceneFacts, StageClock, Unsupported,
    ViewRay, VolumetricShadow, parallel,
};

use crate::caster::{RayPlane, SceneCaster};
use dimming::Dimming;
use ray_radiance::RayRadiance;
use shadow_plane::LightOnRay;
use shadow_walk::{ShadowWalk, WalkCounts};
use sun_wedge::{STEEPEST, SunWedge, WedgeRay};

/// The reference that sees the triangles: id `truth-raycast`.
///
/// It ignores the frame's depth and shadow maps, and dims light by the smoke and hair of its own scene, whatever the frame
/// says. Refuses scenes with a cut-out that shows over four million texels in a
/// row. Memory: 8 bytes a pixel, 36 under a sun, and little else, reused from frame to frame.
#[derive(Debug)]
pub struct RaycastTruth<'a> {
    caster: &'a SceneCaster,
    /// `[y][x]`: where each pixel's ray ends.
    ray_ends: Vec<f64>,
    /// A walk's buffers for each thread of the pool.
    walks: Vec<Mutex<Buffers>>,
    /// Counts of each row, or of each wedge.
    counts: Vec<WalkCounts>,
    /// Under a sun: the pixels by their planes' angles, their radiances in that order, and the wedges.
    by_angle: Vec<(f64, u32)>,
    sorted: Vec<[f32; 3]>,
    wedges: Vec<Range<usize>>,
}

/// Every light, medium and camera of the model; no map is read.
const CAPABILITIES: Capabilities = Capabilities {
    lights: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    textures: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
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
    height_fog: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    translucent: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
};

/// What one thread works with.
#[derive(Debug, Default)]
struct Buffers {
    walk: ShadowWalk,
    dimming: Dimming,
    wedge: SunWedge,
    rays: Vec<WedgeRay>,
}

/// Width of a wedge of rays that share their triangles \[radians\]. Narrower: fewer rays pay for the walk through the
/// tree. Wider: a leaf covers less of it, and what it hides is listed. At 30 m it is as wide as a leaf's third.
const WEDGE: f64 = 1e-3;
/// Texels that one cut-out may show along a line: a ray that sees it edge on has half as many lit stretches, 16 bytes
/// each, and takes a hundredth of a second.
const MOST_TEXELS: f64 = 4_194_304.0;
/// Rays of a wedge below which each walks alone, and above which it is cut, for the threads.
const SHARED_BY: [usize; 2] = [16, 4096];

impl<'a> RaycastTruth<'a> {
    /// The truth of this scene.
    pub fn new(caster: &'a SceneCaster) -> Self {
        Self {
            caster,
            ray_ends: Vec::new(),
            walks: Vec::new(),
            counts: Vec::new(),
            by_angle: Vec::new(),
            sorted: Vec::new(),
            wedges: Vec::new(),
        }
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
        let threads = rayon::current_num_threads().max(1);
        while self.walks.len() < threads {
            self.walks.push(Mutex::default());
        }
        match frame.light() {
            Light::Directional(sun) if frame.camera().projection() == Projection::Perspective => {
                self.sort_by_angle(frame, -sun.direction());
                self.integrate_wedges(frame, -sun.direction(), out);
            }
            _ => self.integrate_rows(frame, out),
        }
    }

    /// Sorts the pixels by their planes' angles about the line towards the sun, and cuts them into wedges. Rays that
    /// come too near to the sun's direction, or have no length, are last, in wedges of their own.
    fn sort_by_angle(&mut self, frame: &Frame<'_>, sun: DVec3) {
        let (camera, eye) = (frame.camera(), frame.camera().eye());
        let [width, _] = frame.size();
        let (right, up) = sun.any_orthonormal_pair();
        self.by_angle.clear();
        self.by_angle.resize(self.ray_ends.len(), (0.0, 0));
        let pixels = self.by_angle.par_iter_mut().zip(&self.ray_ends).enumerate();
        pixels.for_each(|(index, (out, &end))| {
            let ray = camera.pixel_ray(index as u32 % width, index as u32 / width);
            let angle = match LightOnRay::new(frame.light(), eye, &ray) {
                LightOnRay::Plane(shadow) if end > 0.0 && shadow.cotangent().abs() <= STEEPEST => {
                    shadow.across().dot(up).atan2(shadow.across().dot(right))
                }
                _ => f64::INFINITY,
            };
            *out = (angle, index as u32);
        });
        self.by_angle.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.wedges.clear();
        let mut first = 0;
        for index in 1..=self.by_angle.len() {
            let number = |index: usize| (self.by_angle[index].0 / WEDGE).floor();
            let is_last = index == self.by_angle.len() || index - first == SHARED_BY[1];
            if is_last || number(index) != number(first) {
                self.wedges.push(first..index);
                first = index;
            }
        }
    }

    fn integrate_wedges(&mut self, frame: &Frame<'_>, sun: DVec3, out: &mut ScatterImage) {
        let Self { caster, ray_ends, walks, counts, by_angle, sorted, wedges } = self;
        let (width, eye) = (frame.size()[0], frame.camera().eye());
        let ray_of = |index: u32| frame.camera().pixel_ray(index % width, index / width);
        counts.clear();
        counts.resize(wedges.len(), WalkCounts::default());
        sorted.clear();
        sorted.resize(by_angle.len(), [0.0; 3]);
        // Each wedge with its part of the output.
        let mut rest = sorted.as_mut_slice();
        let mut parts = Vec::with_capacity(wedges.len());
        for wedge in wedges.iter() {
            let (part, behind) = std::mem::take(&mut rest).split_at_mut(wedge.len());
            rest = behind;
            parts.push(part);
        }
        let work = parts.into_par_iter().zip(wedges.par_iter()).zip(counts.par_iter_mut());
        work.for_each(|((out, wedge), counts)| {
            let mut buffers = buffers_of(walks);
            let Buffers { walk, dimming, wedge: shared, rays } = &mut *buffers;
            walk.restart();
            let pixels = &by_angle[wedge.clone()];
            rays.clear();
            if pixels.len() >= SHARED_BY[0] && pixels[0].0.is_finite() {
                rays.extend(pixels.iter().filter_map(|&(_, index)| {
                    match LightOnRay::new(frame.light(), eye, &ray_of(index)) {
                        LightOnRay::Plane(shadow) => Some(WedgeRay { shadow, end: ray_ends[index as usize] }),
                        _ => None,
                    }
                }));
            }
            let is_shared = rays.len() == pixels.len() && shared.gather(caster, eye, sun, rays, walk);
            for (number, (out, &(_, index))) in out.iter_mut().zip(pixels).enumerate() {
                let ray = ray_of(index);
                let radiance = if is_shared {
                    shared.collect(caster, &rays[number], walk);
                    let light = LightOnRay::Plane(rays[number].shadow);
                    union_radiance(caster, walk, dimming, frame, &ray, &light, rays[number].end)
                } else {
                    ray_radiance(caster, walk, dimming, frame, &ray, ray_ends[index as usize])
                };
                *out = radiance.as_vec3().to_array();
            }
            *counts = walk.counts;
        });
        let (inscattered, transmittance) = out.pixels_mut();
        for (&(_, index), radiance) in by_angle.iter().zip(sorted.iter()) {
            inscattered[index as usize] = *radiance;
        }
        transmittance.par_iter_mut().zip(ray_ends.par_iter()).enumerate().for_each(|(index, (out, &end))| {
            let through = match frame.medium().height_falloff() {
                None => frame.medium().transmittance(end),
                Some(_) => frame.medium().transmittance_along(eye, &ray_of(index as u32), end),
            };
            *out = through.map(|t| t as f32);
        });
    }

    fn integrate_rows(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) {
        let [width, height] = frame.size();
        self.counts.clear();
        self.counts.resize(height as usize, WalkCounts::default());
        let Self { caster, ray_ends, walks, counts, .. } = self;
        let width = width as usize;
        let (inscattered, transmittance) = out.pixels_mut();
        let ray_ends = &*ray_ends;
        let images = (inscattered, transmittance, counts.as_mut_slice());
        parallel::for_each_band(images, [width, 1], |y, inscattered, transmittance, counts| {
            let ends = &ray_ends[y * width..][..width];
            let mut buffers = buffers_of(walks);
            let Buffers { walk, dimming, .. } = &mut *buffers;
            walk.restart();
            for x in 0..width {
                let ray = frame.camera().pixel_ray(x as u32, y as u32);
                let radiance = ray_radiance(caster, walk, dimming, frame, &ray, ends[x]);
                inscattered[x] = radiance.as_vec3().to_array();
                let eye = frame.camera().eye();
                let through = frame.medium().transmittance_along(eye, &ray, ends[x]);
                transmittance[x] = through.map(|t| t as f32);
            }
            counts[0] = walk.counts;
        });
    }

    fn memory_bytes(&self) -> u64 {
        let walks = self.walks.iter().map(|buffers| buffers.lock().map_or(0, |all| all.memory_bytes()));
        let bytes = self.ray_ends.capacity() * size_of::<f64>()
            + self.counts.capacity() * size_of::<WalkCounts>()
            + self.by_angle.capacity() * size_of::<(f64, u32)>()
            + self.sorted.capacity() * size_of::<[f32; 3]>()
            + self.wedges.capacity() * size_of::<Range<usize>>();
        bytes as u64 + walks.sum::<u64>()
    }
}

impl Buffers {
    fn memory_bytes(&self) -> u64 {
        let rays = self.rays.capacity() * size_of::<WedgeRay>();
        self.walk.memory_bytes() + self.dimming.memory_bytes() + self.wedge.memory_bytes() + rays as u64
    }
}

/// The buffers of this thread of the pool.
fn buffers_of(walks: &[Mutex<Buffers>]) -> MutexGuard<'_, Buffers> {
    let thread = rayon::current_thread_index().unwrap_or(0) % walks.len();
    // Poisoned buffers hold nothing that the next one reads.
    walks[thread].lock().unwrap_or_else(PoisonError::into_inner)
}

impl VolumetricShadow for RaycastTruth<'_> {
    fn id(&self) -> &'static str {
        "truth-raycast"
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.capabilities().check(frame)?;
        if self.caster.cards().longest_line() > MOST_TEXELS {
            let reason = "a cut-out triangle shows over four million texels of its texture in a row, and every border \
                          between two of them is a border of its shadow; give it smaller texture coordinates";
            return Err(Unsupported { reason: reason.into() });
        }
        Ok(())
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
        let total = |count: fn(&WalkCounts) -> u64| self.counts.iter().map(count).sum();
        stats.counts.push("boxes", total(|c| c.boxes));
        stats.counts.push("candidates", total(|c| c.candidates));
        stats.counts.push("intervals", total(|c| c.intervals));
        stats.modelled.push("exact-visibility", ());
        // No map is read.
        let facts = SceneFacts {
            casts_shadow: false,
            translucent: self.caster.occluders().is_some(),
            ..SceneFacts::of_setup(frame.setup())
        };
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
    dimming: &mut Dimming,
    frame: &Frame<'_>,
    ray: &ViewRay,
    end: f64,
) -> DVec3 {
    let light = LightOnRay::new(frame.light(), frame.camera().eye(), ray);
    walk.spans.reset(end);
    match &light {
        LightOnRay::Plane(shadow) => walk.collect(caster, shadow, end),
        // A surface before the light shadows all before it, and the ray does not get past it. Without one all points
        // see the light: those behind a lamp too, since the ray ends at the first surface behind it.
        LightOnRay::Towards(plane, distance) => {
            if caster.any_crossing(plane, *distance) {
                walk.spans.add(0.0, end);
            }
        }
        // Light that comes from behind reaches all of the ray or nothing.
        LightOnRay::Away(plane, distance) => {
            let back = RayPlane::any(plane.reference, plane.start, -plane.along);
            if caster.any_crossing(&back, *distance) {
                walk.spans.add(0.0, end);
            }
        }
    }
    union_radiance(caster, walk, dimming, frame, ray, &light, end)
}

/// In-scattered radiance of one ray whose shadows the walk holds.
fn union_radiance(
    caster: &SceneCaster,
    walk: &ShadowWalk,
    dimming: &mut Dimming,
    frame: &Frame<'_>,
    ray: &ViewRay,
    light: &LightOnRay,
    end: f64,
) -> DVec3 {
    let radiance = RayRadiance::new(frame, ray);
    if let Some(occluders) = caster.occluders()
        && !walk.spans.is_full()
        && dimming.gather(occluders, light, end)
    {
        let radiance = radiance.with_whole(end);
        let in_plane = light.in_plane();
        return walk.spans.lit().map(|(a, b)| dimming.radiance(occluders, in_plane, &radiance, [a, b])).sum();
    }
    walk.spans.lit().map(|(a, b)| radiance.lit(a, b)).sum()
}
