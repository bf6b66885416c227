//! What a light does in the plane that it spans with a view ray: which stretch of the ray a segment shadows.
//!
//! All shadow rays from one view ray to one light lie in one plane (MODEL.md, References). With x along the ray
//! and y towards the light, a blocker at (x, y), y ≥ 0, shadows the ray's point
//!
//! ```text
//!     sun:   t = x − y·cot(angle between ray and light)
//!     lamp:  t = t₀ + (x − t₀)·h/(h − y),   y < h,   lamp at (t₀, h)
//! ```
//!
//! Both maps are monotone along a segment, so a segment shadows the stretch between the images of its ends: cut at
//! y = 0, where the surface meets the ray itself, and at y = h, where the image is ±∞.

use glam::{DVec2, DVec3, Vec4};
use scatter_core::{Light, ViewRay};

use crate::caster::{PlanePoint, RayPlane, Segment};
use crate::tree::{Bvh, F32_ROUNDING, Node};

/// Sine of the angle below which a ray counts as parallel to the light (or as one through the lamp). The plane's
/// normal then has 2⁻⁵²/1e-9 = 2e-7 of relative error left, a displacement of the light by less than its rounding;
/// taking the ray as parallel moves a shadow ray by 1e-9 of its length.
const PARALLEL: f64 = 1e-9;

/// The light as a view ray sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) enum LightOnRay {
    /// Light and ray span a plane.
    Plane(ShadowPlane),
    /// The ray runs to a light at this distance in front of its start (∞: the sun).
    Towards(RayPlane, f64),
    /// The ray runs away from a light at this distance behind its start (∞: the sun).
    Away(RayPlane, f64),
}

/// A light in the plane that it spans with a view ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PlaneLight {
    /// The unit direction towards a sun.
    Sun(DVec2),
    /// Where a lamp is.
    Lamp(DVec2),
}

/// The plane of a view ray and a light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadowPlane {
    pub plane: RayPlane,
    image: Image,
}

#[derive(Debug, Clone, Copy)]
enum Image {
    Sun { cotangent: f64 },
    Lamp { closest: f64, height: f64 },
}

/// The part of a segment between the ray and the light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LitPart {
    /// Where it begins and ends, as shares of the segment, ascending.
    pub shares: [f64; 2],
    /// The points of the ray that its ends shadow.
    pub shadow: [f64; 2],
}

/// Linear functions of the position that bound the shadow of a box, in f32 with their rounding.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxShadow {
    columns: [Vec4; 3],
    bias: Vec4,
    margin: Vec4,
    lamp: Option<LampInBox>,
}

#[derive(Debug, Clone, Copy)]
struct LampInBox {
    closest: f64,
    height: f32,
}

impl LightOnRay {
    /// For a view ray of a camera whose eye is at `eye` (world space).
    pub fn new(light: &Light, eye: DVec3, ray: &ViewRay) -> Self {
        let along = ray.direction;
        let to_light = match light {
            Light::Directional(sun) => -sun.direction(),
            Light::Point(lamp) => (lamp.position() - eye) - ray.origin,
            Light::Spot(spot) => (spot.lamp().position() - eye) - ray.origin,
        };
        let is_sun = matches!(light, Light::Directional(_));
        let (ahead, cross) = (along.dot(to_light), along.cross(to_light));
        if !(cross.length() > PARALLEL * to_light.length()) {
            let any = RayPlane::any(eye, ray.origin, along);
            let distance = if is_sun { f64::INFINITY } else { ahead.abs() };
            return if ahead > 0.0 { Self::Towards(any, distance) } else { Self::Away(any, distance) };
        }
        // The cross product's rounding has a component along the ray; without it the ray lies in the plane.
        let normal = cross.normalize();
        let normal = (normal - along * normal.dot(along)).normalize();
        let plane = RayPlane::with_normal(eye, ray.origin, along, normal);
        let height = to_light.dot(plane.up);
        let image = if is_sun {
            Image::Sun { cotangent: ahead / height }
        } else {
            Image::Lamp { closest: ahead, height }
        };
        Self::Plane(ShadowPlane { plane, image })
    }

    /// Where the light is in that plane, with x along the ray from its start and y towards the light.
    pub fn in_plane(&self) -> PlaneLight {
        let at = |x: f64| {
            if x.is_infinite() {
                PlaneLight::Sun(DVec2::new(x.signum(), 0.0))
            } else {
                PlaneLight::Lamp(DVec2::new(x, 0.0))
            }
        };
        match self {
            Self::Plane(ShadowPlane { image: Image::Sun { cotangent }, .. }) => {
                PlaneLight::Sun(DVec2::new(*cotangent, 1.0) / cotangent.hypot(1.0))
            }
            Self::Plane(ShadowPlane { image: Image::Lamp { closest, height }, .. }) => {
                PlaneLight::Lamp(DVec2::new(*closest, *height))
            }
            Self::Towards(_, distance) => at(*distance),
            Self::Away(_, distance) => at(-distance),
        }
    }

    /// The plane in which the ray's first hit is looked for.
    pub fn plane(&self) -> &RayPlane {
        match self {
            Self::Plane(shadow) => &shadow.plane,
            Self::Towards(plane, _) | Self::Away(plane, _) => plane,
        }
    }
}

impl ShadowPlane {
    /// Of a sun: the cotangent of its angle to the ray. 0 for a lamp.
    pub fn cotangent(&self) -> f64 {
        match self.image {
            Image::Sun { cotangent } => cotangent,
            Image::Lamp { .. } => 0.0,
        }
    }

    /// Of a sun: the unit vector in the plane, perpendicular to its direction, on the side of the ray.
    pub fn across(&self) -> DVec3 {
        let RayPlane { along, up, .. } = self.plane;
        let cotangent = self.cotangent();
        // (along − up·cot)/√(1 + cot²): sin·along − cos·up.
        (along - up * cotangent) / cotangent.hypot(1.0)
    }

    /// The stretch of the ray that a segment shadows, not cut to the ray.
    #[inline]
    pub fn shadow(&self, segment: &Segment) -> Option<(f64, f64)> {
        let [p, q] = self.lit_part(segment)?.shadow;
        Some((p.min(q), p.max(q)))
    }

    /// The part of a segment that the light meets before the ray, with the shadows of its ends.
    #[inline]
    pub fn lit_part(&self, segment: &Segment) -> Option<LitPart> {
        let Segment(a, b) = segment;
        let outside = |p: &PlanePoint| p.y < 0.0;
        match self.image {
            Image::Sun { cotangent } => {
                if outside(a) && outside(b) {
                    return None;
                }
                let image = |p: &PlanePoint| p.x - p.y * cotangent;
                Some(match (segment.crossing(), segment.crossing_share()) {
                    (Some(on_ray), Some(share)) if outside(a) => {
                        LitPart { shares: [share, 1.0], shadow: [on_ray, image(b)] }
                    }
                    (Some(on_ray), Some(share)) => {
                        LitPart { shares: [0.0, share], shadow: [image(a), on_ray] }
                    }
                    _ => LitPart { shares: [0.0, 1.0], shadow: [image(a), image(b)] },
                })
            }
            Image::Lamp { closest, height } => {
                let beyond = |p: &PlanePoint| p.y >= height;
                if (outside(a) && outside(b)) || (beyond(a) && beyond(b)) {
                    return None;
                }
                let (on_ray, crossing_share) = (segment.crossing(), segment.crossing_share());
                // Of an end, as seen from it: its share and its shadow.
                let image = |p: &PlanePoint, other: &PlanePoint, share: f64| {
                    if outside(p) {
                        // One end is outside and the other is not: the segment crosses.
                        (crossing_share.unwrap_or(share), on_ray.unwrap_or(p.x))
                    } else if beyond(p) {
                        let weight = (height - p.y) / (other.y - p.y);
                        let at_height = p.x + (other.x - p.x) * weight;
                        ((share - weight).abs(), f64::INFINITY.copysign(at_height - closest))
                    } else {
                        (share, closest + (p.x - closest) * (height / (height - p.y)))
                    }
                };
                let (first, last) = (image(a, b, 0.0), image(b, a, 1.0));
                Some(LitPart { shares: [first.0, last.0], shadow: [first.1, last.1] })
            }
        }
    }

    /// The point of the ray that a place on a segment's [`Self::lit_part`] shadows; between the shadows of its ends.
    #[inline]
    pub fn shadow_of(&self, segment: &Segment, part: &LitPart, share: f64) -> f64 {
        let p = segment.at(share);
        let image = match self.image {
            Image::Sun { cotangent } => p.x - p.y * cotangent,
            Image::Lamp { closest, height } => closest + (p.x - closest) * (height / (height - p.y).max(0.0)),
        };
        let [first, last] = part.shadow;
        // A NaN, 0 times ∞ at the lamp itself, becomes an end.
        image.max(first.min(last)).min(first.max(last))
    }

    /// The shares of a segment's lit part that shadow the ray within `[low, high]`, and a little more.
    #[inline]
    pub fn shares_within(&self, segment: &Segment, part: &LitPart, low: f64, high: f64) -> [f64; 2] {
        let Segment(a, b) = segment;
        let (width, rise) = (b.x - a.x, b.y - a.y);
        // Both images are quotients of linear functions of the share, so their inverses are too.
        let share = |t: f64| match self.image {
            Image::Sun { cotangent } => (t - (a.x - a.y * cotangent)) / (width - rise * cotangent),
            Image::Lamp { closest, height } => {
                let t = t - closest;
                (t * (height - a.y) - (a.x - closest) * height) / (width * height + t * rise)
            }
        };
        let [start, end] = part.shares;
        let [first, last] = part.shadow;
        // What lies beyond the stretch says nothing, and a share beyond the part is the part's own end.
        let at = |t: f64, otherwise: f64| {
            let share = if first.min(last) < t && t < first.max(last) { share(t) } else { otherwise };
            if share.is_nan() { otherwise } else { share }
        };
        let (from, to) =
            if first <= last { (at(low, start), at(high, end)) } else { (at(high, start), at(low, end)) };
        // Rounding where shares are of order 1; whoever asks cuts to the stretch again.
        const SLACK: f64 = 1e-9;
        [(from - SLACK).max(start), (to + SLACK).min(end)]
    }

    /// The functions that bound the shadows of boxes of this tree.
    pub fn box_shadow(&self, bvh: &Bvh) -> BoxShadow {
        let RayPlane { reference, start, along, up, normal } = self.plane;
        let centre = (bvh.centre - reference) - start;
        let (rows, shifts, lamp) = match self.image {
            Image::Sun { cotangent } => ([normal, along - cotangent * up, up], [0.0; 3], None),
            Image::Lamp { closest, height } => (
                [normal, along, -up],
                [0.0, -closest, height],
                // Rounded up, so that no box below the ray's line is lost to it.
                Some(LampInBox { closest, height: height as f32 * (1.0 + f32::EPSILON) }),
            ),
        };
        let of_rows = |f: &dyn Fn(usize) -> f64| Vec4::new(f(0) as f32, f(1) as f32, f(2) as f32, 0.0);
        let bias = of_rows(&|row| rows[row].dot(centre) + shifts[row]);
        // f64 rounding of the bias where its terms cancel far from the origin.
        let cancelled = of_rows(&|row| {
            1e-15
                * (rows[row].abs().dot(bvh.centre.abs() + reference.abs() + start.abs()) + shifts[row].abs())
        });
        BoxShadow {
            columns: [0, 1, 2].map(|axis| of_rows(&|row| rows[row][axis])),
            bias,
            // Of the bias and of the sums with it: fewer than 8. What rounds against a box is in the box.
            margin: bias.abs() * (8.0 * F32_ROUNDING) + cancelled,
            lamp,
        }
    }
}

impl BoxShadow {
    /// A stretch of the ray that holds the shadow of all that is in the box; `None` if nothing in it meets the plane
    /// on the light's side.
    #[inline(always)]
    pub fn of(&self, node: &Node) -> Option<(f64, f64)> {
        let (c, h) = (node.centre(), node.half());
        let [x, y, z] = self.columns;
        let middle = x * c.x + y * c.y + z * c.z + self.bias;
        let reach = x.abs() * h.x + y.abs() * h.y + z.abs() * h.z + self.margin;
        let (low, high) = (middle - reach, middle + reach);
        // Comparisons with NaN (an overflow) keep the box.
        if low.x > 0.0 || high.x < 0.0 || high.z < 0.0 {
            return None;
        }
        let Some(lamp) = self.lamp else {
            return Some((low.y.into(), high.y.into()));
        };
        if low.z > lamp.height {
            return None;
        }
        // x − t₀ in [low.y, high.y] over h − y in [near, far]: the quotient's extremes are at corners.
        let (near, far) = (low.z.max(0.0), high.z.min(lamp.height));
        let from_closest = |x: f32, outward: bool| x * (lamp.height / if outward { near } else { far });
        let (first, last) = (from_closest(low.y, low.y < 0.0), from_closest(high.y, high.y > 0.0));
        // Three roundings in each; the sum with the closest approach is taken in f64.
        let slack = 8.0 * F32_ROUNDING;
        Some((
            lamp.closest + f64::from(first - slack * first.abs()),
            lamp.closest + f64::from(last + slack * last.abs()),
        ))
    }
}
