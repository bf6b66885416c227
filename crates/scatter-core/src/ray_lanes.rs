//! Sixteen view rays side by side, and where a lamp and its cone are along each of them; f64, no branch a lane.
//!
//! The same formulas as [`LampRay`](crate::LampRay) and the cone of the exact form (`lamp_interval.rs`), in loops over
//! lanes that compilers vectorise. They stay in f64 because two things cancel: the distance of a ray that nearly meets
//! the lamp, and the roots of a cone that it nearly touches. What leaves here in f32 are numbers without that.

use glam::DVec3;

use crate::camera::{Camera, Projection, ViewRay, Window};
use crate::lamp_interval::CLOSEST_SHARE;
use crate::light::{PointLight, SpotLight};

/// [`RayLanes::COUNT`].
pub(crate) const LANES: usize = 16;

/// A number for each ray.
type Wide = [f64; LANES];

/// Farthest point of a ray in units of its distance to the lamp: its square fits into f32.
const FARTHEST: f64 = 1e15;

/// Sixteen view rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayLanes {
    /// Starts relative to the eye, `[axis][ray]`.
    pub origin: [Wide; 3],
    /// Unit directions, `[axis][ray]`.
    pub direction: [Wide; 3],
}

impl RayLanes {
    /// How many rays stand side by side.
    pub const COUNT: usize = LANES;

    /// Any rays, `ray(0)` to `ray(15)`.
    pub fn from_fn(ray: impl Fn(usize) -> ViewRay) -> Self {
        let mut lanes = Self { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3] };
        for lane in 0..LANES {
            let ray = ray(lane);
            for axis in 0..3 {
                lanes.origin[axis][lane] = ray.origin[axis];
                lanes.direction[axis][lane] = ray.direction[axis];
            }
        }
        lanes
    }

    /// The rays of sixteen pixels from `(x, y)` on, as [`Camera::pixel_ray`] has them; the image may end before them.
    #[inline(always)]
    pub fn of_pixels(camera: &Camera, x: u32, y: u32) -> Self {
        let Window { left, right, bottom, top } = camera.window();
        let size = camera.size().map(f64::from);
        let down = (f64::from(y) + 0.5) / size[1];
        let v = top + (bottom - top) * down;
        let left_of_row = left + camera.shear() * down;
        let (first, step) = (f64::from(x) + 0.5, (right - left) / size[0]);
        let up = camera.up() * v;
        let (line, across) = match camera.projection() {
            Projection::Perspective => (camera.forward() + up, camera.right()),
            Projection::Orthographic => (up, camera.right()),
        };
        let mut ways = [[0.0; LANES]; 3];
        for (ways, (line, across)) in ways.iter_mut().zip(line.to_array().into_iter().zip(across.to_array()))
        {
            for (lane, way) in ways.iter_mut().enumerate() {
                let u = left_of_row + step * (first + lane as f64);
                *way = line + across * u;
            }
        }
        if let Some(travel) = camera.parallel_direction() {
            return Self { origin: ways, direction: travel.to_array().map(|axis| [axis; LANES]) };
        }
        let [x, y, z] = &mut ways;
        for lane in 0..LANES {
            let shrink = 1.0 / (x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]).sqrt();
            x[lane] *= shrink;
            y[lane] *= shrink;
            z[lane] *= shrink;
        }
        Self { origin: [[0.0; LANES]; 3], direction: ways }
    }
}

/// A lamp as all rays of a frame see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LampPlace {
    /// Relative to the eye.
    lamp: DVec3,
    /// Rays that pass closer are taken at this distance.
    nearest: f64,
    cone: Option<Cone>,
}

#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: DVec3,
    cos_outer: f64,
    cos_full: f64,
    slope: f64,
}

/// Where the lamp is along each ray. Points of a ray are `y = (t − t₀)/h`, h the distance of the closest approach and t₀
/// its ray parameter.
pub(crate) struct LampLanes {
    pub(crate) closest: Wide,
    pub(crate) distance: Wide,
    /// 1/h.
    pub(crate) inverse: Wide,
}

/// The cone along each ray: `saturate((cos − cos_outer)·slope)²` with `cos = (along·y + across)/√(1 + y²)`.
pub(crate) struct ConeLanes {
    pub(crate) cos_outer: f64,
    pub(crate) slope: f64,
    pub(crate) along: Wide,
    pub(crate) across: Wide,
    /// Between which points the cone is above 0.
    pub(crate) lit: [Wide; 2],
    /// Between which points it is 1; empty at the far end of `lit` where it never is.
    pub(crate) full: [Wide; 2],
}

impl LampPlace {
    pub(crate) fn new(lamp: &PointLight, spot: Option<&SpotLight>, eye: DVec3) -> Self {
        let relative = lamp.position() - eye;
        let cone = spot.map(|spot| Cone {
            axis: spot.direction(),
            cos_outer: spot.cos_outer(),
            cos_full: spot.cos_full(),
            slope: spot.cone_slope(),
        });
        let nearest = (CLOSEST_SHARE * relative.length()).max(lamp.radius());
        Self { lamp: relative, nearest, cone }
    }

    /// Where the lamp is along the rays.
    #[inline(always)]
    pub(crate) fn on(&self, rays: &RayLanes) -> LampLanes {
        let ([ox, oy, oz], [dx, dy, dz]) = (&rays.origin, &rays.direction);
        let lamp = self.lamp;
        let mut lanes = LampLanes { closest: [0.0; LANES], distance: [0.0; LANES], inverse: [0.0; LANES] };
        for lane in 0..LANES {
            let to = [lamp.x - ox[lane], lamp.y - oy[lane], lamp.z - oz[lane]];
            let way = [dx[lane], dy[lane], dz[lane]];
            lanes.closest[lane] = to[0] * way[0] + to[1] * way[1] + to[2] * way[2];
            // The cross product keeps the digits that √(L² − t₀²) cancels.
            let cross = [
                to[1] * way[2] - to[2] * way[1],
                to[2] * way[0] - to[0] * way[2],
                to[0] * way[1] - to[1] * way[0],
            ];
            let distance = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
            lanes.distance[lane] = distance.max(self.nearest);
            lanes.inverse[lane] = 1.0 / lanes.distance[lane];
        }
        lanes
    }

    /// The cone along the rays, between two points of each; `None` for a point light.
    #[inline(always)]
    pub(crate) fn cone_on(&self, rays: &RayLanes, at: &LampLanes, ends: &[Wide; 2]) -> Option<ConeLanes> {
        let cone = self.cone.as_ref()?;
        let ([ox, oy, oz], [dx, dy, dz]) = (&rays.origin, &rays.direction);
        let (axis, lamp) = (cone.axis, self.lamp);
        let zero = [0.0; LANES];
        let Cone { cos_outer, slope, .. } = *cone;
        let mut lanes =
            ConeLanes { cos_outer, slope, along: zero, across: zero, lit: [zero; 2], full: [zero; 2] };
        for lane in 0..LANES {
            let along = axis.x * dx[lane] + axis.y * dy[lane] + axis.z * dz[lane];
            // From the lamp to the foot of the perpendicular on the ray, as a share of the (clamped) distance.
            let t = at.closest[lane];
            let foot = [
                ox[lane] + dx[lane] * t - lamp.x,
                oy[lane] + dy[lane] * t - lamp.y,
                oz[lane] + dz[lane] * t - lamp.z,
            ];
            lanes.along[lane] = along;
            lanes.across[lane] = (axis.x * foot[0] + axis.y * foot[1] + axis.z * foot[2]) * at.inverse[lane];
        }
        let outer = inside(cos_outer, &lanes.along, &lanes.across);
        let full = inside(cone.cos_full, &lanes.along, &lanes.across);
        for lane in 0..LANES {
            let clamp = |y: f64, least: f64, most: f64| y.max(least).min(most);
            let [a, b] = [ends[0][lane], ends[1][lane]];
            let from = clamp(outer[0][lane], a, b);
            let to = clamp(outer[1][lane], from, b);
            let full_from = clamp(full[0][lane], from, to);
            let full_to = clamp(full[1][lane], full_from, to);
            (lanes.lit[0][lane], lanes.lit[1][lane]) = (from, to);
            (lanes.full[0][lane], lanes.full[1][lane]) = (full_from, full_to);
        }
        Some(lanes)
    }
}

impl LampLanes {
    /// The point of each ray parameter, which may be ∞.
    #[inline(always)]
    pub(crate) fn points(&self, t: &[f32; LANES]) -> Wide {
        let mut points = [0.0; LANES];
        for lane in 0..LANES {
            let y = (f64::from(t[lane]) - self.closest[lane]) * self.inverse[lane];
            points[lane] = y.clamp(-FARTHEST, FARTHEST);
        }
        points
    }
}

/// Between which points each ray is inside of a cone with `cos` of its half angle ≥ 0: one stretch, because such a cone is
/// convex. Empty stretches lie at +[`FARTHEST`].
///
/// The ends are roots of `(along·y + across)² = cos²·(1 + y²)`, which the mirrored cone has too; signs of whole terms
/// tell the two apart, never a difference that could be rounding.
#[inline(always)]
fn inside(cos: f64, along: &Wide, across: &Wide) -> [Wide; 2] {
    let mut ends = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        let (along, across) = (along[lane], across[lane]);
        let quadratic = along * along - cos * cos;
        let half_linear = along * across;
        let constant = across * across - cos * cos;
        // half_linear² − quadratic·constant, multiplied out: for a cone of 90° (cos = 6e-17) the difference itself is
        // rounding noise, and a double root would be lost.
        let discriminant = cos * cos * (along * along + across * across - cos * cos);
        // The root that adds, and the other one by Vieta: no cancellation.
        let q = -(half_linear + discriminant.max(0.0).sqrt().copysign(half_linear));
        let (one, other) = (q / quadratic, constant / q);
        let (low, high) = (if one < other { one } else { other }, if one < other { other } else { one });
        // A ray that is steeper against the axis than the cone crosses it between the roots, and it is the cone that the
        // perpendicular points to. A flatter one is inside of it to one side for ever.
        let steep = quadratic < 0.0;
        let forward = along > 0.0;
        let from = if steep || !forward { low } else { high };
        let to = if steep || forward { high } else { low };
        let from = if !steep && !forward { -FARTHEST } else { from };
        let to = if !steep && forward { FARTHEST } else { to };
        // q = 0: the ray touches the cone, or runs along it.
        let misses = discriminant < 0.0 || (steep && across <= 0.0) || q == 0.0;
        ends[0][lane] = if misses { FARTHEST } else { from };
        ends[1][lane] = if misses { FARTHEST } else { to };
    }
    ends
}

/// Writes what lanes found, channel by channel, to up to sixteen pixels that follow each other.
#[inline(always)]
pub fn write_pixels(channels: &[[f32; RayLanes::COUNT]; 3], pixels: &mut [[f32; 3]]) {
    let [red, green, blue] = channels;
    // Sixteen by number are shuffles; fewer are a loop.
    if let Some(pixels) = pixels.first_chunk_mut::<{ RayLanes::COUNT }>() {
        for lane in 0..RayLanes::COUNT {
            pixels[lane] = [red[lane], green[lane], blue[lane]];
        }
        return;
    }
    for (((pixel, red), green), blue) in pixels.iter_mut().zip(red).zip(green).zip(blue) {
        *pixel = [*red, *green, *blue];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;

    #[test]
    fn sixteen_pixels_have_the_rays_that_the_camera_gives_them() {
        let (eye, target, up) = ([1e5, -2.0, 3.0], [1e5 + 4.0, 1.0, -7.0], [0.1, 1.0, 0.0]);
        for camera in [
            Camera::perspective(eye, target, up, 70.0, [37, 11]).unwrap(),
            Camera::orthographic(eye, target, up, 3.0, [37, 11]).unwrap(),
            crate::engine_matrices::sheared_camera([37, 11]),
            crate::engine_matrices::oblique_camera([37, 11]),
        ] {
            for (x, y) in [(0, 0), (16, 5), (32, 10)] {
                let rays = RayLanes::of_pixels(&camera, x, y);
                let exact = RayLanes::from_fn(|lane| camera.pixel_ray(x + lane as u32, y));
                for axis in 0..3 {
                    for lane in 0..LANES {
                        // A handful of roundings of numbers up to 4.
                        assert!((rays.origin[axis][lane] - exact.origin[axis][lane]).abs() < 5e-15);
                        assert!((rays.direction[axis][lane] - exact.direction[axis][lane]).abs() < 5e-15);
                    }
                }
            }
        }
    }

    #[test]
    fn a_cone_is_lit_between_its_ends_and_dark_outside_of_them() {
        for n in 0..2000 {
            let a = f64::from(n);
            let axis = [a.sin(), (1.7 * a).cos(), (0.6 * a).sin()];
            let outer = [0.01, 3.0, 40.0, 75.0, 90.0][n as usize % 5];
            let light = Light::spot([a.cos(), 1.0, -3.0], axis, [1.0; 3], 0.7 * outer, outer, 0.0).unwrap();
            let Light::Spot(spot) = &light else { unreachable!() };
            let place = LampPlace::new(spot.lamp(), Some(spot), DVec3::ZERO);
            // The ray turns with the lane; the second half goes straight along the axis, against it, and across it.
            let towards = |lane: usize| match lane {
                8 => spot.direction(),
                9 => -spot.direction(),
                10 => spot.direction().any_orthonormal_vector(),
                _ => DVec3::new((lane as f64).sin(), (lane as f64).cos(), -1.0).normalize(),
            };
            let rays = RayLanes::from_fn(|lane| ViewRay { origin: DVec3::ZERO, direction: towards(lane) });
            let at = place.on(&rays);
            let ends = [[-1e6; LANES], [1e6; LANES]];
            let cone = place.cone_on(&rays, &at, &ends).unwrap();
            for lane in 0..LANES {
                let cos = |y: f64| (cone.along[lane] * y + cone.across[lane]) / y.hypot(1.0);
                for step in -60..=60 {
                    // From −1e4 to 1e4, close to the lamp and far from it.
                    let y = (f64::from(step) / 6.0).sinh();
                    for (ends, least) in [(&cone.lit, spot.cos_outer()), (&cone.full, spot.cos_full())] {
                        let inside = y >= ends[0][lane] && y <= ends[1][lane];
                        // Within rounding of the edge either is right.
                        let sure = (cos(y) - least).abs() > 1e-12;
                        assert!(!sure || inside == (cos(y) > least), "{n} {lane} {y}: {} {least}", cos(y));
                    }
                }
            }
        }
    }
}
