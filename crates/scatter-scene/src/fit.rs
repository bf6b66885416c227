//! Where a shot's shadow map looks: the projection that holds all that matters for the image, and little else.
//!
//! Sun: the bounding rectangle, in light space, of all view rays up to their ends, each cut to the rectangle of the
//! scene (a point beside it is shadowed by nothing). The near plane lies before the whole scene, so occluders behind
//! the camera count. Its sides lie on a coarse grid, so that one pixel's rounding moves no texel. Cascades are the same for stretches of the rays, by the practical split scheme (Zhang et al.
//! 2006). Spot: square, twice the outer angle; wider than 80° and point lights: six cube faces.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scatter_core::{Camera, DepthMap, Light, MapProjection, ModelError};

use crate::caster::SceneCaster;
use crate::map_resolution::MapResolution;

/// Projections of a light's shadow maps, fitted for a shot.
#[derive(Debug, Clone, PartialEq)]
pub enum FittedMap {
    /// A sun's parallel map.
    Orthographic(MapProjection),
    /// A spot's perspective map.
    Perspective(MapProjection),
    /// Six faces around a lamp.
    Cube {
        /// Where the lamp is.
        position: [f64; 3],
        /// Texels along an edge.
        size: u32,
    },
    /// A sun's parallel maps, from the nearest stretch of the view to the farthest.
    Cascades(Vec<MapProjection>),
}

/// Half angle \[radians\] from which on a spot has cube faces: 80° (MODEL.md, Conventions).
const WIDEST_PERSPECTIVE: f64 = 80.0 * std::f64::consts::PI / 180.0;
/// Share by which a spot's map is wider than its cone: its edge, where the light is 0 anyway, lies inside of the
/// outermost texels in spite of all rounding, and no texel becomes larger by more than that.
const SPOT_SLACK: f64 = 1e-6;
/// Texels around the rectangle of what is seen. Below one a point at its edge could round to the outside, which
/// counts as lit.
const BORDER_TEXELS: f64 = 1.0;
/// The rectangle's sides lie on a grid of this share of its size (rounded up to a power of two), outwards. The depth of
/// a single pixel decides where a side lies; without a grid its last bit would move every texel of the map, and with
/// them the thinnest shafts. Larger: texels are wasted. Smaller: rounding moves the map more often.
const FIT_GRID: f64 = 1.0 / 4096.0;
/// Weight of the logarithmic split against the uniform one (Zhang et al. 2006 use 0.5).
const LOGARITHMIC_SHARE: f64 = 0.5;

/// The projection for a light; `size` texels a side (of a face, for a cube). `depth` holds the first surfaces that the
/// camera sees; `max_distance` is where the other rays end.
pub fn fit_map(
    caster: &SceneCaster,
    camera: &Camera,
    depth: DepthMap<'_>,
    light: &Light,
    max_distance: f64,
    resolution: MapResolution,
) -> Result<FittedMap, ModelError> {
    let MapResolution { side: size, cascades } = resolution.checked()?;
    match light {
        Light::Directional(sun) if cascades > 1 => {
            fit_cascades(caster, camera, depth, sun.direction(), max_distance, size, cascades)
        }
        Light::Directional(sun) => {
            let space = SunSpace::new(caster, sun.direction());
            let seen = space.seen(camera, depth, [0.0, max_distance]);
            space.projection(seen, size).map(FittedMap::Orthographic)
        }
        Light::Point(lamp) => Ok(FittedMap::Cube { position: lamp.position().to_array(), size }),
        Light::Spot(spot) if spot.outer() > WIDEST_PERSPECTIVE => {
            Ok(FittedMap::Cube { position: spot.lamp().position().to_array(), size })
        }
        Light::Spot(spot) => {
            let axis = spot.direction();
            MapProjection::perspective(
                spot.lamp().position().to_array(),
                axis.to_array(),
                across(axis).to_array(),
                spot.outer().tan() * (1.0 + SPOT_SLACK),
                size,
            )
            .map(FittedMap::Perspective)
        }
    }
}

/// `count` ≥ 1 parallel maps of a sun that shines along `direction`, nearest stretch of the view first.
fn fit_cascades(
    caster: &SceneCaster,
    camera: &Camera,
    depth: DepthMap<'_>,
    direction: DVec3,
    max_distance: f64,
    size: u32,
    count: u32,
) -> Result<FittedMap, ModelError> {
    let space = SunSpace::new(caster, direction);
    // Beyond the far side of the scene's sphere no view ray is inside of the scene.
    let (centre, radius) = caster.sphere();
    let farthest = camera.eye().distance(centre) + radius;
    let ends = depth.texels().iter().map(|&d| f64::from(d).min(max_distance).min(farthest));
    let (near, far) = ends.fold((f64::INFINITY, 0.0), |(low, high), d| (d.min(low), d.max(high)));
    // A near split of a thousandth of the range: smaller ones would spend a cascade on nothing.
    let near = near.clamp(1e-3 * far, far);
    let split = |index: u32| {
        let share = f64::from(index) / f64::from(count.max(1));
        let logarithmic = if near > 0.0 { near * (far / near).powf(share) } else { 0.0 };
        LOGARITHMIC_SHARE * logarithmic + (1.0 - LOGARITHMIC_SHARE) * (near + share * (far - near))
    };
    (0..count.max(1))
        .map(|index| {
            let from = if index == 0 { 0.0 } else { split(index) };
            let to = if index + 1 == count.max(1) { max_distance } else { split(index + 1) };
            space.projection(space.seen(camera, depth, [from, to]), size)
        })
        .collect::<Result<_, _>>()
        .map(FittedMap::Cascades)
}

/// A unit vector across `axis`, near the coordinate axis that is farthest from it.
fn across(axis: DVec3) -> DVec3 {
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

/// A rectangle in light space.
#[derive(Debug, Clone, Copy)]
struct Rectangle {
    low: DVec2,
    high: DVec2,
}

impl Rectangle {
    const EMPTY: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    fn with(self, p: DVec2) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn is_empty(&self) -> bool {
        !(self.low.x <= self.high.x && self.low.y <= self.high.y)
    }

    /// The rectangle with its sides moved outwards to the grid of [`FIT_GRID`].
    fn on_grid(&self) -> Self {
        let size = (self.high - self.low).max_element();
        let step = size.log2().ceil().exp2() * FIT_GRID;
        if !step.is_normal() {
            return *self;
        }
        Self { low: (self.low / step).floor() * step, high: (self.high / step).ceil() * step }
    }

    /// The stretch of `start + t·step`, t in `[from, to]`, inside of the rectangle (Liang and Barsky 1984).
    fn clip(&self, start: DVec2, step: DVec2, [from, to]: [f64; 2]) -> Option<[DVec2; 2]> {
        if self.is_empty() {
            return None;
        }
        let (mut enter, mut leave) = (from, to);
        for axis in 0..2 {
            let (low, high) = (self.low[axis] - start[axis], self.high[axis] - start[axis]);
            if step[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / step[axis], high / step[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // An endless stretch that stays inside does not move at all: any finite t will do.
        let at = |t: f64| start + step * t.min(f64::MAX);
        (enter <= leave).then(|| [at(enter), at(leave)])
    }
}

/// Coordinates across a sun's direction, relative to the scene's centre.
struct SunSpace {
    centre: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    scene: Rectangle,
    /// Smallest and largest depth of the scene.
    depth: [f64; 2],
}

impl SunSpace {
    fn new(caster: &SceneCaster, forward: DVec3) -> Self {
        let (centre, _) = caster.sphere();
        let up = across(forward);
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
        space
    }

    fn flat(&self, v: DVec3) -> DVec2 {
        DVec2::new(self.right.dot(v), self.up.dot(v))
    }

    /// What the camera sees of the scene's rectangle between two distances along its rays.
    fn seen(&self, camera: &Camera, depth: DepthMap<'_>, [from, to]: [f64; 2]) -> Rectangle {
        let [width, height] = camera.size();
        let eye = camera.eye() - self.centre;
        let rows = (0..height).into_par_iter().map(|y| {
            (0..width).fold(Rectangle::EMPTY, |seen, x| {
                let ray = camera.pixel_ray(x, y);
                let end = f64::from(depth.at(x, y)).min(to);
                let (start, step) = (self.flat(eye + ray.origin), self.flat(ray.direction));
                match self.scene.clip(start, step, [from, end]) {
                    Some([a, b]) => seen.with(a).with(b),
                    None => seen,
                }
            })
        });
        rows.reduce(|| Rectangle::EMPTY, Rectangle::joined)
    }

    /// The map over a rectangle; over the whole scene if it is empty, over anything if the scene is.
    fn projection(&self, seen: Rectangle, size: u32) -> Result<MapProjection, ModelError> {
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
