//! A scene and its view rays as a sun sees them, and the map over a rectangle of that.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scatter_core::{Camera, DepthMap, MapProjection, ModelError};

use super::light_rectangle::{FlatRay, Rectangle};
use crate::caster::SceneCaster;
use crate::translucent::Occluders;

/// Texels around the rectangle of what is seen. Below one a point at its edge could round to the outside, which
/// counts as lit.
const BORDER_TEXELS: f64 = 1.0;

/// What the camera sees: its rays, each up to its first surface.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a Camera,
    pub depth: DepthMap<'a>,
    /// Where rays without a surface end.
    pub max_distance: f64,
}

/// A unit vector across `axis`, near the coordinate axis that is farthest from it.
pub fn across(axis: DVec3) -> DVec3 {
    let size = axis.abs();
    let other = if size.y <= size.x && size.y <= size.z {
        DVec3::Y
    } else if size.z <= size.x {
        DVec3::Z
    } else {
        DVec3::X
    };
    (other - axis * other.dot(axis)).normalize()
}

/// Coordinates across a sun's direction, relative to the scene's centre.
pub struct SunSpace {
    centre: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    scene: Rectangle,
    /// Smallest and largest depth of the scene.
    depth: [f64; 2],
}

impl SunSpace {
    /// For light that travels along `forward`; `up` is a unit vector across it.
    pub fn new(caster: &SceneCaster, forward: DVec3, up: DVec3) -> Self {
        let (centre, _) = caster.sphere();
        let right = forward.cross(up);
        let mut space = Self {
            centre,
            right,
            up,
            forward,
            scene: Rectangle::EMPTY,
            depth: [f64::INFINITY, f64::NEG_INFINITY],
        };
        for p in caster.all_corners() {
            let depth = forward.dot(p);
            space.scene = space.scene.with(space.flat(p));
            space.depth = [space.depth[0].min(depth), space.depth[1].max(depth)];
        }
        // What dims light shadows as surfaces do.
        for (p, radius) in caster.occluders().into_iter().flat_map(Occluders::balls) {
            let (flat, depth) = (space.flat(p - centre), forward.dot(p - centre));
            space.scene = space.scene.with(flat - radius).with(flat + radius);
            space.depth = [space.depth[0].min(depth - radius), space.depth[1].max(depth + radius)];
        }
        space
    }

    fn flat(&self, v: DVec3) -> DVec2 {
        DVec2::new(self.right.dot(v), self.up.dot(v))
    }

    /// A pixel's ray with its stretch in the scene's rectangle; `None` if it passes beside it.
    pub fn stretch(&self, view: &View<'_>, x: u32, y: u32) -> Option<(FlatRay, [f64; 2])> {
        let eye = view.camera.eye() - self.centre;
        let ray = view.camera.pixel_ray(x, y);
        let end = f64::from(view.depth.at(x, y)).min(view.max_distance);
        let flat = FlatRay { start: self.flat(eye + ray.origin), step: self.flat(ray.direction) };
        self.scene.clip(&flat, [0.0, end]).map(|stretch| (flat, stretch))
    }

    /// Folds over the stretches of all pixels, rows in parallel; `join` must not mind the order.
    pub fn fold<R: Copy + Send + Sync>(
        &self,
        view: &View<'_>,
        start: R,
        each: impl Fn(R, &FlatRay, [f64; 2]) -> R + Sync,
        join: impl Fn(R, R) -> R + Sync + Send,
    ) -> R {
        let [width, height] = view.camera.size();
        let rows = (0..height).into_par_iter().map(|y| {
            (0..width).fold(start, |folded, x| match self.stretch(view, x, y) {
                Some((ray, stretch)) => each(folded, &ray, stretch),
                None => folded,
            })
        });
        rows.reduce(|| start, join)
    }

    /// What the camera sees of the scene's rectangle.
    pub fn seen(&self, view: &View<'_>) -> Rectangle {
        let both_ends =
            |seen: Rectangle, ray: &FlatRay, [from, to]: [f64; 2]| seen.with(ray.at(from)).with(ray.at(to));
        self.fold(view, Rectangle::EMPTY, both_ends, Rectangle::joined)
    }

    /// The map over a rectangle; over the whole scene if it is empty, over anything if the scene is.
    pub fn projection(&self, seen: Rectangle, size: u32) -> Result<MapProjection, ModelError> {
        let anything = Rectangle { low: DVec2::NEG_ONE, high: DVec2::ONE };
        let rectangle = [seen, self.scene].into_iter().find(|r| !r.is_empty()).unwrap_or(anything).on_grid();
        let [near, far] = if self.scene.is_empty() { [0.0, 1.0] } else { self.depth };
        let scene_size = (self.scene.high - self.scene.low).max_element().max(far - near);
        // A rectangle without a width (a flat scene from its side, a single ray) still needs texels: this small a
        // share of the scene, or any number for a scene without a size.
        let smallest = if scene_size > 0.0 && scene_size.is_finite() { 1e-6 * scene_size } else { 1.0 };
        let texels = f64::from(size);
        let grown = if texels > 4.0 * BORDER_TEXELS { texels / (texels - 2.0 * BORDER_TEXELS) } else { 2.0 };
        let half = (0.5 * (rectangle.high - rectangle.low)).max(DVec2::splat(smallest)) * grown;
        let middle = 0.5 * (rectangle.low + rectangle.high);
        // Before the scene by a thousandth of its size, so that no surface has depth 0.
        let start = near - 1e-3 * scene_size.max(smallest);
        let origin = self.centre + self.right * middle.x + self.up * middle.y + self.forward * start;
        let (forward, up) = (self.forward.to_array(), self.up.to_array());
        MapProjection::orthographic(origin.to_array(), forward, up, half.to_array(), [size; 2])
    }
}
